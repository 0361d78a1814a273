# SPDX-License-Identifier: GPL-3.0-or-later
"""Newton's method in the free colors ends at the answer of a cold solve; so does the walk that takes over from it."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.palette.cases.exact_cells import dragged
from benchmarks.palette.palette_speed import coupled_palette, next_edit
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import initial_state
from spectral_core.palette.live.session import PaletteSession
from spectral_core.palette.presets import metamer_pair
from spectral_core.palette.problem import Cell, PaletteProblem
from spectral_core.palette.qp import color_newton
from spectral_core.palette.qp.active_set import ActiveSet
from spectral_core.palette.qp.backends import KeptSpectrum
from spectral_core.palette.qp.block import Block
from spectral_core.palette.qp.color_newton import NEWTON_STEPS
from spectral_core.palette.qp.engine import solve
from spectral_core.palette.qp.quadratic import Quadratic
from spectral_core.palette.qp.squares import Spectrum, retargeted, squared

MANY = (10, 4, 31)


def side_of(problem: PaletteProblem) -> Quadratic:
    return Assembler(problem, compiled_requests(problem)).assembled("reflectances", initial_state(problem)).quadratic


def objectives(
    session: PaletteSession, kind: str, rng: np.random.Generator, edits: int
) -> tuple[list[float], list[int]]:
    """Relative difference of the objective to that of a cold solve, and the engine's steps, of each soft answer."""
    found, steps = [], []
    for number in range(edits):
        answer = session.edit(*next_edit(session, kind, number, rng))
        quadratic = side_of(session.problem)
        cold = solve(quadratic)
        assert answer.kkt_residual < 1e-6
        assert answer.trusted == (not cold.infeasible)
        steps.append(session._rounds.engines["reflectances"].steps)
        if cold.infeasible:
            continue
        values = [each for each in answer.state.reflectances if each is not None]
        mine = quadratic.objective(quadratic.joined(quadratic.best_colors(values), values))
        other = quadratic.objective(quadratic.joined(cold.colors, cold.values))
        found.append(mine / other - 1)
    return found, steps


@pytest.mark.parametrize("kind", ["drags", "weights", "mixed"])
def test_edits_of_many_spectra_equal_a_cold_solve_after_a_few_steps(rng, kind):
    differences, steps = objectives(PaletteSession(coupled_palette(MANY, rng)), kind, rng, 24)
    assert differences
    assert max(map(abs, differences)) < 1e-7
    # The walk continues in few edits, if in any.
    assert np.mean(np.array(steps) <= NEWTON_STEPS) > 0.9


def test_after_a_step_that_is_too_long_the_walk_finds_the_answer(rng, monkeypatch):
    monkeypatch.setattr(color_newton, "OVERSHOT", -np.inf)
    differences, steps = objectives(PaletteSession(coupled_palette(MANY, rng)), "mixed", rng, 24)
    assert max(map(abs, differences)) < 1e-7
    assert max(steps) > NEWTON_STEPS


def test_a_color_at_the_border_of_its_box_equals_that_of_a_cold_solve(rng):
    """The common color is pushed to the border of a narrow box and away from it again."""
    problem = coupled_palette(MANY, rng)
    narrow = Cell.free(([0.3, 0.3, 0.3], [0.5, 0.5, 0.5]), weight=4.0)
    session = PaletteSession(problem.with_cell((0, 0), narrow))
    held = set()
    for level in (0.05, 0.9, 0.4, 0.95, 0.1, 0.45):
        for row in range(10):
            answer = session.edit((row, 1), Cell.fixed(np.full(3, level), weight=10.0))
        quadratic = side_of(session.problem)
        cold = solve(quadratic)
        values = [each for each in answer.state.reflectances if each is not None]
        colors = quadratic.best_colors(values)
        mine = quadratic.objective(quadratic.joined(colors, values))
        assert mine == pytest.approx(quadratic.objective(quadratic.joined(cold.colors, cold.values)), rel=1e-7)
        held |= {0.3, 0.5} & set(np.round(colors.ravel(), 9).tolist())
    assert held == {0.3, 0.5}


# -- one spectrum in daqp's workspace ----------------------------------------------------------------------------------


def spectrum_of(rng: np.random.Generator, exact: int) -> tuple[Block, Spectrum]:
    size, rows = 23, 9
    weights = rng.uniform(0.5, 2.0, rows)
    weights[:exact] = np.inf
    gram = 0.05 * np.eye(size)
    matrix = rng.uniform(0.0, 1.0, (rows, size))
    targets = matrix @ rng.uniform(0.2, 0.8, size)
    block = Block(
        matrix, targets, rng.normal(size=(rows, 3)), weights, np.zeros((0, size)), gram, np.zeros(size), np.ones(size)
    )
    return block, squared(block, 1.0, np.inf)


