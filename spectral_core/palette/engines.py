# SPDX-License-Identifier: GPL-3.0-or-later
"""The solvers behind a palette. None is believed: ``solve_checked`` tries them in order until an answer passes.

``daqp`` (dual active set, normal equations): fastest for one spectrum, wrong without saying so where rows differ by
more than about 1e4 in weight. ``piqp`` in least-squares form (interior point): the general engine, does not square the
condition number. ``bvls`` (scipy, active set): needs no package of its own; no equalities. Figures in docs/palette.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from spectral_core.errors import InvalidInputError, SolveError
from spectral_core.palette.least_squares import RIDGE, Check, LinkedLeastSquares, checked

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """What an engine returned, and how it checked. ``infeasible``: it claims that the equalities cannot hold."""

    x: Array
    engine: str
    check: Check
    infeasible: bool = False
    rejected: tuple[str, ...] = ()
    """Engines that were tried before and failed the check."""


RawAnswer = tuple[Array, Array | None, bool]
"""x, multipliers of the equalities or None, whether the engine claims infeasibility."""


def dense_rows(problem: LinkedLeastSquares) -> tuple[Array, Array]:
    """Weighted rows as one dense matrix, and their targets."""
    if len(problem.blocks) == 1 and not problem.links and problem.color_lower.size == 0:
        return problem.blocks[0].matrix, problem.blocks[0].target
    matrix, target = problem.rows
    return matrix.toarray(), target


def dense_equalities(problem: LinkedLeastSquares) -> tuple[Array, Array]:
    """Equality rows as one dense matrix, and their targets."""
    if not problem.has_equalities:
        return np.zeros((0, problem.size)), np.zeros(0)
    matrix, target = problem.equalities
    return np.ascontiguousarray(matrix.toarray()), target


def solve_daqp(problem: LinkedLeastSquares, start: Array | None = None) -> RawAnswer:
    """Dense dual active set on the normal equations."""
    import daqp

    dense, target = dense_rows(problem)
    hessian = dense.T @ dense
    hessian[np.diag_indices_from(hessian)] += RIDGE * max(np.trace(hessian) / problem.size, 1e-12)
    rows, equality_target = dense_equalities(problem)
    count = rows.shape[0]
    upper = np.concatenate([problem.upper, equality_target])
    lower = np.concatenate([problem.lower, equality_target])
    sense = np.concatenate([np.zeros(problem.size), np.full(count, 5)]).astype(np.int32)
    bounds = np.clip(upper, -1e30, 1e30), np.clip(lower, -1e30, 1e30)
    x, _, flag, info = daqp.solve(
        hessian,
        -(dense.T @ target),
        rows,
        bounds[0],
        bounds[1],
        sense,
        primal_tol=1e-9,
        iter_limit=20 * problem.size + 1000,
    )
    multipliers = np.asarray(info["lam"])[problem.size :] if count and "lam" in info else None
    return np.asarray(x), multipliers, flag == -1


def solve_piqp(problem: LinkedLeastSquares, start: Array | None = None) -> RawAnswer:
    """Sparse interior point in least-squares form: unknowns x and the residual r = Mx − y."""
    import piqp

    matrix, target = problem.rows
    equality, equality_target = problem.equalities
    count, n = matrix.shape
    solver = piqp.SparseSolver()
    solver.settings.eps_abs, solver.settings.eps_rel = 1e-11, 1e-11
    solver.settings.eps_duality_gap_abs, solver.settings.eps_duality_gap_rel = 1e-12, 1e-12
    solver.settings.max_iter = 200
    squares = sparse.diags(np.concatenate([np.zeros(n), np.ones(count)]), format="csc")
    left = sparse.bmat([[matrix, -sparse.identity(count)], [equality, None]], format="csc")
    lower = np.concatenate([problem.lower, np.full(count, -np.inf)])
    upper = np.concatenate([problem.upper, np.full(count, np.inf)])
    right = np.concatenate([target, equality_target])
    solver.setup(squares, np.zeros(n + count), left, right, x_l=lower, x_u=upper)
    status = solver.solve()
    x, duals = np.array(solver.result.x[:n]), np.array(solver.result.y[count:])
    return x, duals, status == piqp.PIQP_PRIMAL_INFEASIBLE


def solve_tied(problem: LinkedLeastSquares, start: Array | None = None) -> RawAnswer:
    """Newton on the free colors, daqp on each spectrum (module ``tied``); what ``can_tie`` says."""
    from spectral_core.palette.tied import TiedSolver, tied_from_links

    quadratics = tied_from_links(problem)
    everything = np.arange(len(problem.blocks))
    values, colors = TiedSolver(*quadratics.linear.shape).solve(quadratics, everything, everything)
    return np.concatenate([colors, values.ravel()]), None, False


def solve_bvls(problem: LinkedLeastSquares, start: Array | None = None) -> RawAnswer:
    """scipy's bounded-variable least squares; refuses equalities."""
    from scipy.optimize import lsq_linear

    dense, target = dense_rows(problem)
    if problem.has_equalities:
        raise InvalidInputError("the engine bvls knows no equalities; use piqp for exact cells")
    ridge = np.sqrt(RIDGE * max(float(np.sum(dense**2)) / problem.size, 1e-12))
    result = lsq_linear(
        np.vstack([dense, ridge * np.eye(problem.size)]),
        np.concatenate([target, np.zeros(problem.size)]),
        (problem.lower, problem.upper),
        method="bvls",
        tol=1e-14,
        max_iter=20 * problem.size,
    )
    return result.x, None, False


