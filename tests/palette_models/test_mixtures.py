# SPDX-License-Identifier: GPL-3.0-or-later
"""Mixtures: additive ones keep matches exactly, paints follow Kubelka and Munk, a design can include tints."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.palette import Cell, solve_palette
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.paint.mixtures import (
    absorption_from_reflectance,
    additive_mixture,
    halftone_shares,
    paint_mixture,
    paint_slope,
    reflectance_from_absorption,
    tint_differences,
)
from spectral_core.palette.paint.tints import TintCriterion, largest_tint_difference, solve_with_tints, with_tints
from spectral_core.palette.presets import hidden_mark, metamer_pair, most_distinct
from spectral_core.palette.solution import PaletteStatus
from spectral_core.spectra import catalogue, observer
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb

RNG = np.random.default_rng(4)


def test_additive_mixtures_stay_metameric() -> None:
    solution = solve_palette(most_distinct(3))
    surfaces = np.array([surface.values for surface in solution.reflectances])
    grid = solution.problem.grid
    daylight = observer.linear_rgb_from_product(solution.illuminants[0], grid)
    mixed = additive_mixture(RNG.dirichlet(np.ones(3), size=50), surfaces) @ daylight.T
    assert np.ptp(mixed, axis=0).max() < 1e-12
    halftones = additive_mixture(halftone_shares(RNG.uniform(size=(50, 2))), surfaces[[0, 1, 2, 0]]) @ daylight.T
    assert np.ptp(halftones, axis=0).max() < 1e-12


def test_colors_of_additive_mixtures_are_means() -> None:
    surfaces = RNG.uniform(size=(3, 31))
    shares = RNG.dirichlet(np.ones(3))
    matrix = RNG.normal(size=(3, 31))
    np.testing.assert_allclose(matrix @ additive_mixture(shares, surfaces), shares @ (surfaces @ matrix.T), atol=1e-12)


def test_halftone_shares_are_products() -> None:
    cyan, magenta, yellow = 0.2, 0.7, 0.4
    shares = halftone_shares([cyan, magenta, yellow])
    assert shares.sum() == pytest.approx(1.0)
    assert shares[0] == pytest.approx((1 - cyan) * (1 - magenta) * (1 - yellow))  # bare paper
    assert shares[0b101] == pytest.approx(cyan * (1 - magenta) * yellow)
    assert halftone_shares(np.full((5, 2), 0.5)).shape == (5, 4)


def test_kubelka_munk_solves_its_equation() -> None:
    ratio = np.geomspace(1e-12, 1e12, 49)
    surface = reflectance_from_absorption(ratio)
    np.testing.assert_allclose(surface**2 - 2 * (1 + ratio) * surface + 1, 0.0, atol=1e-9)
    middle = RNG.uniform(0.001, 1, size=100)
    np.testing.assert_allclose(reflectance_from_absorption(absorption_from_reflectance(middle)), middle, rtol=1e-10)


def test_a_thick_layer_agrees_with_the_two_flux_equations() -> None:
    """Oracle: upward and downward light in thin slices of absorption K and scattering S, until convergence."""
    absorption, scattering = 0.3, 2.0
    step, reflectance = 1e-4, 0.0
    for _ in range(60_000):
        # A slice on a layer of reflectance R: dR = S − 2 (K + S) R + S R² (Kubelka and Munk 1931).
        reflectance += step * (scattering - 2 * (absorption + scattering) * reflectance + scattering * reflectance**2)
    assert reflectance_from_absorption(absorption / scattering) == pytest.approx(reflectance, abs=1e-6)


def test_paint_mixtures_follow_kubelka_and_munk() -> None:
    surfaces = RNG.uniform(size=(3, 7))
    for k in range(3):
        np.testing.assert_allclose(paint_mixture(np.eye(3)[k], surfaces), surfaces[k], rtol=1e-9)
    half = paint_mixture([0.5, 0.5, 0.0], surfaces)
    assert np.all(
        half <= additive_mixture([0.5, 0.5, 0.0], surfaces) + 1e-12
    )  # a paint mixture is darker than an additive one
    with_black = np.stack([surfaces[0], np.zeros(7)])
    np.testing.assert_allclose(paint_mixture([1.0, 0.0], with_black), surfaces[0])
    np.testing.assert_array_equal(paint_mixture([0.9, 0.1], with_black), np.zeros(7))
    stronger = paint_mixture([0.5, 0.5], surfaces[:2], scattering=[9.0, 1.0])
    expected = paint_mixture([0.9, 0.1], surfaces[:2])
    np.testing.assert_allclose(stronger, expected, rtol=1e-12)  # scattering has the same effect as concentration
    assert paint_mixture(np.full((4, 3), 1 / 3), surfaces).shape == (4, 7)


@pytest.mark.parametrize("level", [0.1, 0.5, 1.0])
def test_paint_slope_is_the_derivative(level: float) -> None:
    paint, base = RNG.uniform(0.02, 0.97, size=20), np.full(20, 0.9)
    mixed = [paint_mixture([level, 1 - level], np.stack([paint + d, base])) for d in (-1e-6, 1e-6)]
    np.testing.assert_allclose(paint_slope(level, paint, base), (mixed[1] - mixed[0]) / 2e-6, rtol=1e-5)


def test_paint_slope_at_black_and_white() -> None:
    base = np.array([0.9, 0.9, 1.0])
    slope = paint_slope(0.5, np.array([0.0, 1.0, 1.0]), base)
    np.testing.assert_allclose(slope, [2.0, 0.0, np.sqrt(0.5)])
    near = paint_mixture([0.5, 0.5], np.array([[1e-9], [0.9]]))[0]
    assert near / 1e-9 == pytest.approx(2.0, rel=1e-4)
    white = paint_mixture([0.5, 0.5], np.array([[1 - 1e-6], [1.0]]))[0]
    assert (1 - white) / 1e-6 == pytest.approx(np.sqrt(0.5), rel=1e-3)


def test_tint_differences_equal_those_of_mixed_spectra() -> None:
    solution = solve_palette(metamer_pair())
    found = tint_differences(solution, [(0, 1)], base=0.8, levels=(0.3,))
    grid = solution.problem.grid
    for j, light in enumerate(solution.illuminants):
        matrix = observer.linear_rgb_from_product(light, grid)
        tints = [
            paint_mixture([0.3, 0.7], np.stack([surface.values, np.full(grid.size, 0.8)]))
            for surface in solution.reflectances
        ]
        lab = lab_from_linear_rgb(np.array(tints) @ matrix.T)
        assert found[0, 0, j] == pytest.approx(float(delta_e_2000(lab[0], lab[1])), abs=1e-9)


def test_tint_rows_are_the_derivative_of_tint_colors() -> None:
    problem = metamer_pair()
    solution = solve_palette(problem)
    builder = Assembler(problem, compiled_requests(problem))
    criterion = TintCriterion(levels=(0.4,))
    base = criterion.base_on(problem.grid.size)
    before = builder.assembled("reflectances", solution.state).quadratic
    tinted = with_tints(builder, before, solution.state, criterion)
    assert len(tinted.color_lower) == len(before.color_lower) + 1
    daylight = observer.linear_rgb_from_product(solution.illuminants[1], problem.grid)
    nudge = RNG.normal(size=problem.grid.size) * 1e-6
    for block, old, surface in zip(tinted.blocks, before.blocks, solution.state.reflectances, strict=True):
        (added,) = {len(block.targets) - len(old.targets)}
        assert added == 3
        shown = block.rows[-3:] @ surface - block.targets[-3:]
        exact = daylight @ paint_mixture([0.4, 0.6], np.stack([surface, base]))
        np.testing.assert_allclose(shown, exact, atol=1e-12)
        inner = np.clip(surface, 1e-3, 1 - 1e-3)  # away from the bounds, so that a small change stays within [0, 1]
        slope = paint_slope(0.4, inner, base)
        moved = [paint_mixture([0.4, 0.6], np.stack([inner + sign * nudge, base])) for sign in (-1, 1)]
        np.testing.assert_allclose(
            daylight @ (slope * nudge), daylight @ (moved[1] - moved[0]) / 2, rtol=1e-3, atol=1e-10
        )


@pytest.mark.parametrize(("make", "light"), [(metamer_pair, 1), (hidden_mark, 0)], ids=["pair", "mark"])
def test_metamers_also_match_as_tints(make: object, light: int) -> None:
    problem = make()  # type: ignore[operator]
    plain, criterion = solve_palette(problem), TintCriterion()
    before = largest_tint_difference(plain, criterion)
    solution = solve_with_tints(problem, criterion)
    assert solution.status.trusted
    assert before > 4
    assert solution.residuals["tint_delta_e_2000"] < 1
    pairs = list(combinations(range(len(solution.reflectances)), 2))
    assert tint_differences(solution, pairs, levels=(0.6,))[0, :, light].max() < 1.5  # between the requested levels
    assert np.nanmax(solution.delta_e_2000) < np.nanmax(plain.delta_e_2000) + 0.5  # the undiluted materials still match
    assert plain.delta_e_2000.shape == solution.delta_e_2000.shape


def test_tints_of_a_measured_material_are_matched() -> None:
    problem = metamer_pair()
    skin = catalogue.reflectance("light skin")
    cells = ((Cell.ignore(), Cell.ignore()), (Cell.ignore(), Cell.same_as((0, 1), exact=True)))
    given = replace(problem.reflectances[0], spectrum=skin)
    solution = solve_with_tints(replace(problem, reflectances=(given, problem.reflectances[1]), cells=cells))
    assert solution.residuals["tint_delta_e_2000"] < 0.1


def test_invalid_mixtures_are_refused() -> None:
    with pytest.raises(InvalidInputError, match=r"shares \[0\.5, 0\.6\] of a mixture; expected .* sum to 1"):
        additive_mixture([0.5, 0.6], np.ones((2, 3)))
    with pytest.raises(InvalidInputError, match=r"shares \[-0\.5, 1\.5\]"):
        paint_mixture([-0.5, 1.5], np.ones((2, 3)))
    with pytest.raises(InvalidInputError, match="3 reflectances for 2 shares"):
        paint_mixture([0.5, 0.5], np.ones((3, 3)))
    with pytest.raises(InvalidInputError, match=r"reflectances span 0 to 1\.5; Kubelka-Munk needs 0 to 1"):
        absorption_from_reflectance([0, 1.5])
    with pytest.raises(InvalidInputError, match="scattering spans 0 to 1; expected it above 0"):
        paint_mixture([0.5, 0.5], np.ones((2, 3)), scattering=[0, 1])
    with pytest.raises(InvalidInputError, match=r"ink coverages span 0 to 1\.2; expected 0 to 1"):
        halftone_shares([0, 1.2])
    with pytest.raises(InvalidInputError, match="a tint level is 0; expected a value from 0"):
        TintCriterion(levels=(0,))
    with pytest.raises(InvalidInputError, match="tints are not designed together with 'distinct' cells"):
        solve_with_tints(most_distinct(2))


def test_the_check_of_a_tint_design_is_that_of_its_steps(monkeypatch) -> None:
    """It was always perfect: a KKT residual of 0 was stated for any answer."""
    from spectral_core.palette.paint import tints
    from spectral_core.palette.qp.answer import Check

    def stated(quadratic):
        answer = tints_solve(quadratic)
        return replace(answer, check=Check(5e-7, 0.0, 0.0))

    tints_solve = tints.solve
    monkeypatch.setattr(tints, "solve", stated)
    solution = solve_with_tints(metamer_pair(), iterations=3)
    assert solution.rounds == 3
    assert solution.kkt_residual == 5e-7
    assert "the match of tints may still improve; its design ended after step 3" in solution.notes


def test_tints_are_matched_with_lights_that_may_still_improve(monkeypatch) -> None:
    """A palette whose time ended was returned without tints, and without a note."""
    from spectral_core.palette.paint import tints

    real, asked = tints.solve_palette, []

    def ended(problem, *, warm=None):
        asked.append(warm)
        return replace(real(problem, warm=warm), status=PaletteStatus.IMPROVING, remedy="continue")

    monkeypatch.setattr(tints, "solve_palette", ended)
    problem = metamer_pair()
    plain = real(problem)
    solution = solve_with_tints(problem, warm=plain, iterations=10)
    assert asked == [plain]
    assert solution.status is PaletteStatus.IMPROVING and solution.remedy == "continue"
    assert solution.residuals["tint_delta_e_2000"] < 0.2 * largest_tint_difference(plain, TintCriterion())


def test_tints_of_a_palette_that_cannot_be_met_are_not_matched_and_a_note_says_so() -> None:
    problem = metamer_pair()
    twice = replace(problem, lights=(problem.lights[0], problem.lights[0]))
    cells = ((Cell.fixed((0.3, 0.3, 0.1), exact=True), Cell.fixed((0.2, 0.3, 0.1), exact=True)), problem.cells[1])
    solution = solve_with_tints(replace(twice, cells=cells))
    assert solution.status is PaletteStatus.EXACT_CONFLICT
    assert "tints are not matched, because the other cells cannot be met" in solution.notes
    with pytest.raises(InvalidInputError, match="bound them by 0 and 1, or design without tints"):
        solve_with_tints(replace(problem, reflectance_bounds=(-np.inf, np.inf)))


def test_tints_keep_the_perceptual_match() -> None:
    """Errors of other cells count in CIELAB as without tints; they counted in linear RGB."""
    problem = replace(hidden_mark(), match="perceptual")
    plain = solve_palette(problem, explain=False)
    solution = solve_with_tints(problem, TintCriterion(weight=1e-6), iterations=5)
    np.testing.assert_allclose(solution.delta_e_2000, plain.delta_e_2000, atol=0.05)
