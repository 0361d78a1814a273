# SPDX-License-Identifier: GPL-3.0-or-later
"""Most distinct colors: compared with brute force if possible, and the stated figures."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import initial_state
from spectral_core.palette.distinct.cells import distinct_cells, distinct_pairs, least_difference, wants_distinct
from spectral_core.palette.distinct.search import _Search, solve_distinct
from spectral_core.palette.distinct.step import solve_step
from spectral_core.palette.presets import design_grid, most_distinct, sine_light, split_light
from spectral_core.spectra import catalogue, observer
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.spectrum import Reflectance, SpectralGrid

D65, HP1, FL2 = (observer.normalized(catalogue.illuminant(name)) for name in ("D65", "HP1", "FL2"))


def search_of(problem: PaletteProblem, engine: str = "piqp") -> _Search:
    builder = Assembler(problem, compiled_requests(problem))
    state = initial_state(problem)
    assembled = builder.assembled("reflectances", state)
    return _Search(assembled.quadratic, distinct_cells(builder, state, assembled), engine)


@pytest.mark.parametrize(("color", "known"), [((0.2, 0.2, 0.2), 52.058), ((0.2, 0.1, 0.1), 39.65)])
def test_two_metamers_are_as_different_as_a_global_search_finds(color: tuple[float, ...], known: float) -> None:
    """``known``: by SLSQP from random spectra, with integrals of its own. Directions alone end at 50.3 and 37.3."""
    cells = tuple((Cell.fixed(color, exact=True), Cell.distinct_from((1 - row, 1))) for row in range(2))
    lights = (PaletteLight(D65), PaletteLight(HP1))
    rows = (PaletteReflectance("a"), PaletteReflectance("b"))
    solution = solve_palette(PaletteProblem(design_grid(20), lights, rows, cells, smoothness=0.1))
    assert solution.status.trusted
    assert solution.residuals["least_delta_e_2000"] > known - 0.05
    np.testing.assert_allclose(solution.actual_linear_rgb[:, 0], [color, color], atol=1e-9)


def test_five_exact_metamers_under_sodium() -> None:
    """The acceptance line: at least 30 under high-pressure sodium, exact under D65, smooth, possible surfaces."""
    solution = solve_palette(most_distinct(5))
    assert solution.status.trusted
    shown = [[observer.xyz_of(light, surface) for light in solution.illuminants] for surface in solution.reflectances]
    colors = np.array(shown) @ observer.RGB_FROM_XYZ.T
    lab = lab_from_linear_rgb(colors)
    pairs = list(combinations(range(5), 2))
    assert max(float(delta_e_2000(lab[a, 0], lab[b, 0])) for a, b in pairs) < 1e-6
    assert min(float(delta_e_2000(lab[a, 1], lab[b, 1])) for a, b in pairs) >= 30
    assert colors.min() >= -1e-9  # a screen can show the common color, too
    assert colors.max() <= 1 + 1e-9
    for surface in solution.reflectances:
        # Length of the second differences at 10 nm: the reflectances of the thesis have 0.18 to 1.78.
        assert np.linalg.norm(np.diff(surface.values, 2)) < 0.63
        assert 0 <= surface.values.min() <= surface.values.max() <= 1
    assert solution.residuals["least_delta_e_2000"] == pytest.approx(least_difference(solution), abs=1e-9)


def test_two_materials_against_brute_force() -> None:
    """Four samples and an exact color leave one free direction per material: all pairs of positions on it are tried."""
    grid = SpectralGrid(np.array([430.0, 500, 570, 640]))
    gray = observer.linear_rgb_from_product(D65, grid) @ np.full(4, 0.5)
    cells = tuple((Cell.fixed(gray, exact=True), Cell.distinct_from((1 - i, 1))) for i in range(2))
    lights = (PaletteLight(D65), PaletteLight(FL2))
    problem = PaletteProblem(grid, lights, (PaletteReflectance("a"), PaletteReflectance("b")), cells, smoothness=0.0)
    null = np.linalg.svd(observer.linear_rgb_from_product(D65, grid))[2][-1]
    reach = min(0.5 / np.abs(null).max(), np.inf)
    places = np.linspace(-reach, reach, 801)
    colors = (0.5 + places[:, None] * null) @ observer.linear_rgb_from_product(FL2, grid).T
    inside = colors[(colors.min(axis=1) >= 0) & (colors.max(axis=1) <= 1)]
    lab = lab_from_linear_rgb(inside)
    everything = float(delta_e_2000(lab[:, None], lab[None]).max())
    assert everything > 5
    found = solve_distinct(problem, starts=4)
    assert found.residuals["least_delta_e_2000"] == pytest.approx(everything, abs=0.05)


def test_a_step_by_piqp_equals_the_step_by_cvxpy() -> None:
    pytest.importorskip("cvxpy")
    search = search_of(most_distinct(3))
    rng = np.random.default_rng(2)
    x = search.start(rng).x
    step = search._linearized(x, 20.0, rng)
    fast, general = solve_step(step, "piqp"), solve_step(step, "cvxpy")
    assert fast.check.passed and general.feasible
    assert fast.t == pytest.approx(general.t, abs=1e-4)
    values = [0.5 * a.x @ (step.hessian[:-1, :-1] @ a.x) + step.linear[:-1] @ a.x - a.t for a in (fast, general)]
    assert values[0] == pytest.approx(values[1], abs=1e-5)


def test_derivatives_equal_differences_of_the_formula() -> None:
    search = search_of(most_distinct(3))
    rng = np.random.default_rng(0)
    colors = rng.uniform(0.05, 0.9, size=(3, 3))
    slopes = search._cells.slopes(colors, rng)
    lab = lab_from_linear_rgb(colors)
    for p, (a, b) in enumerate(search._cells.pairs):
        step_a, step_b = rng.normal(size=(2, 3)) * 1e-5
        moved = delta_e_2000(lab[a] + step_a, lab[b] + step_b) - delta_e_2000(lab[a], lab[b])
        assert slopes[0, p] @ step_a + slopes[1, p] @ step_b == pytest.approx(moved, rel=1e-3, abs=1e-9)


def test_equal_start_colors_are_separated() -> None:
    search = search_of(most_distinct(2))
    slopes = search._cells.slopes(np.full((2, 3), 0.4), np.random.default_rng(0))
    assert np.linalg.norm(slopes[0, 0]) == pytest.approx(1.0)
    np.testing.assert_array_equal(slopes[0], -slopes[1])


def test_no_step_of_the_search_gets_worse() -> None:
    search = search_of(most_distinct(4))
    rng = np.random.default_rng(5)
    x = search.start(rng).x
    before = search._merit(x)
    found = search.climbed(x, rng)
    again = search.climbed(found.x, rng)
    assert before < found.merit <= again.merit < found.merit + 0.1


def test_a_warm_start_keeps_the_solution_and_follows_an_edit() -> None:
    problem = most_distinct(3)
    first = solve_palette(problem)
    again = solve_palette(problem, warm=first)
    assert "best of 1 local search" in again.notes[-1]
    assert again.residuals["least_delta_e_2000"] > first.residuals["least_delta_e_2000"] - 0.1
    rougher = solve_palette(replace(problem, smoothness=0.1), warm=again)
    assert rougher.residuals["least_delta_e_2000"] > again.residuals["least_delta_e_2000"] + 1
    ignoring = replace(problem, cells=tuple((row[0], Cell.ignore()) for row in problem.cells))
    from_one_color = solve_palette(problem, warm=solve_palette(ignoring))
    assert "best of 7 local searches" in from_one_color.notes[-1]


def test_distinct_from_a_measured_surface() -> None:
    grid = SpectralGrid.uniform(380, 780, 10)
    skin = catalogue.reflectance("light skin")
    rows = (PaletteReflectance("skin", skin), PaletteReflectance("paint"))
    cells = ((Cell.ignore(), Cell.ignore()), (Cell.same_as((0, 0), exact=True), Cell.distinct_from((0, 1))))
    lights = tuple(map(PaletteLight, (D65, HP1)))
    solution = solve_palette(PaletteProblem(grid, lights, rows, cells, smoothness=0.1))
    assert solution.status.trusted
    np.testing.assert_allclose(solution.actual_linear_rgb[1, 0], solution.actual_linear_rgb[0, 0], atol=1e-6)
    assert solution.residuals["least_delta_e_2000"] > 10


def test_free_lights_are_designed_for_the_other_cells_first() -> None:
    problem = split_light(luminance=3.0)
    rows = [list(row) for row in problem.cells]
    for i in (1, 2):
        rows[i][2] = Cell.distinct_from((3 - i, 2))
    solution = solve_palette(replace(problem, cells=tuple(map(tuple, rows)), rounds=2))
    assert any("the lights were designed for the other cells" in note for note in solution.notes)
    assert solution.residuals["least_delta_e_2000"] > 10


def test_a_lamp_outside_the_gamut() -> None:
    problem = most_distinct(2, reveal="LPS")
    solution = solve_palette(problem)
    assert solution.status.trusted
    assert solution.residuals["least_delta_e_2000"] > 20  # one color, two brightnesses


def test_a_common_color_that_no_screen_shows() -> None:
    """A measured surface that is too bright for the display extends the gamut, with a message."""
    problem = most_distinct(2, luminance=2.0)
    white = replace(problem.reflectances[0], spectrum=catalogue.reflectance("white 9.5 (.05 D)"))
    solution = solve_palette(replace(problem, reflectances=(white, problem.reflectances[1])))
    assert solution.status.trusted
    assert solution.actual_linear_rgb[:, 0].max() > 1.5
    np.testing.assert_allclose(solution.actual_linear_rgb[0, 0], solution.actual_linear_rgb[1, 0], atol=1e-6)
    assert any(
        "out of the gamut: the requests of the other cells force a color out of the display's gamut" in note
        for note in solution.notes
    )


def test_equal_colors_are_not_called_solved() -> None:
    """Exact black under one lamp leaves only one spectrum, so both materials are equal."""
    grid = SpectralGrid.uniform(400, 700, 60)
    cells = ((Cell.black(exact=True), Cell.distinct_from((1, 1))), (Cell.black(exact=True), Cell.distinct_from((0, 1))))
    rows = (PaletteReflectance("a"), PaletteReflectance("b"))
    solution = solve_palette(PaletteProblem(grid, (PaletteLight(D65), PaletteLight(HP1)), rows, cells))
    assert solution.status == "compromise"
    assert solution.residuals["least_delta_e_2000"] < 1


def test_conflicting_exact_cells_are_reported() -> None:
    problem = most_distinct(2)
    red = Cell.fixed((1.0, 0.0, 0.0), exact=True)
    impossible = problem.with_cell((0, 0), red).with_cell((1, 0), Cell.fixed((5.0, 5.0, 5.0), exact=True))
    solution = solve_palette(impossible)
    assert not solution.status.trusted
    assert "no colors were made distinct" in solution.notes[-1]


def test_impossible_requests_raise_errors() -> None:
    problem = most_distinct(2)
    with pytest.raises(InvalidInputError, match="starts is 0; expected a value from 1"):
        solve_distinct(problem, starts=0)
    with pytest.raises(UnknownNameError, match="no engine for distinct colors is named 'magic'"):
        solve_distinct(problem, engine="magic")
    plain = replace(problem, cells=tuple((row[0], Cell.ignore()) for row in problem.cells))
    assert not wants_distinct(plain)
    with pytest.raises(InvalidInputError, match="no cell with a reflectance to design is 'distinct'"):
        solve_distinct(plain)


def test_pairs_are_listed_once() -> None:
    assert distinct_pairs(most_distinct(3)) == [((0, 1), (1, 1)), ((0, 1), (2, 1)), ((1, 1), (2, 1))]
    assert sine_light(60, SpectralGrid.uniform()).values.min() >= 0


def test_two_measured_materials_that_are_alike_do_not_limit_the_designed_ones() -> None:
    """The least difference was that of the measured pair, 0.3, and the designed materials were left black."""
    grid = design_grid()
    lights = tuple(PaletteLight(each.scaled(2)) for each in (D65, HP1))
    gray = [Reflectance(f"gray {share}", grid, np.full(grid.size, share)) for share in (0.3, 0.304)]
    surfaces = [PaletteReflectance("a"), PaletteReflectance("b"), *(PaletteReflectance(g.name, g) for g in gray)]
    first = [Cell.free(), Cell.same_as((0, 0), exact=True), Cell.ignore(), Cell.ignore()]
    others = [[(k, 1) for k in range(4) if k != i] for i in range(4)]
    cells = [(cell, Cell.distinct_from(*rest)) for cell, rest in zip(first, others, strict=True)]
    solution = solve_distinct(PaletteProblem(grid, lights, tuple(surfaces), tuple(cells)), starts=1)
    lab = lab_from_linear_rgb(solution.actual_linear_rgb[:, 1])
    least = min(float(delta_e_2000(lab[a], lab[b])) for a, b in combinations(range(4), 2) if (a, b) != (2, 3))
    assert least > 25
    assert solution.residuals["least_delta_e_2000"] == pytest.approx(least, abs=1e-9)
    assert not any("measured" in note for note in solution.notes)

    given = PaletteProblem(
        grid, lights, tuple(surfaces[2:]), ((cells[2][0], Cell.distinct_from((1, 1))), cells[0][:1] * 2)
    )
    assert not wants_distinct(given)
    assert "none can change" in solve_palette(given).notes[0]


def pair_beside(target, **settings):
    """Two exact metamers under daylight that should differ under sodium light."""
    lights = tuple(PaletteLight(observer.normalized(catalogue.illuminant(name))) for name in ("D65", "HP1"))
    rows = (
        (Cell.fixed(target, exact=True), Cell.distinct_from((1, 1))),
        (Cell.same_as((0, 0), exact=True), Cell.distinct_from((0, 1))),
    )
    materials = tuple(PaletteReflectance(name) for name in "ab")
    return PaletteProblem(design_grid(), lights, materials, rows, **settings)


def test_lights_are_brightened_beside_distinct_cells_too() -> None:
    """The setting was ignored: a color brighter than white was a conflict of exact cells."""
    problem = pair_beside((1.9, 1.9, 1.9), scale_lights=True)
    solution = solve_palette(problem)
    assert solution.status.usable
    assert solution.light_scale > 1.9
    assert any("times brighter" in note for note in solution.notes)
    for light, given in zip(solution.illuminants, problem.lights, strict=True):
        np.testing.assert_allclose(light.values, solution.light_scale * given.spectrum.values)
    again = solve_palette(problem, warm=solution)
    assert again.light_scale == solution.light_scale
    darker = solve_palette(pair_beside((0.3, 0.3, 0.3), scale_lights=True), warm=solution)
    assert darker.light_scale == 1
    assert darker.status.usable


def test_worst_case_matches_count_beside_distinct_cells() -> None:
    """The shares of an earlier design, in which all errors were 0, left the further observer without weight."""
    names = ("cie_1931_2deg", "cie_1964_10deg")
    problem = pair_beside((0.2, 0.2, 0.2), observers=names)
    both = [solve_palette(replace(problem, robustness=how)) for how in ("soft", "worst_case")]
    assert both[1].max_delta_e_2000 == pytest.approx(both[0].max_delta_e_2000, abs=0.3)
    assert any("not by their worst case" in note for note in both[1].notes)
    assert not any("not by their worst case" in note for note in both[0].notes)
