# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors as smooth reflectances: equal to those of the renderer, and within 0 to 1 for every color."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.spectra import catalogue, upsample
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb, linear_rgb_from_xyz
from spectral_core.spectra.observer import normalized, xyz_of
from spectral_core.spectra.spectrum import SpectralGrid

NM = np.arange(360.0, 831.0)


def colors(rng: np.random.Generator) -> np.ndarray:
    corners = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype=float)
    ties = [[0.5, 0.5, 0.2], [0.5, 0.2, 0.5], [0.2, 0.5, 0.5], [1e-6, 0, 0], [1e-4, 1e-4, 1e-4], [1, 0.999, 1]]
    return np.concatenate([rng.uniform(0, 1, (300, 3)), rng.uniform(0, 1, (100, 3)) ** 6, corners, ties])


def test_spectra_equal_those_of_the_renderer(rng: np.random.Generator) -> None:
    mitsuba = pytest.importorskip("mitsuba")
    if mitsuba.variant() is None:
        mitsuba.set_variant("scalar_rgb")
    rgb = colors(rng)
    for row, ours in zip(rgb, upsample.upsampled(rgb, NM), strict=True):
        theirs = [float(np.ravel(v)[0]) for v in mitsuba.srgb_model_fetch(mitsuba.ScalarColor3f(row))]
        if np.isfinite(theirs).all():
            value = np.polyval(theirs, NM)
            np.testing.assert_allclose(ours, 0.5 + value / (2 * np.hypot(1, value)), atol=2e-4)
        else:
            np.testing.assert_array_equal(ours, float(theirs[2] > 0))


@pytest.mark.parametrize("with_table", [True, False])
def test_spectra_have_their_color_under_daylight(with_table: bool, rng, monkeypatch) -> None:
    if not with_table:
        monkeypatch.setattr(upsample, "_table", lambda: None)
    grid = SpectralGrid(NM)
    daylight = normalized(catalogue.illuminant("D65"))
    rgb = colors(rng)[::4]
    shown = np.stack([linear_rgb_from_xyz(xyz_of(daylight, upsample.reflectance_from_rgb(row, grid))) for row in rgb])
    assert np.abs(shown - rgb).max() < 4e-3
    assert np.median(delta_e_2000(lab_from_linear_rgb(shown), lab_from_linear_rgb(rgb))) < 0.1


def test_grays_are_flat_and_black_and_white_exact() -> None:
    assert np.ptp(upsample.upsampled([0.3, 0.3, 0.3], NM)) == 0
    assert upsample.upsampled([[0, 0, 0], [1, 1, 1]], NM).tolist() == [[0.0] * NM.size, [1.0] * NM.size]
    np.testing.assert_allclose(upsample.upsampled([0.18, 0.18, 0.18], [555.0]), 0.18, rtol=1e-12)


def test_colors_outside_the_range_are_refused() -> None:
    for bad in ([1.1, 0, 0], [-0.01, 0, 0], [np.nan, 0, 0], [0.5, 0.5]):
        with pytest.raises(InvalidInputError, match="within 0 to 1"):
            upsample.upsampled(bad, NM)


@pytest.mark.parametrize("bad", [[0.1, 0.2], 0.5, "red", [0.1, None, 0.2], [1j, 0, 0]])
def test_what_is_no_color_of_a_light_is_refused(bad) -> None:
    """The errors were those of NumPy, and some of these had an answer."""
    white = catalogue.illuminant("D65")
    for call in (upsample.is_outside, lambda color: upsample.light_tint(color, white, NM),
                 lambda color: upsample.distance_from_light(color, white)):  # fmt: skip
        with pytest.raises(InvalidInputError, match="color"):
            call(bad)
    with pytest.raises(InvalidInputError, match="not finite"):
        upsample.light_tint([np.nan, 0.1, 0.1], white, NM)
    with pytest.raises(InvalidInputError, match="the white is 'D65', of type str; expected a Spectrum"):
        upsample.light_tint([1.0, 0.2, 0.1], "D65", NM)
    with pytest.raises(InvalidInputError, match="wavelengths must be real numbers"):
        upsample.light_tint([1.0, 0.2, 0.1], white, ["500 nm"])


def test_each_color_is_compared_with_its_own_largest_channel() -> None:
    """A saturated color beside a bright one was called a color of sRGB."""
    saturated, bright = [0.5, -0.2, 0.1], [1000.0, 900.0, 800.0]
    assert upsample.is_outside(saturated) and not upsample.is_outside(bright)
    assert upsample.is_outside([[bright, bright], [bright, saturated]])
    assert not upsample.is_outside(np.zeros((0, 3))) and not upsample.is_outside([1.0, -1e-5, 0.0])


def test_no_renderer_is_imported() -> None:
    code = (
        "import sys; from spectral_core.spectra.upsample import upsampled; upsampled([0.2, 0.4, 0.1], [500.0]);"
        "sys.exit(any(name in sys.modules for name in ('mitsuba', 'drjit')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
