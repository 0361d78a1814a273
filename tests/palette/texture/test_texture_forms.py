# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of texture design against formulas and other implementations: splines, bands, looked-up texels, statistics."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.optimize import linprog

from spectral_core.errors import InvalidInputError
from spectral_core.palette.texture import basis, loss, nearest, pinned, spline
from spectral_core.palette.texture.reach import (
    TEXTURE_GRID,
    corner_colors,
    reachable_contrast,
    reachable_scales,
    stimulus_matrix,
)
from spectral_core.palette.texture.texture import Picture
from spectral_core.palette.texture.uplift import design_uplift
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.color import RGB_FROM_XYZ, WHITE_XYZ, delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.observer import observer
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

D65, HP1 = illuminant("D65"), illuminant("HP1")


def test_the_lattice_is_the_quadratic_b_spline_of_scipy() -> None:
    """Thirteen nodes with clamped ends; the greatest value belongs to the last span."""
    count, spans = spline.NODES, spline.NODES - 2
    knots = np.concatenate([[0, 0, 0], np.arange(1, spans), [spans] * 3]) / spans
    places = np.concatenate([np.linspace(0, 1, 57), np.arange(spans + 1) / spans])
    expected = BSpline.design_matrix(np.clip(places, 0, 1 - 1e-15), knots, 2).toarray()
    first, shares = spline._along(places)
    found = np.zeros((len(places), count))
    for k in range(3):
        found[np.arange(len(places)), first + k] += shares[k]
    np.testing.assert_allclose(found, expected, atol=1e-12)
    # the nodes reproduce the identity
    np.testing.assert_allclose(found @ spline.axis(), places, atol=1e-12)


def test_a_color_has_the_products_of_its_shares(rng: np.random.Generator) -> None:
    colors = rng.uniform(0, 1, (50, 3))
    corners, shares = spline.cell(colors)
    assert corners.shape == shares.shape == (50, 27)
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, atol=1e-12)
    axis = spline.axis()
    red, green, blue = np.meshgrid(axis, axis, axis, indexing="ij")
    for values, channel in ((red, 0), (green, 1), (blue, 2)):
        np.testing.assert_allclose((values.ravel()[corners] * shares).sum(axis=1), colors[:, channel], atol=1e-12)


def test_peaks_divide_the_stimulus_into_equal_parts() -> None:
    flat = np.ones((3, 101))
    np.testing.assert_allclose(pinned._peaks(flat, 4), [12.5 * (2 * k + 1) * 1.01 - 1 for k in range(4)], atol=1e-9)
    ramp = np.tile(np.arange(101.0), (3, 1))
    found = pinned._peaks(ramp, 5)
    total = ramp.sum()
    for k, place in enumerate(found):
        below = 3 * np.interp(place, np.arange(101), np.cumsum(np.arange(101.0)))
        assert below / total == pytest.approx((k + 0.5) / 5, abs=1e-9)
    np.testing.assert_allclose(basis._bands_of_equal_light(ramp, 5), pinned._hats(found, 101), atol=1e-12)


def test_moved_peaks_keep_their_order_their_gap_and_the_range(rng: np.random.Generator) -> None:
    peaks = np.array([5.0, 12.0, 30.0, 33.0, 60.0])
    seen, changed = [], []
    for _ in range(600):
        moved = pinned._moved(peaks, rng, 81)
        assert np.all(np.diff(moved) >= pinned.LEAST_GAP) and moved[0] >= 1.0 and moved[-1] <= 79.0
        left = np.setdiff1d(peaks, moved)
        changed.append(len(left))
        seen += list(np.setdiff1d(moved, peaks))
    assert set(changed) == {0, 1, 2}  # none where the gap would be too small
    assert min(seen) == 1.0 or min(seen) < 3.0
    assert max(seen) > 70.0


def test_hats_sum_to_one_and_end_at_their_neighbors() -> None:
    peaks = np.array([4.0, 10.0, 11.5, 30.0])
    for hats in (pinned._hats(peaks, 40), basis._hats(peaks, 40)):
        np.testing.assert_allclose(hats.sum(axis=0), 1.0)
        knots = np.arange(40.0)
        np.testing.assert_allclose(hats[1], np.clip(np.minimum((knots - 4) / 6, (11.5 - knots) / 1.5), 0, 1))
        assert np.all(hats[0, :5] == 1) and np.all(hats[3, 30:] == 1)


