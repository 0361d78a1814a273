# SPDX-License-Identifier: GPL-3.0-or-later
"""Texels that no reflectance can show: the search within the box, stored weights, reported errors."""

from __future__ import annotations

import time
from itertools import count

import numpy as np
import pytest
from scipy.optimize import least_squares

from spectral_core.palette.texture.basis import design_basis
from spectral_core.palette.texture.fit import Fitter
from spectral_core.palette.texture.lights import design_lights, led_range
from spectral_core.palette.texture.loss import _statistics
from spectral_core.palette.texture.reach import stimulus_matrix
from spectral_core.palette.texture.texture import Picture, design_texture, half_from_unit
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import lab_from_linear_rgb, linear_from_display_rgb


def colors(number: int, seed: int = 3) -> np.ndarray:
    """Pairs of display colors (number, 6), linear; a third of them corners of the display's cube."""
    rng = np.random.default_rng(seed)
    found = linear_from_display_rgb(rng.random((number, 6)))
    found[::3] = rng.integers(0, 2, found[::3].shape)
    return found


def missed(matrix: np.ndarray, weights: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """CIELAB differences (..., 6) under both lights."""
    shown = lab_from_linear_rgb((weights @ matrix.T).reshape(*wanted.shape[:-1], 2, 3))
    return (shown - lab_from_linear_rgb(wanted.reshape(*wanted.shape[:-1], 2, 3))).reshape(wanted.shape)


def missed_by(weights: np.ndarray, matrix: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    return missed(matrix, weights, wanted)


def slopes(weights: np.ndarray, matrix: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Central differences of ``missed_by``, all at once."""
    steps = 1e-6 * np.eye(weights.size)
    many = np.broadcast_to(wanted, (weights.size, 6))
    return (missed(matrix, weights + steps, many) - missed(matrix, weights - steps, many)).T / 2e-6


@pytest.mark.parametrize(("lamp", "spectra", "excess"), [("HP1", 6, 0.05), ("HP1", 8, 0.15), ("FL11", 6, 0.05)])
def test_colors_far_outside_are_as_near_as_those_of_a_bounded_search(lamp: str, spectra: int, excess: float) -> None:
    matrix = stimulus_matrix([illuminant("D65"), illuminant(lamp)])
    matrix = matrix @ design_basis(matrix, spectra, floor=0.1, iterations=4).spectra.T
    wanted = colors(120)
    weights, outside = Fitter(matrix, (1.0, 1.0)).solve(np.ascontiguousarray(wanted.T, dtype=np.float32))
    assert outside > 100
    assert weights.min() >= 0
    assert weights.max() <= 1
    found = weights.T.astype(np.float64)
    worse = []
    for color, each in zip(wanted[:25], found, strict=False):
        best = min(
            least_squares(missed_by, start, slopes, (-1e-9, 1 + 1e-9), "dogbox", args=(matrix, color)).cost
            for start in (np.full(spectra, 0.5), np.clip(each, 0.01, 0.99))
        )
        worse.append(np.linalg.norm(missed(matrix, each, color)) - np.sqrt(2 * best))
    assert np.mean(worse) < excess


def test_importance_reduces_the_error_of_a_picture() -> None:
    matrix = stimulus_matrix([illuminant("D65"), illuminant("FL11")])
    matrix = matrix @ design_basis(matrix, 6, floor=0.1, iterations=4).spectra.T
    wanted = colors(200)
    errors = []
    for importance in ((1.0, 1.0), (25.0, 1.0)):
        weights = Fitter(matrix, importance).solve(np.ascontiguousarray(wanted.T, dtype=np.float32))[0]
        both = missed(matrix, weights.T.astype(np.float64), wanted).reshape(-1, 2, 3)
        errors.append(np.linalg.norm(both, axis=2).mean(axis=0))
    assert errors[1][0] < 0.5 * errors[0][0]
    assert errors[1][1] > errors[0][1]


def test_two_pictures_under_the_same_lamp_report_their_errors() -> None:
    rng = np.random.default_rng(1)
    pictures = [Picture(name, rng.integers(0, 256, (8, 9, 3), dtype=np.uint8)) for name in "ab"]
    lamp = illuminant("D65")
    design = design_texture(pictures, [lamp, lamp], floor=0.1, slope=0.8)
    assert design.compressed == 1
    assert min(loss.mean for loss in design.losses) > 5


def test_half_floats_equal_those_of_numpy() -> None:
    rng = np.random.default_rng(0)
    values = np.concatenate([rng.random(4000), 10.0 ** (-8 * rng.random(4000)), [0.0, -0.0, 1.0]]).astype(np.float32)
    stored = np.empty(values.shape, dtype=np.float16)
    half_from_unit(values, stored)
    expected = np.abs(values.astype(np.float16)).view(np.uint16).astype(int)
    # Numbers halfway between two half floats may go either way.
    assert np.abs(stored.view(np.uint16).astype(int) - expected).max() <= 1
    assert np.count_nonzero(stored.view(np.uint16) != expected) < 10
    assert stored.max() == 1


@pytest.mark.parametrize("share", [0.0, 0.005, 0.3, 1.0])
def test_statistics_are_those_of_all_texels(share: float) -> None:
    rng = np.random.default_rng(4)
    errors = (rng.random((40, 50)) * 9 * (rng.random((40, 50)) < share)).astype(np.float16)
    plain = errors.astype(np.float64)
    expected = (plain.mean(), *np.percentile(plain, [95, 99]), plain.max())
    np.testing.assert_allclose(_statistics(errors), expected, rtol=1e-5, atol=1e-9)


def test_designs_do_not_depend_on_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """The tolerance is that of last digits, which depend on where the arrays lie in memory."""
    leds = led_range(20, step_nm=15)
    plain = design_lights(leds, iterations=3)
    matrix = stimulus_matrix(plain.lights)
    basis = design_basis(matrix, 6, floor=0.02, iterations=2)
    hours = count()
    monkeypatch.setattr(time, "perf_counter", lambda: 3600.0 * next(hours))
    again = design_lights(leds, iterations=3)
    assert again.slope == pytest.approx(plain.slope, rel=1e-6)
    assert again.starts == pytest.approx(plain.starts, rel=1e-6)
    spectra = design_basis(matrix, 6, floor=0.02, iterations=2).spectra
    np.testing.assert_allclose(spectra, basis.spectra, atol=1e-6)
