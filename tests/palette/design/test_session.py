# SPDX-License-Identifier: GPL-3.0-or-later
"""A live session gives the solution of a new solve after every edit, or reports that it cannot."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.palette.palette_speed import coupled_palette
from spectral_core.errors import InvalidInputError
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.live.session import PaletteSession
from spectral_core.palette.presets import design_grid, hidden_mark, metamer_pair, most_distinct, split_light
from spectral_core.palette.qp.backends import by_piqp
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import Illuminant


def random_cell(rng: np.random.Generator, cell: tuple[int, int]) -> Cell:
    """Any soft cell."""
    kind = int(rng.integers(6))
    weight = float(rng.choice([0.1, 1.0, 3.0]))
    if kind == 0:
        return Cell.ignore()
    if kind == 1:
        return Cell.black(weight=weight)
    if kind == 2 and cell[0]:
        return Cell.same_as((cell[0] - 1, cell[1]), weight=weight)
    if kind == 3:
        return Cell.constant((cell[0], (cell[1] + 1) % 3), weight=weight)
    return Cell.fixed(rng.uniform(0, 1, 3), weight=weight)


def anchored(problem: PaletteProblem) -> np.ndarray:
    """Cells (R, L) whose color is determined by a target of the cell or its group; others are nearly free."""
    requests = compiled_requests(problem)
    pinned = np.zeros((len(problem.reflectances), len(problem.lights)), dtype=bool)
    for target in requests.targets:
        pinned[target.cell] = True
    for group in requests.groups:
        if any(pinned[member] for member in group.members):
            pinned[tuple(np.transpose(group.members))] = True
    return pinned


def test_every_edit_equals_a_new_solve(rng):
    session = PaletteSession(coupled_palette((4, 3, 31), rng))
    for _ in range(40):
        cell = (int(rng.integers(4)), int(rng.integers(3)))
        answer = session.edit(cell, random_cell(rng, cell))
        fresh = solve_palette(session.problem, explain=False)
        assert answer.trusted
        assert answer.kkt_residual < 1e-6
        wanted = anchored(session.problem)
        np.testing.assert_allclose(
            answer.actual_linear_rgb[wanted],
            fresh.actual_linear_rgb[wanted],
            atol=2e-6,
            err_msg=str(session.problem.cells),
        )
        np.testing.assert_allclose(session.solution(quick=True).actual_linear_rgb, answer.actual_linear_rgb, atol=1e-12)


def test_rounds_converge_if_lights_are_designed_too():
    session = PaletteSession(split_light())
    color = np.array([0.1, 0.5, 0.3])
    answer = session.edit((3, 2), Cell.fixed(color))
    assert answer.trusted
    before = np.nanmean(answer.delta_e_2000)
    after = np.nanmean(session.refine(30).delta_e_2000)
    assert after < before
    assert after < 0.05
    assert session.solution().status in ("solved", "still_improving")
    settled = solve_palette(session.problem, warm=session.solution(), explain=False, seconds=20)
    assert settled.status == "solved"


def test_exact_cells_hold_through_edits_and_agree_with_the_general_engines(rng):
    session = PaletteSession(coupled_palette((3, 3, 31), rng))
    session.edit_cells({(i, 0): Cell.same_as((0, 0), exact=True) for i in (1, 2)})
    for step in range(12):
        cell = (int(rng.integers(3)), int(rng.integers(1, 3)))
        answer = session.edit(cell, Cell.fixed(rng.uniform(0.2, 0.6, 3), exact=step % 4 == 3))
        assembler = Assembler(session.problem, compiled_requests(session.problem))
        assembled = assembler.assembled("reflectances", session.state).quadratic
        if answer.trusted:
            x = by_piqp(assembled).x
            # Compares sums of squares, not colors: if all targets are met, only smoothness determines the common color.
            found = session.state.reflectances
            ours = assembled.objective(assembled.joined(assembled.best_colors(found), found))
            assert ours <= assembled.objective(x) * (1 + 1e-5) + 1e-12
            assert np.abs(answer.actual_linear_rgb[:, 0] - answer.actual_linear_rgb[0, 0]).max() < 1e-9
        session.edit(cell, Cell.fixed(rng.uniform(0.2, 0.6, 3)))


def test_a_color_that_jumps_anywhere_is_answered_without_the_slow_methods():
    """Where the walk does not arrive, piqp answers or shows that exact rows conflict."""
    session, rng = PaletteSession(metamer_pair()), np.random.default_rng(7)
    engines: Counter[str] = Counter()
    for color in rng.uniform(0.1, 0.9, (60, 3)):
        answer = session.edit((0, 0), Cell.fixed(color))
        assert answer.trusted
        engines.update(answer.engines)
    assert set(engines) == {"active set", "piqp"}


def test_exact_cells_that_cannot_hold_are_reported():
    session = PaletteSession(hidden_mark())
    answer = session.edit((0, 1), Cell.fixed((0.0, 0.9, 0.9), exact=True))
    assert np.nanmax(answer.delta_e_2000) > 3
    assert session.solution().status == "exact_conflict"
    back = session.edit((0, 1), hidden_mark().cells[0][1])
    assert back.trusted
    assert session.solution().status == "solved"


def test_settings_and_lights_can_be_edited(rng):
    session = PaletteSession(coupled_palette((3, 2, 31), rng))
    session.change(smoothness=1.0)
    fresh = solve_palette(session.problem, explain=False)
    np.testing.assert_allclose(session.solution().actual_linear_rgb, fresh.actual_linear_rgb, atol=2e-6)
    freed = tuple(PaletteLight(light.spectrum, free=k > 0) for k, light in enumerate(session.problem.lights))
    assert session.change(lights=freed).trusted


def test_targets_and_errors_are_those_of_the_solution(rng):
    session = PaletteSession(coupled_palette((3, 3, 31), rng))
    answer = session.edit((1, 1), Cell.fixed((0.5, 0.5, 0.5), weight=2.0))
    solution = session.solution(quick=True)
    np.testing.assert_allclose(answer.delta_e_2000, solution.delta_e_2000, atol=1e-9)
    np.testing.assert_allclose(answer.target_linear_rgb, solution.target_linear_rgb, atol=1e-12)


def test_a_given_reflectance_is_unchanged(rng):
    problem = coupled_palette((3, 3, 31), rng)
    designed = solve_palette(problem, explain=False).reflectances[0]
    rows = (PaletteReflectance("given", designed), *problem.reflectances[1:])
    session = PaletteSession(replace(problem, reflectances=rows))
    answer = session.edit((1, 1), Cell.fixed((0.5, 0.4, 0.3)))
    fresh = solve_palette(session.problem, explain=False)
    np.testing.assert_allclose(answer.actual_linear_rgb, fresh.actual_linear_rgb, atol=2e-6)
    assert session.solution().reflectances[0] is designed


def test_an_edit_outside_the_table_is_refused():
    session = PaletteSession(hidden_mark())
    with pytest.raises(InvalidInputError, match="outside the table of 2×2"):
        session.edit((0, 7), Cell.ignore())


def test_distinct_cells_stay_distinct_while_others_are_edited():
    session = PaletteSession(most_distinct(3, color=(0.25, 0.25, 0.25)))
    answer = session.edit((0, 0), Cell.fixed((0.27, 0.25, 0.25), exact=True))
    assert answer.trusted
    assert session.solution().residuals["least_delta_e_2000"] > 20


def test_lights_follow_the_other_cells_beside_distinct_ones():
    """They stayed those of the session's first solve, in its unit, and edited cells missed by ΔE 15 and more."""
    grid, unit = design_grid(20), 1e5
    given = [PaletteLight(normalized(illuminant(name), luminance=2.0 * unit)) for name in ("D65", "HP1")]
    start = Illuminant("own", grid, np.full(grid.size, 0.01 * unit))
    rows = (
        (Cell.fixed(unit * np.array([0.3, 0.28, 0.25]), exact=True), Cell.ignore(), Cell.fixed([0.5, 0.2, 0.1])),
        (Cell.same_as((0, 0), exact=True), Cell.ignore(), Cell.fixed([0.1, 0.4, 0.2])),
    )
    session = PaletteSession(
        PaletteProblem(
            grid, (*given, PaletteLight(start, free=True)), (PaletteReflectance("one"), PaletteReflectance("two")),
            tuple((*row[:2], Cell.fixed(unit * row[2].target)) for row in rows), smoothness=0.1,
        )
    )  # fmt: skip
    session.edit((0, 2), Cell.fixed(unit * np.array([0.6, 0.1, 0.5])))
    session.edit((1, 1), Cell.distinct_from((0, 1)))
    assert session.solution().status == "solved"
    answer = session.edit((0, 2), Cell.fixed(unit * np.array([0.1, 0.2, 0.9])))
    assert np.nanmax(answer.delta_e_2000) < 3
    assert session.solution().residuals["least_delta_e_2000"] > 5


