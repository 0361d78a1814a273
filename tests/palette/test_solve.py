# SPDX-License-Identifier: GPL-3.0-or-later
"""Solved palettes: the figures of the thesis, every type of cell, every type of light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.palette.cases import thesis_data as thesis
from benchmarks.palette.palette_robust import metamer_cells, pairs_by_observer
from spectral_core.palette import (
    Cell,
    PaletteLight,
    PaletteProblem,
    PaletteReflectance,
    SubspaceCriterion,
    solve_palette,
)
from spectral_core.palette.assemble.criteria import second_differences
from spectral_core.palette.presets import PRESETS, design_grid, hidden_mark, metamer_pair, sine_light, split_light
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.color import (
    RGB_FROM_XYZ,
    WHITE_XYZ,
    delta_e_2000,
    lab_from_linear_rgb,
    lab_jacobian_from_linear_rgb,
)
from spectral_core.spectra.observer import OBSERVER_NAMES, normalized, xyz_of
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, Spectrum

D65, HP1 = (normalized(illuminant(name)) for name in ("D65", "HP1"))
GRID = design_grid()


def one(*cells: Cell, lights: tuple = (PaletteLight(D65), PaletteLight(HP1)), **settings) -> PaletteProblem:
    """A palette with a single reflectance."""
    return PaletteProblem(GRID, lights[: len(cells)], (PaletteReflectance("r"),), (cells,), **settings)


def pair_difference(solution, light: int = 0) -> float:
    lab = lab_from_linear_rgb(solution.actual_linear_rgb)
    return float(delta_e_2000(lab[0, light], lab[1, light]))


# -- cells --------------------------------------------------------------------------------------------------------


def test_the_hidden_mark_is_invisible_under_one_light_and_visible_under_the_other():
    solution = solve_palette(hidden_mark())
    assert solution.status == "solved"
    assert pair_difference(solution, 0) < 1e-6
    assert pair_difference(solution, 1) > 20
    assert all(isinstance(surface, Reflectance) for surface in solution.reflectances)


def test_the_designed_color_equals_the_integral_of_the_renderer():
    solution = solve_palette(hidden_mark())
    for i, surface in enumerate(solution.reflectances):
        for j, light in enumerate(solution.illuminants):
            rendered = RGB_FROM_XYZ @ xyz_of(light, surface)
            np.testing.assert_allclose(solution.actual_linear_rgb[i, j], rendered, atol=1e-9)


def test_metamers_have_one_free_color_within_their_box():
    solution = solve_palette(metamer_pair())
    assert pair_difference(solution, 1) < 1e-6
    common = solution.actual_linear_rgb[0, 1]
    assert np.all(common >= np.array([0.05, 0.10, 0.25]) - 1e-3)
    assert np.all(common <= np.array([0.35, 0.45, 0.9]) + 1e-3)


def test_a_metameric_black_is_black_under_one_light_only():
    solution = solve_palette(
        one(Cell.black(exact=True), Cell.fixed((0.10, 0.05, 0.0)), reflectance_bounds=(-np.inf, np.inf))
    )
    assert np.abs(solution.actual_linear_rgb[0, 0]).max() < 1e-7
    assert solution.delta_e_2000[0, 1] < 0.1
    assert not isinstance(solution.reflectances[0], Reflectance)
    assert isinstance(solution.reflectances[0], Spectrum)


def test_a_constant_color_is_equal_under_both_lights():
    lights = (PaletteLight(D65), PaletteLight(normalized(illuminant("FL11"))))
    cells = (Cell.fixed((0.2, 0.2, 0.1)), Cell.constant((0, 0), exact=True))
    solution = solve_palette(one(*cells, lights=lights), explain=False)
    assert solution.status == "solved"
    shown = solution.actual_linear_rgb[0]
    assert np.abs(shown[0] - shown[1]).max() < 1e-7


def test_an_ignored_cell_has_no_effect():
    alone = solve_palette(one(Cell.fixed((0.3, 0.2, 0.1)), Cell.ignore()))
    assert np.isnan(alone.delta_e_2000[0, 1])
    assert alone.delta_e_2000[0, 0] < 1e-3


def test_the_larger_weight_decides_between_conflicting_targets():
    colors = [Cell.fixed((0.3, 0.3, 0.3), weight=w) for w in (1.0, 1.0)]
    twin = PaletteLight(Illuminant("twin", D65.grid, D65.values * 1.3))
    errors = []
    for heavy in (0, 1):
        cells = [replace(cell, weight=30.0) if k == heavy else cell for k, cell in enumerate(colors)]
        errors.append(solve_palette(one(*cells, lights=(PaletteLight(D65), twin))).delta_e_2000[0])
    assert errors[0][0] < 0.1 < errors[0][1]
    assert errors[1][1] < 0.1 < errors[1][0]


# -- lights -------------------------------------------------------------------------------------------------------


def test_a_light_from_primaries_is_their_sum_and_looks_white():
    lamps = tuple(normalized(illuminant(name)) for name in ("LED-B1", "LED-B5", "LED-RGB1", "D75", "HP1", "FL1"))
    start = normalized(illuminant("LED-B5"))
    light = PaletteLight(start, free=True, primaries=lamps, white_xyz=WHITE_XYZ, luminance=1.0)
    surface = PaletteReflectance("skin", reflectance("light skin"))
    problem = PaletteProblem(GRID, (light,), (surface,), ((Cell.fixed((0.45, 0.25, 0.18)),),))
    solution = solve_palette(problem, explain=False)
    amounts = solution.amounts[0]
    assert amounts.min() >= 0
    mixed = sum(amount * xyz_of(lamp) for amount, lamp in zip(amounts, lamps, strict=True))
    np.testing.assert_allclose(mixed / mixed.sum(), WHITE_XYZ / WHITE_XYZ.sum(), atol=1e-6)
    assert mixed[1] == pytest.approx(1.0, abs=1e-6)


def test_a_white_outside_the_gamut_of_the_primaries_is_reported():
    lamps = tuple(normalized(illuminant(name)) for name in ("LED-B1", "HP1"))
    light = PaletteLight(lamps[0], free=True, primaries=lamps, white_xyz=WHITE_XYZ, luminance=1.0)
    surface = PaletteReflectance("skin", reflectance("light skin"))
    solution = solve_palette(PaletteProblem(GRID, (light,), (surface,), ((Cell.fixed((0.45, 0.25, 0.18)),),)))
    assert solution.status == "exact_conflict"
    assert "“LED-B1” cannot make the white" in solution.remedy


def test_lights_are_brightened_until_reflectances_fit():
    bright = one(Cell.fixed((1.5, 0.9, 0.9)))
    assert solve_palette(bright).delta_e_2000[0, 0] > 3
    solution = solve_palette(replace(bright, scale_lights=True))
    assert solution.light_scale > 1
    assert solution.delta_e_2000[0, 0] < 0.1
    assert solution.reflectances[0].values.max() <= 1
    np.testing.assert_allclose(solution.illuminants[0].values, D65.values * solution.light_scale)
    assert any("times brighter" in note for note in solution.notes)


def test_a_warm_start_continues_the_last_solve():
    problem = replace(split_light(), rounds=2)
    first = solve_palette(problem, explain=False)
    second = solve_palette(problem, warm=first, explain=False)
    assert second.residuals["color"] < first.residuals["color"]


# -- criteria -----------------------------------------------------------------------------------------------------


def test_the_smoothness_weight_reduces_roughness():
    rough, smooth = (solve_palette(replace(hidden_mark(), smoothness=w)).residuals["smoothness"] for w in (0.01, 1.0))
    assert smooth < rough / 2


def test_perceptual_match_lowers_the_error_in_cielab():
    """Under given lights the perceptual match is the least-squares solution in CIELAB, linearized at the targets."""
    problem = thesis.random_palette((6, 14), np.random.default_rng(2))
    given = replace(problem, lights=tuple(PaletteLight(light.spectrum) for light in problem.lights))
    errors = []
    for match in ("linear", "perceptual"):
        solution = solve_palette(replace(given, match=match, rounds=12), explain=False)
        slopes = lab_jacobian_from_linear_rgb(solution.target_linear_rgb)
        missed = slopes @ (solution.actual_linear_rgb - solution.target_linear_rgb)[..., None]
        errors.append(float(np.sum(missed**2)))
    assert errors[1] < 0.9 * errors[0]


def test_the_subspace_criterion_reduces_the_difference_of_both_computations():
    basis = np.linalg.qr(np.vander(np.linspace(-1, 1, GRID.size), 7))[0]
    rest = {}
    for weight in (0.0, 10.0):
        problem = replace(hidden_mark(grid=GRID), subspace=SubspaceCriterion(basis, weight, componentwise=False))
        rest[weight] = solve_palette(problem, explain=False).residuals["subspace"]
    assert rest[10.0] < 0.5 * rest[0.0]


def test_redesigned_metamers_match_for_four_observers():
    one_eye = replace(thesis.from_scratch(20, 0.01), cells=metamer_cells())
    solution = solve_palette(replace(one_eye, observers=OBSERVER_NAMES), explain=False)
    assert max(pairs_by_observer(list(solution.reflectances), solution.illuminants[0], thesis.GRID).values()) < 4.2
    assert np.nanmax(solution.delta_e_2000) < 0.6
    assert "robust" in solution.residuals


def test_variants_of_a_light_keep_metamers_equal():
    variants = tuple(normalized(illuminant(name)) for name in ("D55", "D75"))
    cells = (
        (Cell.fixed((0.2, 0.2, 0.2)), Cell.fixed((0.3, 0.2, 0.0))),
        (Cell.same_as((0, 0)), Cell.fixed((0.2, 0.1, 0))),
    )
    surfaces = tuple(map(PaletteReflectance, "ab"))
    differences = {}
    for given in ((), variants):
        problem = PaletteProblem(GRID, (PaletteLight(D65, variants=given), PaletteLight(HP1)), surfaces, cells)
        a, b = solve_palette(problem, explain=False).reflectances
        under = [lab_from_linear_rgb(np.stack([RGB_FROM_XYZ @ xyz_of(v, s) for s in (a, b)])) for v in variants]
        differences[len(given)] = max(float(delta_e_2000(*lab)) for lab in under)
    assert differences[2] < 0.5 * differences[0]


def test_the_worst_case_equals_that_of_cvxpy():
    cp = pytest.importorskip("cvxpy")
    wanted = thesis.wanted_colors()
    cells = tuple((Cell.same_as((0, 0)) if i else Cell.free(), Cell.fixed(wanted[i, 2])) for i in range(3))
    lights = (PaletteLight(normalized(D65, luminance=6)), PaletteLight(sine_light(88.4, thesis.GRID, luminance=6)))
    problem = PaletteProblem(
        thesis.GRID, lights, tuple(map(PaletteReflectance, "abc")), cells,
        observers=OBSERVER_NAMES, robustness="worst_case", robust_weight=2.0, smoothness=0.1, match="linear",
    )  # fmt: skip
    solution = solve_palette(problem, explain=False)
    assert solution.residuals["worst_case_left"] < 0.02
    matrices = solution.state.light_matrices()
    rough = 0.1 * second_differences(thesis.GRID)

    def least(spectra: list, bounds: list) -> float:
        """The minimum of the worst-case objective by cvxpy, over the free entries of ``spectra``."""
        common, worst = [cp.Variable(3) for _ in OBSERVER_NAMES], cp.Variable()
        terms = [cp.sum_squares(rough @ s) for s in spectra]
        terms += [cp.sum_squares(matrices[0, 1] @ s - c[1].target) / 3 for s, c in zip(spectra, cells, strict=True)]
        terms += [cp.sum_squares(matrices[0, 0] @ s - common[0]) / 3 for s in spectra]
        rows = [(o, s) for o in range(1, 4) for s in spectra]
        held = [cp.norm(matrices[o, 0] @ s - common[o]) <= worst for o, s in rows]
        robust = len(rows) * problem.robust_weight**2 / 6 * worst**2
        return cp.Problem(cp.Minimize(cp.sum(cp.hstack(terms)) / 2 + robust), held + bounds).solve(solver="CLARABEL")

    unknown = [cp.Variable(31) for _ in cells]
    best = least(unknown, [s >= 0 for s in unknown] + [s <= 1 for s in unknown])
    ours = least([cp.Constant(surface.values) for surface in solution.reflectances], [])
    assert ours <= best * 1.02


# -- impossible requests -------------------------------------------------------------------------------------------


def test_a_light_without_luminance_is_reported():
    grid = SpectralGrid.uniform(850, 950, 10)
    problem = PaletteProblem(grid, (PaletteLight(D65),), (PaletteReflectance("r"),), ((Cell.fixed((0.2, 0.2, 0.2)),),))
    solution = solve_palette(problem)
    assert solution.status == "invisible"
    assert "380 and 780 nm" in solution.remedy


def test_two_exact_colors_under_one_light_conflict_and_are_reported():
    twin = PaletteLight(Illuminant("twin", D65.grid, D65.values))
    cells = (Cell.fixed((0.2, 0.2, 0.2), exact=True), Cell.fixed((0.4, 0.2, 0.2), exact=True))
    solution = solve_palette(one(*cells, lights=(PaletteLight(D65), twin)))
    assert solution.status == "exact_conflict"
    assert {conflict.cell for conflict in solution.conflicts} == {(0, 0), (0, 1)}
    assert solution.conflicts[0].relieved_by[0] != solution.conflicts[0].cell
    assert solution.conflicts[0].delta_e_without < 1e-3
    assert "without “r” under" in solution.remedy


def test_a_missed_color_lists_the_cell_that_would_relieve_it():
    fixed = split_light()
    problem = replace(fixed, lights=tuple(PaletteLight(light.spectrum) for light in fixed.lights))
    solution = solve_palette(problem)
    assert solution.status == "compromise"
    worst = solution.conflicts[0]
    assert worst.delta_e_2000 == pytest.approx(solution.max_delta_e_2000)
    released = problem.with_cell(worst.relieved_by[0], Cell.ignore())
    assert solve_palette(released, explain=False).delta_e_2000[worst.cell] < 0.5 * worst.delta_e_2000


@pytest.mark.parametrize("name", list(PRESETS))
def test_every_preset_is_solved(name):
    solution = solve_palette(PRESETS[name]())
    # Designed lights that must look white converge slowly to the last digit.
    allowed = ("solved", "still_improving") if name == "X-ray smoke" else ("solved",)
    assert solution.status in allowed
    assert solution.max_delta_e_2000 < 3
    assert solution.kkt_residual < 1e-6
    assert solution.bound_violation <= 1e-9


def test_a_luminance_outside_the_bounds_of_a_light_is_a_conflict():
    light = PaletteLight(D65.resampled(GRID), free=True, luminance=1.0)
    surface = PaletteReflectance("skin", reflectance("light skin"))
    cells = ((Cell.fixed((0.45, 0.25, 0.18)),),)
    solution = solve_palette(PaletteProblem(GRID, (light,), (surface,), cells, light_bounds=(0.0, 1e-4)))
    assert solution.status == "exact_conflict"
    assert "Change the bounds, or the luminance" in solution.remedy
