# SPDX-License-Identifier: GPL-3.0-or-later
"""More spectra than colors, as for given lights: every texel is as near in CIELAB as a search of its own finds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from spectral_core.palette.texture.basis import design_basis
from spectral_core.palette.texture.fit import Fitter
from spectral_core.palette.texture.reach import stimulus_matrix
from spectral_core.palette.texture.texture import Picture, design_texture
from spectral_core.spectra.catalogue import illuminant

XYZ_FROM_SRGB = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE = XYZ_FROM_SRGB.sum(axis=1)
F = np.array([[0, 116, 0], [500, -500, 0], [0, 200, -200]])


def distance(weights: np.ndarray, matrix: np.ndarray, wanted: np.ndarray) -> tuple[float, np.ndarray]:
    """Sum of squared CIELAB distances under both lights, and its gradient."""
    total, slope = 0.0, np.zeros(len(weights))
    for rows in (slice(0, 3), slice(3, 6)):
        ratio = XYZ_FROM_SRGB @ matrix[rows] / WHITE[:, None]
        shown, target = ratio @ weights, XYZ_FROM_SRGB @ wanted[rows] / WHITE
        roots = [np.where(t > 216 / 24389, np.cbrt(t), (24389 / 27 * t + 16) / 116) for t in (shown, target)]
        missed = F @ (roots[0] - roots[1])
        change = np.where(shown > 216 / 24389, np.cbrt(np.maximum(shown, 1e-9)) ** -2 / 3, 24389 / 27 / 116)
        total += missed @ missed
        slope += 2 * ratio.T @ (change * (F.T @ missed))
    return total, slope


@pytest.mark.parametrize(("lamp", "spectra"), [("HP1", 8), ("FL11", 7), ("LED-B5", 8), ("D65", 8)])
def test_texels_are_nearest_with_more_spectra_than_colors(lamp: str, spectra: int) -> None:
    matrix = stimulus_matrix([illuminant("D65"), illuminant(lamp)])
    matrix = matrix @ design_basis(matrix, spectra, floor=0.1, iterations=4).spectra.T
    wanted = (0.02 + 0.95 * np.random.default_rng(8).random((300, 6)) ** 2.2).astype(np.float32)
    weights, outside = Fitter(matrix, (1.0, 1.0)).solve(np.ascontiguousarray(wanted.T))
    assert outside > 250
    for color, found in zip(wanted[:120].astype(float), weights.T.astype(float), strict=False):
        bounds = [(0, 1)] * spectra
        best = minimize(distance, found, (matrix, color), jac=True, bounds=bounds, options={"maxiter": 3000}).fun
        assert np.sqrt(distance(found, matrix, color)[0]) - np.sqrt(best) < 0.2


def test_two_pictures_under_one_lamp_report_their_errors_with_eight_spectra() -> None:
    """Each texel has an answer inside the box whose colors are neither of the two wanted ones."""
    rng = np.random.default_rng(1)
    pictures = [Picture(name, rng.integers(60, 180, (8, 9, 3), dtype=np.uint8)) for name in "ab"]
    lamp = illuminant("D65")
    design = design_texture(pictures, [lamp, lamp], floor=0.1, slope=0.8, count=8)
    assert design.compressed == 1
    assert min(loss.mean for loss in design.losses) > 5


@pytest.mark.parametrize(("slope", "floor"), [(0.0, 0.1), (1e-12, 0.5)])
@pytest.mark.parametrize("count", [6, 8])
def test_pictures_without_contrast_are_gray(slope: float, floor: float, count: int) -> None:
    rng = np.random.default_rng(2)
    pictures = [Picture(name, rng.integers(0, 256, (3, 5, 3), dtype=np.uint8)) for name in "ab"]
    lights = [illuminant("D65"), illuminant("HP1")]
    basis = design_basis(stimulus_matrix(lights), count, floor=floor, iterations=2)
    design = design_texture(pictures, lights, floor=floor, slope=slope, basis=basis)
    for light in lights:
        np.testing.assert_allclose(design.texture.picture(light), floor, atol=1e-3)


@pytest.mark.parametrize("slope", [0.4, 0.87])
def test_texels_with_an_exact_answer_do_not_count_as_compressed(slope: float) -> None:
    """By a linear program for each texel: 29 and 49 % were said to have none, of which 20 and 39 % have none."""
    rng = np.random.default_rng(6)
    one = rng.integers(30, 200, (9, 10, 3))
    pixels = [one, one + rng.integers(-15, 16, (9, 10, 1))]
    lights = [illuminant("D65"), illuminant("HP1")]
    matrix = stimulus_matrix(lights)
    basis = design_basis(matrix, 8, floor=0.1, iterations=4)
    pictures = [Picture(name, each.astype(np.uint8)) for name, each in zip("ab", pixels, strict=True)]
    design = design_texture(pictures, lights, floor=0.1, slope=slope, basis=basis)
    assert design.stated_slope < slope
    rows = np.hstack([matrix @ basis.spectra.T, -np.ones((6, 1))])
    both, largest = np.concatenate([rows, rows * [[-1.0] * 8 + [1.0]]]), []
    for texel in np.concatenate(pixels, axis=2).reshape(-1, 6) / 255:
        wanted = 0.1 + slope * np.where(texel > 0.04045, ((texel + 0.055) / 1.055) ** 2.4, texel / 12.92)
        bounds = [(0, 1)] * 8 + [(0, None)]
        largest.append(linprog([0.0] * 8 + [1.0], both, np.concatenate([wanted, -wanted]), bounds=bounds).fun)
    assert design.compressed == pytest.approx(np.mean(np.array(largest) > 1e-3), abs=0.03)
    assert design.compressed == np.mean(np.max([loss.delta_e for loss in design.losses], axis=0) > 0)
