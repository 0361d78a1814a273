# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures do not depend on the unit of length, and a full turn of the camera changes nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View

DATA = np.random.default_rng(5).random((6, 5, 4))


def rendered(unit: float, fov: float | None) -> Any:
    from spectral_core.volume.renderer import VolumeRenderer

    volume = ScalarVolume.from_spacing("field", DATA, unit * np.array([1.0, 2.0, 0.5]), unit * np.array([3.0, 0, 1]))
    function = TransferFunction((Material("all", [0, 1], np.array([0, min(0.8 / unit, 1e30)]), np.ones(3)),))
    view = View.around(volume, 20.0, 15.0, width=12, height=9, fov_deg=fov)
    return VolumeRenderer(volume).render(view, function, Stepping("error", "midpoint", 0.3)).amounts


@pytest.mark.parametrize("fov", [30.0, None])
@pytest.mark.parametrize("unit", [3e-25, 1e-21, 3e19, 1e27])
def test_very_small_and_very_large_units(unit: float, fov: float | None) -> None:
    """Below 1e-19 the march did not end, and above 1e19 the picture was empty without a message."""
    pytest.importorskip("drjit")
    np.testing.assert_allclose(rendered(unit, fov), rendered(1.0, fov), rtol=2e-3, atol=2e-5)


@pytest.mark.parametrize("unit", [1e-31, 1e31])
def test_units_beyond_single_precision_are_refused(unit: float) -> None:
    pytest.importorskip("drjit")
    with pytest.raises(InvalidInputError, match="edge of a voxel of volume 'field'"):
        rendered(unit, 30.0)


@pytest.mark.parametrize("elevation", [0.0, 25.0, 80.0, -88.0])
def test_a_full_turn_shows_the_same_picture(elevation: float) -> None:
    """Beyond 85 degrees the camera was tilted, and at 180 degrees it could not be placed."""
    volume = ScalarVolume("field", DATA)
    for azimuth in (0.0, 90.0):
        plain, turned = (View.around(volume, azimuth, elevation + turn).world_from_camera for turn in (0.0, 360.0))
        np.testing.assert_allclose(plain, turned, atol=1e-9)
    View.around(volume, 90.0, 180.0)
