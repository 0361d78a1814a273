# SPDX-License-Identifier: GPL-3.0-or-later
"""An exact recording under a light with lines between its knots, and lamps of negative power."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from examples.sweeps.scenes import corner
from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.explore.sweep.compute.rendering import Relighter, top_down
from spectral_core.render import render_scene
from spectral_core.render.relight.exact_storage import EXACT_GRID, ExactStorage
from spectral_core.render.relight.mix import LiveMix
from spectral_core.render.relight.storage import MixtureStorage
from spectral_core.render.relight.transport import Transport
from spectral_core.spectra.observer import STANDARD, observer
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

FINE_NM = np.arange(360.0, 830.0001, 0.01)


def white_xyz(light: Illuminant) -> np.ndarray:
    """XYZ of a light on a white surface, by the rule of trapezoids in steps of 0.01 nm."""
    viewer = observer(STANDARD)
    values = np.interp(FINE_NM, light.grid.wavelengths_nm, light.values, left=0.0, right=0.0)
    cmfs = np.stack([np.interp(FINE_NM, viewer.wavelengths_nm, each) for each in viewer.cmfs])
    products = cmfs * values
    return 0.01 * (products.sum(axis=1) - (products[:, 0] + products[:, -1]) / 2)


def recorded_xyz(storage: ExactStorage, light: Illuminant) -> np.ndarray:
    """XYZ of the recording of a white surface, relit by the light."""
    knots = np.stack([np.interp(FINE_NM, storage.knots.wavelengths_nm, row, left=0.0, right=0.0)
                      for row in np.eye(storage.knots.size)])  # fmt: skip
    viewer = observer(STANDARD)
    cmfs = np.stack([np.interp(FINE_NM, viewer.wavelengths_nm, each) for each in viewer.cmfs])
    channels = (knots @ cmfs.T) * 0.01
    from spectral_core.spectra.color import RGB_FROM_XYZ

    rgb = storage.rgb_from_channels(light) @ channels.reshape(-1)
    return np.linalg.solve(RGB_FROM_XYZ, rgb)


@pytest.mark.parametrize("line_nm", [404.7, 435.8, 487.3, 546.07, 555.0, 589.3, 632.8, 694.3])
def test_a_line_between_two_knots_keeps_its_color_on_gray(line_nm: float) -> None:
    """It was up to 6 % too bright or too dark."""
    light = Illuminant("line", SpectralGrid(np.array([line_nm - 0.5, line_nm, line_nm + 0.5])), np.array([0, 1.0, 0]))
    wanted = white_xyz(light)
    np.testing.assert_allclose(recorded_xyz(ExactStorage(EXACT_GRID), light), wanted, rtol=1e-3, atol=1e-3 * wanted[1])


def test_lines_over_a_continuum_keep_their_color_on_gray() -> None:
    nm = np.array([380.0, 435.0, 435.8, 436.6, 500.0, 545.3, 546.1, 546.9, 610.0, 611.5, 613.0, 780.0])
    light = Illuminant(
        "tube", SpectralGrid(nm), np.array([0.1, 0.2, 9.0, 0.2, 0.3, 0.3, 12.0, 0.3, 0.5, 8.0, 0.5, 0.2])
    )
    np.testing.assert_allclose(recorded_xyz(ExactStorage(EXACT_GRID), light), white_xyz(light), rtol=5e-4)


def test_a_lamp_of_negative_power_is_re_lit() -> None:
    """Cycles lets it remove light; a sweep of its power failed: a light cannot absorb light."""
    scene = corner(size=24, samples=256)
    key = next(light for light in scene.lights if light.name == "Key")
    relighter = Relighter()
    for power in (-150.0, 90.0, 0.0):
        lights = tuple(replace(light, power_w=power) if light is key else light for light in scene.lights)
        lit = replace(scene, lights=lights)
        found = relighter.picture(lit).pictures[""][..., :3]
        wanted = top_down(render_scene(lit).pixels)[..., :3]
        assert found.mean() == pytest.approx(wanted.mean(), rel=0.02)
        assert (found.min() < -0.01) == (wanted.min() < -0.01) == (power < 0)


def transport(groups: tuple[str, ...]) -> Transport:
    count = len(groups)
    return Transport(
        MixtureStorage(), groups, np.ones((count, 3, 2, 2), np.float32), np.ones((2, 2), np.float32), (None,) * count,
        1.0, "x", 1, 0,
    )  # fmt: skip


def test_weights_below_0_are_an_error_unless_they_are_signed() -> None:
    mix = LiveMix(transport(("a", "b")))
    with pytest.raises(InvalidInputError, match="cannot absorb"):
        mix.picture([1.0, -0.25])
    assert mix.picture([1.0, -0.25], signed=True)[0, 0, 0] == pytest.approx(0.75)
    with pytest.raises(InvalidInputError, match="more than 1e"):
        mix.picture([1.0, -1e31], signed=True)


def test_a_group_without_a_name_is_named_as_such() -> None:
    """A blank stood in the list of groups."""
    with pytest.raises(UnknownNameError, match=r"known: '' \(without a name\), Key, Window"):
        transport(("", "Key", "Window")).index_of("Zz")