def test_bands_at_peaks_have_the_strongest_lines_and_fill_the_widest_gaps() -> None:
    power = np.full(101, 0.01)
    for place, height in ((20, 3.0), (50, 5.0), (80, 4.0), (95, 1.0)):
        power[place] = height
    stimuli = np.tile(power, (3, 1))
    assert np.argmax(basis._bands_at_peaks(stimuli, 3), axis=1).tolist()[1] == 50
    np.testing.assert_array_equal(basis._bands_at_peaks(stimuli, 3), basis._hats(np.array([20.0, 50, 80]), 101))
    # gaps 0-20, 20-50, 50-80, 80-100: the first of the widest is halved
    np.testing.assert_array_equal(basis._bands_at_peaks(stimuli, 4), basis._hats(np.array([20.0, 35, 50, 80]), 101))
    smooth = basis._smoothed(basis._bands_at_peaks(stimuli, 3), 0.25)
    assert np.abs(np.diff(smooth, 2, axis=1)).max() <= 0.25
    np.testing.assert_allclose(smooth.sum(axis=0), 1.0)
    rough = np.eye(3)[:, [0, 0, 1, 2, 2]]
    once = basis._smoothed(rough, 1.0)
    np.testing.assert_allclose(once[1], [0, 0.25, 0.5, 0.25, 0])


def test_the_basis_of_one_light_and_its_limits() -> None:
    matrix = stimulus_matrix([D65])
    found = basis.design_basis(matrix, 3, floor=0.05, iterations=3)
    np.testing.assert_allclose(found.spectra.sum(axis=0), 1.0, atol=1e-9)
    assert found.spectra.min() >= 0 and np.abs(np.diff(found.spectra, 2, axis=1)).max() <= 0.25 + 1e-6
    own = reachable_scales(matrix @ found.spectra.T, corner_colors(1), 0.05).scales.min()
    assert found.slope == pytest.approx(own, abs=1e-9) and 0 < found.iterations <= 6
    for count in (2, 9):
        with pytest.raises(InvalidInputError, match="expected 3 to 8"):
            basis.design_basis(matrix, count)
    for smoothness in (0.01, 2.1):
        with pytest.raises(InvalidInputError, match="smoothness"):
            basis.design_basis(matrix, 3, smoothness=smoothness)


def test_a_perfect_reflector_is_white_under_every_light() -> None:
    matrix = stimulus_matrix([D65, HP1])
    assert matrix.shape == (6, TEXTURE_GRID.size)
    np.testing.assert_allclose(matrix.sum(axis=1), 1.0, atol=1e-12)
    np.testing.assert_array_equal(TEXTURE_GRID.wavelengths_nm, np.arange(380.0, 781.0, 5.0))
    leaf, fine = reflectance("foliage"), np.linspace(380, 780, 8001)
    eye = observer("cie_1931_2deg")
    table = np.array([np.interp(fine, eye.wavelengths_nm, row) for row in eye.cmfs]) * HP1.at(fine)
    knots = leaf.at(TEXTURE_GRID.wavelengths_nm)
    shown = (table * np.interp(fine, TEXTURE_GRID.wavelengths_nm, knots)).sum(axis=1) / table.sum(axis=1) * WHITE_XYZ
    np.testing.assert_allclose(matrix[3:] @ knots, RGB_FROM_XYZ @ shown, atol=2e-4)
    with pytest.raises(InvalidInputError, match="all three must be above"):
        stimulus_matrix([Illuminant("red", SpectralGrid([690.0, 700.0]), [1.0, 1.0])])
    with pytest.raises(InvalidInputError, match="at least one light"):
        stimulus_matrix([])


def test_scales_are_those_of_single_programs(rng: np.random.Generator) -> None:
    matrix = stimulus_matrix([D65])
    colors = corner_colors(1)
    assert colors.shape == (7, 3) and corner_colors(2).shape == (63, 6)
    floor = 0.1
    found = reachable_scales(matrix, colors, floor)
    for color, scale, spectrum, multiplier in zip(
        colors, found.scales, found.reflectances, found.multipliers, strict=True
    ):
        equations = np.column_stack([matrix, -color])
        answer = linprog(
            np.append(np.zeros(matrix.shape[1]), -1.0), A_eq=equations, b_eq=floor * matrix.sum(axis=1),
            bounds=[(0, 1)] * matrix.shape[1] + [(0, 0.9)],
        )  # fmt: skip
        assert scale == pytest.approx(-answer.fun, abs=1e-8)
        np.testing.assert_allclose(matrix @ spectrum, floor + scale * color, atol=1e-8)
        if scale < 0.9 - 1e-9:  # the multiplier is the derivative by the color's coordinates, at fixed scale
            nudged = floor * matrix.sum(axis=1) + 1e-6 * multiplier
            again = linprog(
                np.append(np.zeros(matrix.shape[1]), -1.0), A_eq=equations, b_eq=nudged,
                bounds=[(0, 1)] * matrix.shape[1] + [(0, 0.9)],
            )  # fmt: skip
            assert again.fun - answer.fun == pytest.approx(1e-6 * multiplier @ multiplier, rel=0.05, abs=1e-10)
    contrast = reachable_contrast([D65], floor)
    assert contrast.slope == found.scales.min()
    assert contrast.contrast == pytest.approx((0.1 + contrast.slope) / 0.1)
    assert reachable_contrast([D65], 0.0).contrast == np.inf
    np.testing.assert_array_equal(contrast.limiting_colors, colors[[found.scales.argmin()]])
    for lights in ([], [D65] * 4):
        with pytest.raises(InvalidInputError, match="1 to 3 lights"):
            reachable_contrast(lights)