@pytest.mark.parametrize("exact", [0, 2])
def test_a_kept_spectrum_is_optimal_at_every_color_and_target(rng, exact):
    block, spectrum = spectrum_of(rng, exact)
    kept = KeptSpectrum(spectrum, block.lower, block.upper)
    for step in range(20):
        colors = rng.normal(scale=0.05, size=3)
        if step % 3 == 2:
            targets = block.targets + rng.normal(scale=0.02, size=block.targets.size)
            spectrum = squared(block.with_targets(targets), 1.0, np.inf)
            fresh = KeptSpectrum(spectrum, block.lower, block.upper)
            assert not kept.fits(spectrum)
            kept = fresh
        found = kept.at(spectrum, colors)
        assert found is not None
        x, free = found
        gradient = spectrum.hessian @ x + spectrum.linear - colors @ spectrum.ties
        right = spectrum.border_target + spectrum.border_ties @ colors
        assert np.abs(spectrum.border @ x - right).max(initial=0.0) < 1e-9
        if exact:
            # Multipliers of the exact rows that explain the gradient of the free samples.
            multipliers = np.linalg.lstsq(spectrum.border[:, free].T, -gradient[free], rcond=None)[0]
            gradient = gradient + multipliers @ spectrum.border
        assert np.abs(gradient[free]).max(initial=0.0) < 1e-8
        assert (gradient[~free & (x == block.lower)] > -1e-8).all()
        assert (gradient[~free & (x == block.upper)] < 1e-8).all()
        assert ((x == block.lower) | (x == block.upper))[~free].all()


def test_a_kept_spectrum_follows_other_targets_without_a_new_workspace(rng):
    block, spectrum = spectrum_of(rng, 1)
    kept = KeptSpectrum(spectrum, block.lower, block.upper)
    for _ in range(10):
        block = block.with_targets(block.targets + rng.normal(scale=0.01, size=block.targets.size))
        spectrum = retargeted(spectrum, block)
        assert kept.fits(spectrum)
        found = kept.at(spectrum, np.zeros(3))
        fresh = KeptSpectrum(spectrum, block.lower, block.upper).at(spectrum, np.zeros(3))
        assert found is not None and fresh is not None
        np.testing.assert_allclose(found[0], fresh[0], atol=1e-9)
        assert (found[1] == fresh[1]).all()


def test_exact_rows_that_cannot_hold_give_no_answer_and_later_ones_do(rng):
    block, spectrum = spectrum_of(rng, 2)
    kept = KeptSpectrum(spectrum, block.lower, block.upper)
    assert kept.at(spectrum, np.zeros(3)) is not None
    impossible = retargeted(spectrum, block.with_targets(block.targets + 100.0))
    assert kept.at(impossible, np.zeros(3)) is None
    assert kept.at(spectrum, np.zeros(3)) is not None


def test_jumps_beside_exact_cells_cost_few_breakpoints(monkeypatch):
    """Where a walk does not arrive, the exact rows may conflict or not; neither way is walked to its end."""
    exchanges = [0]
    exchange = ActiveSet._exchange

    def counted(active, number):
        exchanges[0] += 1
        exchange(active, number)

    monkeypatch.setattr(ActiveSet, "_exchange", counted)
    rng = np.random.default_rng(7)
    session = PaletteSession(metamer_pair())
    most = arrived = 0
    for _ in range(120):
        exchanges[0] = 0
        session.edit((0, 0), Cell.fixed(rng.uniform(0.03, 0.6, 3)))
        most = max(most, exchanges[0])
        arrived += session.solution().status.trusted
    assert 100 <= most <= 260
    assert arrived == 120


def test_walks_beside_dependent_exact_rows_do_not_cycle(monkeypatch):
    """Where held bounds leave exact rows no freedom, an unknown went in and out at one point until the walk's limit."""
    runs, last, exchange = [0], [-1], ActiveSet._exchange

    def counted(active, number):
        runs[-1] = runs[-1] + 1 if number == last[0] else 1
        runs.append(runs[-1])
        last[0] = number
        exchange(active, number)

    monkeypatch.setattr(ActiveSet, "_exchange", counted)
    found = dragged(77, 14, 6)
    assert max(runs) <= 20
    assert sum(found["statuses"].values()) == 84