def test_no_edit_takes_many_steps(rng):
    """Colors, weights to 1000 and exact cells: daqp finds the bounds of each spectrum, Newton's method the colors."""
    from benchmarks.palette.palette_speed import coupled_palette, next_edit

    session = PaletteSession(coupled_palette((8, 8, 31), rng))
    steps = []
    for number in range(64):
        session.edit(*next_edit(session, "mixed", number, rng))
        steps.append(session._rounds.engines["reflectances"].steps)
    assert max(steps) < 150
    assert np.median(steps) <= 3


def test_edits_within_conflicts_equal_a_new_solve(rng):
    """Exact cells that conflict, while other colors and weights of the same and other spectra are dragged."""
    session = PaletteSession(coupled_palette((3, 3, 31), rng))
    session.edit((0, 1), Cell.fixed((9.0, 9.0, 9.0), exact=True))
    cells = [(i, j) for i in range(3) for j in (1, 2) if (i, j) != (0, 1)]
    for step in range(14):
        weight = float(10 ** rng.uniform(-1, 2)) if step % 2 else 1.0
        cell = Cell.fixed(rng.uniform(0.1, 0.7, 3), weight=weight, exact=step % 5 == 4)
        answer = session.edit(cells[int(rng.integers(5))], cell)
        fresh = solve_palette(session.problem, explain=False)
        assert fresh.status == "exact_conflict"
        assert not answer.trusted
        assert answer.kkt_residual < 1e-6
        np.testing.assert_allclose(answer.actual_linear_rgb[:, 1:], fresh.actual_linear_rgb[:, 1:], atol=1e-5)