ENGINES: dict[str, Callable[[LinkedLeastSquares, Array | None], RawAnswer]] = {
    "tied": solve_tied,
    "daqp": solve_daqp,
    "piqp": solve_piqp,
    "bvls": solve_bvls,
}


def polished(problem: LinkedLeastSquares, x: Array, rounds: int = 20) -> Array:
    """The exact minimum on the face of the bounds that ``x`` lies near; a few faces are tried."""
    (dense, target), (rows, equality_target) = dense_rows(problem), dense_equalities(problem)
    at_lower, at_upper = x <= problem.lower + 1e-7, x >= problem.upper - 1e-7
    best = np.clip(x, problem.lower, problem.upper)
    best_check = checked(problem, best)
    for _ in range(rounds):
        trial = np.where(at_lower, problem.lower, np.where(at_upper, problem.upper, 0.0))
        free = ~(at_lower | at_upper)
        gap, gap_exact = target - dense @ trial, equality_target - rows @ trial
        trial[free] = _equality_least_squares(dense[:, free], gap, rows[:, free], gap_exact)
        inside = np.clip(trial, problem.lower, problem.upper)
        check = checked(problem, inside)
        if check.worst < best_check.worst:
            best, best_check = inside, check
        gradient = problem.gradient(inside)
        low, high = trial < problem.lower, trial > problem.upper
        if not (low | high).any():
            released = (at_lower & (gradient < 0)) | (at_upper & (gradient > 0))
            if best_check.passed or not released.any():
                break
            at_lower, at_upper = at_lower & ~released, at_upper & ~released
        at_lower, at_upper = at_lower | low, at_upper | high
    return best


def _equality_least_squares(matrix: Array, target: Array, rows: Array, rows_target: Array) -> Array:
    """Minimum of ||matrix x − target|| where rows x = rows_target, by the null space of the rows."""
    if rows.shape[0] == 0 or rows.shape[1] == 0:
        return np.linalg.lstsq(matrix, target, rcond=1e-12)[0]
    left, sizes, right = np.linalg.svd(rows)
    rank = int((sizes > 1e-11 * max(sizes.max(initial=0.0), 1e-300)).sum())
    particular = right[:rank].T @ ((left[:, :rank].T @ rows_target) / sizes[:rank])
    null = right[rank:].T
    return particular + null @ np.linalg.lstsq(matrix @ null, target - matrix @ particular, rcond=1e-12)[0]


def solve_checked(
    problem: LinkedLeastSquares, order: Sequence[str], start: Array | None = None, *, polish_below: int = 600
) -> Answer:
    """The first answer, in the given order of engines, that passes its check; else the best of those that do not."""
    best: Answer | None = None
    rejected: list[str] = []
    for name in order:
        if name == "bvls" and problem.has_equalities:
            continue
        answer = _attempt(problem, name, start, polish=problem.size <= polish_below)
        if best is None or answer.check.worst < best.check.worst:
            best = answer
        if answer.check.passed:
            break
        rejected.append(name)
        if answer.infeasible and name == "piqp":
            break
    assert best is not None
    missed = tuple(name for name in rejected if name != best.engine)
    return Answer(
        best.x, best.engine, best.check, best.infeasible or (not best.check.passed and "piqp" in rejected), missed
    )


def _attempt(problem: LinkedLeastSquares, name: str, start: Array | None, *, polish: bool) -> Answer:
    try:
        x, multipliers, infeasible = ENGINES[name](problem, start)
    except (
        np.linalg.LinAlgError,
        RuntimeError,
        ValueError,
        ImportError,
        SolveError,
    ):  # an engine's own failure: try the next one
        x, multipliers, infeasible = np.full(problem.size, np.nan), None, False
    if not np.all(np.isfinite(x)):
        return Answer(np.zeros(problem.size), name, Check(np.inf, np.inf, np.inf), infeasible)
    x = np.clip(x, problem.lower, problem.upper)  # rounding only: the check below sees what it cost
    check = checked(problem, x, multipliers)
    if not check.passed and not infeasible and polish:
        better = polished(problem, x)
        better_check = checked(problem, better)
        if better_check.worst < check.worst:
            x, check = better, better_check
    return Answer(x, name, check, infeasible)
