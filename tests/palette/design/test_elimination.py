# SPDX-License-Identifier: GPL-3.0-or-later
"""An eliminated spectrum solves its equations, for any sequence of changes of its active bounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.palette.qp.answer import Answer, Check, is_sharp
from spectral_core.palette.qp.arrow import symmetric_solve
from spectral_core.palette.qp.block import Block
from spectral_core.palette.qp.elimination import Elimination
from spectral_core.palette.qp.squares import squared

SIZE, CELLS = 17, 4


def some_block(rng, colors, exact):
    rows = rng.normal(size=(3 * CELLS, SIZE))
    weights = rng.uniform(0.5, 2.0, 3 * CELLS)
    weights[:exact] = np.inf
    roughness = 0.3 * np.diff(np.eye(SIZE), 2, axis=0) + 0.0
    gram = roughness.T @ roughness + 0.05 * np.eye(SIZE)
    ties = rng.normal(size=(3 * CELLS, colors))
    return Block(rows, rng.normal(size=3 * CELLS), ties, weights, roughness, gram, np.zeros(SIZE), np.ones(SIZE))


def by_equations(block, free, x, colors):
    """Values, gradients, multipliers and pulls on the colors from one dense system; exact rows are equalities."""
    exact = np.isinf(block.weights)
    weights = np.where(exact, 1.0, block.weights)
    hessian = (block.rows.T * weights) @ block.rows + block.gram
    border = block.rows[exact]
    right = block.targets + block.ties @ colors
    count = len(border)
    held = np.where(free, 0.0, x)
    system = np.block([[hessian[free][:, free], border[:, free].T], [border[:, free], np.zeros((count, count))]])
    pushed = (block.rows.T * weights) @ right - hessian @ held
    solved = np.linalg.solve(system, np.concatenate([pushed[free], right[exact] - border @ held]))
    value = held.copy()
    value[free] = solved[: free.sum()]
    multiplier = solved[free.sum() :]
    left = block.rows @ value - right
    gradient = block.rows.T @ (weights * left) + block.gram @ value + border.T @ multiplier
    pull = block.ties.T @ (weights * (block.rows @ value)) + block.ties[exact].T @ multiplier
    return value, gradient, multiplier, pull


@pytest.mark.parametrize(("colors", "exact"), [(0, 0), (3, 0), (3, 2), (6, 4)])
def test_any_sequence_of_bounds_and_targets_gives_the_solution_of_the_equations(rng, colors, exact):
    block = some_block(rng, colors, exact)
    spectrum = squared(block, 1.0, np.inf)
    free, x = rng.random(SIZE) < 0.7, rng.integers(0, 2, SIZE).astype(float)
    found = Elimination(spectrum, free, x)
    exchanged = 0
    for step in range(60):
        if step % 3 == 0:  # one sample, as in a step of the walk
            k = int(rng.integers(SIZE))
            bound = float(rng.integers(2)) if free[k] else x[k]
            free, x = free.copy(), x.copy()
            free[k], x[k] = not free[k], bound
            assert found.exchange(k, bound)
        else:  # new targets, new bounds
            if step % 3 == 1:
                block = block.with_targets(rng.normal(size=3 * CELLS))
                fresh = squared(block, 1.0, np.inf)
                spectrum = replace(
                    spectrum,
                    linear=fresh.linear,
                    border_target=fresh.border_target,
                    color_linear=fresh.color_linear,
                )
            free, x = free.copy(), x.copy()
            for k in rng.integers(0, SIZE, 2):
                free[k], x[k] = rng.random() < 0.7, float(rng.integers(2))
            found.follow(spectrum, free, x)
        exchanged = max(exchanged, found.exchanges)
        shown = rng.uniform(size=colors)
        value, gradient, multiplier, pull = by_equations(block, free, x, shown)
        got = found.map @ np.concatenate([[1.0], shown])
        np.testing.assert_allclose(got[:SIZE], np.where(free, value, gradient), rtol=1e-7, atol=1e-7)
        np.testing.assert_allclose(got[SIZE : SIZE + exact], multiplier, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(got[SIZE + exact :], pull, rtol=1e-6, atol=1e-6)
    assert exchanged > 5  # otherwise every step would be a new factorization, and the test would be void


def test_an_update_that_would_lose_digits_is_refused(rng):
    """A sample with the same column as a free sample adds no curvature."""
    block = some_block(rng, 3, 0)
    rows = block.rows.copy()
    rows[:, 1] = rows[:, 0]
    block = replace(block, rows=rows, gram=1e-16 * np.eye(SIZE), roughness=np.zeros((0, SIZE)))
    free = np.zeros(SIZE, dtype=bool)
    free[:3] = True
    free[1] = False
    found = Elimination(squared(block, 1.0, np.inf), free, np.zeros(SIZE))
    assert not found.exchange(1, 0.0)
    assert found.exchange(5, 0.0)


def test_an_answer_with_a_residual_above_1e_8_is_refined():
    """The check accepts 1e-6. Answers with residuals between are refined first, so that equal answers look equal."""
    for residual, sharp in ((0.9e-8, True), (1.1e-8, False), (np.inf, False)):
        answer = Answer((), np.zeros((0, 3)), (), Check(residual, 0.0, 0.0), ())
        assert is_sharp(answer) is sharp
    broken = Answer((), np.zeros((0, 3)), (), Check(0.0, 0.0, 1e-6), ())  # an exact row is violated
    assert not is_sharp(broken)


def test_a_light_without_visible_power_does_not_set_the_scale_of_the_check(rng):
    """Rows with a coefficient sum below the visible limit, 1e-7, count as rows of no light."""
    block = some_block(rng, 0, 0)
    seen = replace(block, keys=tuple((0, (0, j)) for j in range(CELLS)))
    for total, counts in ((0.8e-7, False), (1.3e-7, True)):
        rows = seen.rows.copy()
        rows[:3] = total / SIZE
        found = replace(seen, rows=rows, weights=np.ones(3 * CELLS))
        assert (found.scale < 1e-7) is counts


def test_a_system_without_numbers_prints_nothing_on_the_terminal(capfd: pytest.CaptureFixture[str]) -> None:
    """LAPACK prints of itself that an argument had an illegal value; the engine tries another method instead."""
    with pytest.raises(np.linalg.LinAlgError, match="beyond all numbers"):
        symmetric_solve(np.array([[-1.0, np.nan], [np.nan, 1.0]]), np.ones(2))
    assert capfd.readouterr() == ("", "")
