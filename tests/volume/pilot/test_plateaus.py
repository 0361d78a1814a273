# SPDX-License-Identifier: GPL-3.0-or-later
"""A peak at the very value of a plateau one voxel thin: rays meet it on one face between cells, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping
from spectral_core.volume.march.march_input import REFERENCE
from spectral_core.volume.plan import plan
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View

pytest.importorskip("drjit")
BACKGROUND, PLATEAU, HEIGHT = 8000, 40000, 3.0


def plateau() -> tuple[VolumeRenderer, TransferFunction]:
    """A field of 16-bit numbers, and a peak of one unit to either side of the plateau's value."""
    data = np.full((24, 24, 24), BACKGROUND, np.uint16)
    data[:, 12, :] = PLATEAU
    peak = Material("peak", [PLATEAU - 1, PLATEAU, PLATEAU + 1], [0, HEIGHT, 0], [0.9, 0.5, 0.2])
    return VolumeRenderer(ScalarVolume("plateau", data)), TransferFunction((peak,))


def center_rays(renderer: VolumeRenderer) -> tuple[View, tuple[slice, slice], float]:
    """A view, its pixels whose rays cross the plateau inside the field, and their optical depth: of half a peak, from
    the field's slope, on either side.
    """
    view = View.around(renderer.volume, 30.0, 25.0, width=64, height=64, fov_deg=None)
    across = abs(float(view.world_from_camera[1, 2]))
    slope = (PLATEAU - BACKGROUND) * across
    return view, (slice(28, 36), slice(28, 36)), 2 * (HEIGHT / 2) / slope


@pytest.mark.parametrize("scale", [1.0, 1.0 / 16.0, 1.0 / 64.0])
def test_reference_sees_a_peak_on_a_face_in_full(scale: float) -> None:
    renderer, transfer = plateau()
    view, inside, depth = center_rays(renderer)
    image = renderer.render(view, transfer, Stepping("uniform", "preintegrated", scale), limits=REFERENCE)
    np.testing.assert_allclose(image.amounts[inside], -np.expm1(-depth), rtol=2e-3)


def test_steps_that_end_at_faces_see_it_too() -> None:
    renderer, transfer = plateau()
    view, inside, depth = center_rays(renderer)
    image = renderer.render(view, transfer, Stepping("cells", "preintegrated", 1.0))
    np.testing.assert_allclose(image.amounts[inside], -np.expm1(-depth), rtol=2e-3)


def test_plan_states_what_the_picture_has() -> None:
    """5 dB were stated where the picture had 30 dB, and could have 58."""
    renderer, transfer = plateau()
    view, _, _ = center_rays(renderer)
    made = plan(renderer, view, transfer, 50.0)
    assert made.is_reached
    best = renderer.render(view, transfer, Stepping("uniform", "preintegrated", 1 / 64), limits=REFERENCE).amounts
    error = renderer.render(view, transfer, made.stepping).amounts - best
    measured = 10 * np.log10(float(np.sum(best**2)) / max(float(np.sum(error**2)), 1e-300))
    assert measured > made.estimate_db - 3
