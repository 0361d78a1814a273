# SPDX-License-Identifier: GPL-3.0-or-later
"""Chapter 5 of the thesis: its printed figures, and the effect of rounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.palette.cases import thesis_data as thesis
from benchmarks.palette.palette_thesis import mean_delta_e_1976
from spectral_core.palette import solve_palette
from spectral_core.palette.assemble.kernel import color_kernel
from spectral_core.palette.design import rounds
from spectral_core.spectra.observer import xyz_from_spectrum
from spectral_core.spectra.spectrum import SpectralGrid


def test_the_printed_spectra_have_the_printed_colors():
    rows = [thesis.reflectance(f"refl{i + 1}") for i in range(5)]
    columns = [thesis.light(name) for name in ("d65", "split1", "split2")]
    kernel = color_kernel(thesis.GRID)
    shown = 255 * np.array([[kernel.color_of(light, row)[0] for light in columns] for row in rows])
    assert np.abs(shown - thesis.PRINTED_COLORS_255).max() < 1
    y = xyz_from_spectrum(thesis.GRID)[1] @ thesis.light("d65").values
    assert y == pytest.approx(6.0, abs=1e-3)


def test_phase_two_returns_the_printed_lights():
    solution = solve_palette(thesis.lights_only())
    for k in (1, 2):
        found = solution.illuminants[k].values / thesis.PER_NM
        assert np.sqrt(np.mean((found - thesis.PRINTED[f"split{k}"]) ** 2)) < 5e-4


def test_rounds_make_figure_5_2_exact():
    one_round = solve_palette(thesis.from_scratch(1, 1.0), explain=False)
    assert 2.4 < one_round.max_delta_e_2000 < 3.0
    rounds = replace(thesis.from_scratch(1, 1.0), smoothness=0.01, smoothness_operator="mended", rounds=20)
    assert solve_palette(rounds).max_delta_e_2000 < 0.01


@pytest.mark.parametrize(
    ("size", "bounded", "low", "high"), [(7, True, 4.5, 9.9), (9, True, 10, 16), (10, False, 0, 0.01)]
)
def test_errors_grow_with_size_as_in_figure_5_3(size, bounded, low, high):
    errors = []
    for seed in range(4):
        problem = thesis.random_palette((size, size), np.random.default_rng(seed), bounded=bounded)
        errors.append(mean_delta_e_1976(solve_palette(problem, explain=False)))
    assert low <= np.mean(errors) < high


def test_nine_by_nine_random_colors_are_met_after_the_default_rounds(monkeypatch):
    monkeypatch.setattr(rounds, "PATIENCE", 1e9)
    problem = thesis.random_palette((9, 9), np.random.default_rng(5))
    problem = replace(problem, rounds=20, smoothness=0.01, smoothness_operator="mended")
    assert mean_delta_e_1976(solve_palette(problem, explain=False)) < 2


def test_nine_by_nine_random_colors_are_met_on_the_grid_of_the_renderer(monkeypatch):
    """Spectra are linear between knots, which is harder than the sampled grid of the thesis.

    In 2 s of processor time, however long these take while other programs are at work.
    """
    monkeypatch.setattr(rounds, "PATIENCE", 1e9)
    grid = SpectralGrid.uniform(400.0, 700.0, 10.0)
    assert grid.interpolation == "linear"
    problem = thesis.random_palette((9, 9), np.random.default_rng(5), grid)
    problem = replace(problem, rounds=1000, smoothness=0.01, smoothness_operator="mended")
    assert mean_delta_e_1976(solve_palette(problem, explain=False, seconds=2)) < 2
