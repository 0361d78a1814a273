# SPDX-License-Identifier: GPL-3.0-or-later
"""Conflicts name only releases that help when they are made, and the cells that exclude a color together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.palette import (
    Cell,
    PaletteLight,
    PaletteProblem,
    PaletteReflectance,
    PaletteSession,
    solve_palette,
)
from spectral_core.palette.assemble.state import initial_state
from spectral_core.palette.explain import releases
from spectral_core.palette.presets import design_grid
from spectral_core.spectra.catalogue import illuminant, illuminant_names, reflectance
from spectral_core.spectra.observer import normalized


def palette_of(cells, lamps, **settings) -> PaletteProblem:
    lights = tuple(PaletteLight(normalized(illuminant(name))) for name in lamps)
    surfaces = tuple(PaletteReflectance("abcdef"[k]) for k in range(len(cells)))
    return PaletteProblem(design_grid(), lights=lights, reflectances=surfaces, cells=cells, **settings)


def chain(count: int) -> PaletteProblem:
    """A black material, and others that are the same as the one before; the last is to be brown under lamp A."""
    rows = [(Cell.black(exact=True), Cell.ignore())]
    rows += [(Cell.same_as((k, 0), exact=True), Cell.ignore()) for k in range(count - 1)]
    return palette_of((*rows[:-1], (rows[-1][0], Cell.fixed((0.5, 0.2, 0.1)))), ("D65", "A"))


@pytest.mark.parametrize("count", [2, 3])
def test_a_material_that_same_cells_make_black_names_all_of_them(count) -> None:
    problem = chain(count)
    (conflict,) = solve_palette(problem).conflicts
    assert conflict.cell == (count - 1, 1)
    assert set(conflict.relieved_by) == {(k, 0) for k in range(count)}
    assert "“a” under “D65” (exact, black)" in conflict.text
    assert "“b” under “D65” (exact, same as “a” under “D65”)" in conflict.text
    assert "together exclude it" in conflict.text
    for release in conflict.relieved_by:
        after = solve_palette(problem.with_cell(release, Cell.ignore()), explain=False)
        assert after.delta_e_2000[conflict.cell] == pytest.approx(conflict.delta_e_without, abs=0.1)


def test_a_soft_match_between_exact_ones_is_not_counted_as_exact() -> None:
    """A release was said to leave ΔE 3.6, where 18.1 remained: the range of a soft match held as if it were exact."""
    levels = {"Luxeon WW 2880": 2, "C": 3, "FL2": 6}
    lights = [PaletteLight(normalized(illuminant(name), luminance=level)) for name, level in levels.items()]
    box = (0.35, 0.08, 0.22), (0.6, 0.2, 0.44)
    cells = (
        (Cell.ignore(), Cell.same_as((2, 0)), Cell.constant((0, 1), exact=True)),
        (Cell.ignore(), Cell.same_as((0, 2), box=box), Cell.ignore()),
        (Cell.fixed((0.98, 0.58, 0.19)), Cell.ignore(), Cell.same_as((1, 1), exact=True)),
    )
    surfaces = tuple(PaletteReflectance(name) for name in "abc")
    problem = PaletteProblem(design_grid(20), tuple(lights), surfaces, cells, smoothness=0.05)
    solution = solve_palette(problem)
    named = [each for each in solution.conflicts if each.relieved_by]
    assert (1, 1) in {each.cell for each in named}
    for conflict in named:
        after = solve_palette(problem.with_cell(conflict.relieved_by[0], Cell.ignore()), explain=False)
        assert after.delta_e_2000[conflict.cell] == pytest.approx(conflict.delta_e_without, abs=0.1)


def test_one_exact_black_cell_is_named_alone() -> None:
    problem = palette_of(((Cell.black(exact=True), Cell.fixed((0.1, 0.3, 0.2))),), ("FL2", "D65"))
    (conflict,) = solve_palette(problem).conflicts
    assert conflict.relieved_by == ((0, 0),)
    assert "(exact, black) excludes it" in conflict.text


def test_two_black_cells_that_each_exclude_a_color_are_named_as_a_set() -> None:
    row = (Cell.black(exact=True), Cell.black(exact=True), Cell.fixed((0.2, 0.3, 0.1)))
    problem = palette_of((row,), ("D65", "FL2", "A"))
    (conflict,) = solve_palette(problem).conflicts
    assert conflict.relieved_by == ()
    assert "“a” under “D65” (exact, black) and “a” under “FL2” (exact, black) exclude it, each of them" in conflict.text
    after = solve_palette(problem.with_cells({(0, 0): Cell.ignore(), (0, 1): Cell.ignore()}), explain=False)
    assert after.delta_e_2000[0, 2] == pytest.approx(conflict.delta_e_without, abs=0.1)


def test_a_cell_of_another_material_that_moves_a_shared_color_is_named() -> None:
    """“c” is compared with “a”, whose color another of its cells holds; “no other cell is to blame” was said."""
    rows = (
        (Cell.free(((1.015, 0.673, 0.752), (1.115, 0.773, 0.852))), Cell.ignore(), Cell.same_as((1, 2), exact=True)),
        (
            Cell.free(((1.285, 0.311, 0.898), (1.385, 0.411, 0.998))),
            Cell.free(((0.361, -0.077, 0.177), (0.461, 0.023, 0.277)), exact=True),
            Cell.fixed((0.476, 0.043, 0.097)),
        ),
        (
            Cell.fixed((1.791, 1.297, 0.193)),
            Cell.same_as((0, 1), box=((0.204, 0.271, -0.021), (0.404, 0.471, 0.179))),
            Cell.ignore(),
        ),
    )
    problem = palette_of(rows, ("MHC100/U/MP/4K", "F32T8/TL865/PLUS (Triphosphor)", "F32T8/TL830 (Triphosphor)"))
    brightness = (2.0, 0.5, 0.5)
    lights = [PaletteLight(light.spectrum.scaled(k)) for light, k in zip(problem.lights, brightness, strict=True)]
    problem = replace(problem, lights=tuple(lights))
    solution = solve_palette(problem)
    for conflict in solution.conflicts:
        after = {}
        for i, row in enumerate(problem.cells):
            for j, cell in enumerate(row):
                if (i, j) != conflict.cell and cell.mode != "ignore":
                    found = solve_palette(problem.with_cell((i, j), Cell.ignore()), explain=False)
                    after[i, j] = float(np.nan_to_num(found.delta_e_2000[conflict.cell]))
        helps = [each for each, error in after.items() if error < 0.5 * conflict.delta_e_2000]
        assert bool(conflict.relieved_by) or not helps
        for each in conflict.relieved_by[:1]:
            assert after[each] == pytest.approx(conflict.delta_e_without, abs=1.0)


def test_a_small_miss_of_an_exact_cell_names_the_cell_that_excludes_it() -> None:
    """The heavier of two exact cells of one material misses by less than ΔE 3; “no other cell is to blame” was said."""
    row = (Cell.fixed((0.45, 0.1, 0.1), exact=True), Cell.fixed((0.1, 0.3, 0.1), exact=True, weight=3.0))
    problem = palette_of((row,), ("A", "D65"))
    found = {conflict.cell: conflict for conflict in solve_palette(problem).conflicts}
    assert 0.05 < found[0, 1].delta_e_2000 < 3.0
    assert found[0, 1].relieved_by == ((0, 0),)
    assert "no other cell" not in found[0, 1].text
    after = solve_palette(problem.with_cell((0, 0), Cell.ignore()), explain=False)
    assert after.delta_e_2000[0, 1] == pytest.approx(found[0, 1].delta_e_without, abs=0.01)


def test_color_matrices_are_computed_once_for_all_solves_of_a_material(monkeypatch) -> None:
    """Each of up to 200 solves computed those of all lights again: half of the time of a table with 60 lights."""
    counted = []
    monkeypatch.setattr(releases, "initial_state", lambda problem: counted.append(1) or initial_state(problem))
    (conflict,) = solve_palette(chain(3)).conflicts
    assert len(conflict.relieved_by) == 3
    assert len(counted) == 1


def random_palette(rng) -> PaletteProblem:
    lamps = rng.choice(["D65", "HP1", "A", "FL11", "LED-B3", "FL2"], 3, replace=False)
    rows = []
    for i in range(3):
        row = []
        for j in range(3):
            how = {"exact": bool(rng.random() < 0.4), "weight": float(rng.choice([0.2, 1.0, 5.0]))}
            same = i > 0 and rng.random() < 0.3
            row.append(Cell.same_as((i - 1, j), **how) if same else Cell.fixed(rng.random(3) ** 2, **how))
        rows.append(tuple(row))
    return palette_of(tuple(rows), lamps)


@pytest.mark.parametrize("seed", range(12))
def test_a_named_release_helps_when_it_is_made(seed) -> None:
    problem = random_palette(np.random.default_rng([77, seed]))
    solution = solve_palette(problem)
    for conflict in solution.conflicts:
        if conflict.relieved_by:
            after = solve_palette(problem.with_cell(conflict.relieved_by[0], Cell.ignore()), explain=False)
            assert np.nan_to_num(after.delta_e_2000[conflict.cell]) < 0.9 * conflict.delta_e_2000


def test_a_released_part_has_the_weights_of_the_whole_palette() -> None:
    """The part was given weights relative to its own cells: “0.1” was said of an error that is 19.6 without the cell.

    The weight of the second cell is so small that the least weight of an exact cell counts, which other cells decide.
    """
    weights = ((0.3, 0.01, 5.0), (8.5, 6.4, 2.0))
    colors = (((0.6, 0.1, 0.1), (0.1, 0.5, 0.3), (0.2, 0.2, 0.5)), ((0.3, 0.3, 0.6), (0.5, 0.2, 0.1), (0.1, 0.4, 0.2)))
    rows = [
        tuple(Cell.fixed(color, exact=k == 0, weight=weight) for color, weight in zip(*row, strict=True))
        for k, row in enumerate(zip(colors, weights, strict=True))
    ]
    problem = palette_of(tuple(rows), ("D65", "FL2", "D50"))
    conflicts = [each for each in solve_palette(problem).conflicts if each.relieved_by]
    assert conflicts
    for each in conflicts:
        after = solve_palette(problem.with_cell(each.relieved_by[0], Cell.ignore()), explain=False)
        assert after.delta_e_2000[each.cell] == pytest.approx(each.delta_e_without, abs=0.1)


def test_a_conflict_within_one_material_does_not_change_the_compromise_of_others() -> None:
    """Exact rows that had become soft counted as soft cells: all others then had one and the same weight."""
    rows = (
        (Cell.fixed((0.6, 0.1, 0.1), exact=True, weight=0.3), Cell.ignore(), Cell.ignore()),
        (
            Cell.same_as((0, 0), exact=True, weight=3.0),
            Cell.fixed((0.1, 0.5, 0.1), exact=True, weight=3.0),
            Cell.fixed((0.3, 0.3, 0.2)),
        ),
        tuple(Cell.fixed(color) for color in ((0.6, 0.1, 0.1), (0.1, 0.6, 0.1), (0.1, 0.1, 0.6))),
    )
    alone = palette_of(rows, ("D65", "D50", "A"))
    beside = alone.with_cells({(2, j): replace(cell, exact=True) for j, cell in enumerate(rows[2])})
    found = [solve_palette(problem, explain=False) for problem in (alone, beside)]
    assert [each.status for each in found] == ["exact_conflict"] * 2
    np.testing.assert_allclose(found[1].delta_e_2000[:2], found[0].delta_e_2000[:2], atol=0.01)
    session = PaletteSession(alone)
    for j, cell in enumerate(rows[2]):
        session.edit((2, j), replace(cell, exact=True))
    np.testing.assert_allclose(session.solution().delta_e_2000[:2], found[1].delta_e_2000[:2], atol=0.01)


def test_a_long_list_of_cells_is_shortened() -> None:
    """A color that should be constant under sixty lights named all cells in a text of 2,300 characters."""
    lamps = illuminant_names()[:30]
    constant = tuple(Cell.constant((0, 0), exact=True) for _ in lamps[1:])
    solution = solve_palette(palette_of(((Cell.fixed((0.3, 0.3, 0.3), exact=True), *constant),), lamps))
    assert "more exclude it" in solution.conflicts[0].text
    assert max(len(each.text) for each in solution.conflicts) < 600


def test_a_measured_material_under_a_measured_light_is_said_to_be_measured() -> None:
    problem = palette_of(((Cell.fixed((0.1, 0.3, 0.9)),), (Cell.fixed((0.2, 0.2, 0.2)),)), ("A",))
    surfaces = (PaletteReflectance("skin", reflectance("dark skin")), problem.reflectances[1])
    (conflict,) = solve_palette(
        PaletteProblem(problem.grid, lights=problem.lights, reflectances=surfaces, cells=problem.cells)
    ).conflicts
    assert "its material and its light are measured" in conflict.text


def test_exact_cells_of_the_least_weights_are_explained() -> None:
    """The square of their unit is 0, and the solver of releases called itself without end."""
    tiny = 5e-324
    cells = (
        (Cell.fixed([0.4, 0.4, 0.5], weight=0.3, exact=True), Cell.fixed([0.1, 0.3, -1e5], weight=tiny, exact=True)),
        (Cell.ignore(), Cell.fixed([0.3, 0.4, 0.5], weight=0.06, exact=True)),
        (Cell.fixed([5, -0.5, 0], weight=tiny, exact=True), Cell.fixed([5, -0.5, 0], weight=500.0)),
        (Cell.fixed([8, -0.8, 0], weight=600.0), Cell.fixed([0.1, 0.4, 0.1], weight=tiny, exact=True)),
    )
    solution = solve_palette(replace(palette_of(cells, ("D65", "HP1")), grid=design_grid(20)))
    assert solution.status == "exact_conflict"
    assert solution.conflicts