@pytest.fixture(scope="module")
def plain():
    return design_uplift(D65, HP1)


@pytest.mark.parametrize(("band", "chunk"), [(1 << 20, 1 << 18), (7, 2), (1, 1)])
def test_looked_up_texels_are_those_of_their_colors(plain, monkeypatch, band: int, chunk: int) -> None:
    monkeypatch.setattr(pinned, "BAND_TEXELS", band)
    monkeypatch.setattr(pinned, "CHUNK", chunk)
    rng = np.random.default_rng(2)
    pixels = rng.integers(0, 256, (5, 3, 3)).astype(np.uint8)
    pixels[3] = pixels[1]  # equal colors
    picture = Picture("p", pixels)
    shares = []
    weights, errors = pinned._looked_up(picture, plain, 1.0, shares.append)
    linear = np.moveaxis(picture.linear_rows(0, 5).reshape(3, 5, 3), 0, -1)
    expected = np.abs(plain.weights(linear.reshape(-1, 3).astype(np.float32))).T.reshape(-1, 5, 3)
    np.testing.assert_allclose(weights.astype(float), expected, atol=1e-3)
    matrix = stimulus_matrix([D65]) @ plain.basis.T
    shown = np.einsum("ck,khw->hwc", matrix, weights.astype(np.float64))
    assert np.abs(shown - linear).max() < 5e-3
    assert errors.shape == (1, 5, 3) and float(errors.max()) < 0.5
    rows = max(1, band // 3)
    assert shares == pytest.approx([min(5, first + rows) / 5 for first in range(0, 5, rows)])


def test_the_cube_root_of_cielab_and_its_slope() -> None:
    ratio = np.array([0.0, 1e-4, 0.008, 0.009, 0.2, 1.0], np.float32)
    f, slope = nearest._f(ratio)
    exact = np.where(ratio > 216 / 24389, np.cbrt(ratio), (24389 / 27 * ratio + 16) / 116)
    np.testing.assert_allclose(f, exact, rtol=3e-6)
    h = 1e-6
    wide = ratio.astype(np.float64)
    ahead, behind = (np.where(v > 216 / 24389, np.cbrt(v), (24389 / 27 * v + 16) / 116) for v in (wide + h, wide - h))
    np.testing.assert_allclose(slope, (ahead - behind) / (2 * h), rtol=1e-4)


@pytest.mark.parametrize("zeros", [0, 5, 95, 99, 100])
def test_statistics_of_errors_are_those_of_numpy(zeros: int, rng: np.random.Generator) -> None:
    errors = rng.uniform(0.1, 5, 100).astype(np.float16)
    errors[:zeros] = 0
    errors = rng.permutation(errors).reshape(10, 10)
    wide = errors.astype(np.float64)
    expected = wide.mean(), np.percentile(wide, 95), np.percentile(wide, 99), wide.max()
    np.testing.assert_allclose(loss._statistics(errors), expected, rtol=1e-6, atol=1e-9)


def test_errors_of_texels_and_details_of_pictures(rng: np.random.Generator) -> None:
    weights = rng.uniform(0, 1, (3, 40)).astype(np.float32)
    matrix = np.eye(3)
    wanted = weights.copy()
    wanted[:, ::2] += 0.1
    wanted[:, 1] += 0.9e-3  # within what counts as exact
    found = loss.texel_delta_e(wanted, weights, matrix)
    expected = delta_e_2000(lab_from_linear_rgb(wanted.T), lab_from_linear_rgb(weights.T))
    assert not found[0, 1::2].any()
    np.testing.assert_allclose(found[0, ::2], expected[::2], rtol=1e-5)
    both = loss.texel_delta_e(np.concatenate([weights, wanted]), weights, np.concatenate([matrix, matrix]))
    np.testing.assert_allclose(both, np.stack([np.zeros(40), found[0]]), rtol=1e-6)

    flat = np.full((20, 30, 3), 0.3)
    np.testing.assert_allclose(loss._details(flat), 0.0, atol=1e-9)
    one, other = rng.normal(size=(2, 8, 9))
    np.testing.assert_allclose(loss._regression(0.75 * one - 0.25 * other, [one, other]), [0.75, -0.25], atol=1e-12)
    np.testing.assert_array_equal(loss._regression(one, [np.zeros((8, 9)), other]), [1.0, 0.0])
    # the details of one color are what rounding leaves of it
    flat = loss._details(np.full((8, 9, 3), 0.57758045, dtype=np.float32))
    np.testing.assert_array_equal(loss._regression(-0.5 * flat, [flat, other]), [1.0, 0.0])
    np.testing.assert_array_equal(loss._regression(-0.5 * flat, [flat + 1e-6, other]), [1.0, 0.0])
    assert loss._even(4).tolist() == [0, 1, 2, 3] and len(loss._even(5000)) == 512
    assert (loss._even(5000)[0], loss._even(5000)[-1]) == (0, 4999)