def test_edits_with_weights_far_from_1_equal_a_new_solve(rng):
    """Weights count relative to their median, in an edit as in a new solve."""
    problem = coupled_palette((3, 3, 31), rng)
    cells = {(i, j): Cell.fixed(rng.uniform(0.1, 0.9, 3), weight=5.0) for i in range(3) for j in (1, 2)}
    problem = problem.with_cells({**cells, (0, 0): Cell.free(weight=5.0)})
    session = PaletteSession(problem.with_cells({(i, 0): Cell.same_as((0, 0), weight=5.0) for i in (1, 2)}))
    # The bright colors conflict, so that weights matter.
    for index, weight in (((0, 1), 5.0), ((1, 2), 40.0), ((2, 1), 2.0)):
        answer = session.edit(index, Cell.fixed((3.0, 2.5, 0.2), weight=weight))
        fresh = solve_palette(session.problem, explain=False)
        assert answer.trusted
        np.testing.assert_allclose(answer.actual_linear_rgb, fresh.actual_linear_rgb, atol=2e-6)


@pytest.mark.parametrize("rounds", [0, -1, 2.5, float("nan")])
def test_a_number_of_rounds_that_cannot_be_made_is_refused(rounds: float) -> None:
    with pytest.raises(InvalidInputError, match="rounds of refine"):
        PaletteSession(metamer_pair()).refine(rounds)  # type: ignore[arg-type]


@pytest.mark.parametrize("weight", [30.0, 1000.0])
def test_the_spectra_of_heavy_cells_are_those_of_a_new_solve(weight: float) -> None:
    """Squared weights left the engine no digits for the smoothness: spectra off by 0.49 were called solved."""
    lights = tuple(PaletteLight(normalized(illuminant(name))) for name in ("D65", "LPS"))
    row = (Cell.fixed((0.3, 0.2, 0.1), weight=weight), Cell.ignore())
    session = PaletteSession(PaletteProblem(design_grid(), lights, (PaletteReflectance("a"),), (row,)))
    for color in ((0.25, 0.24, 0.2), (0.1, 0.3, 0.2), (0.4, 0.2, 0.02)):
        session.edit((0, 0), Cell.fixed(color, weight=weight))
        quick, whole, fresh = session.solution(quick=True), session.solution(), solve_palette(session.problem)
        assert quick.status == whole.status == fresh.status == "solved"
        np.testing.assert_allclose(quick.actual_linear_rgb[0, 0], fresh.actual_linear_rgb[0, 0], atol=1e-6)
        np.testing.assert_allclose(whole.reflectances[0].values, fresh.reflectances[0].values, atol=1e-9)
