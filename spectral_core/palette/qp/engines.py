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

from spectral_core.errors import InvalidInputError, SolveError
from spectral_core.palette.qp.least_squares import RIDGE, Check, LinkedLeastSquares, dense_equalities, dense_rows
from spectral_core.palette.qp.optimality import checked
from spectral_core.palette.qp.polish import polished

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
"""x, multipliers of the equalities or None, whether the engine claims infeasibility.

``start`` of an engine: free colors (G, 3) of an earlier answer to a like problem.
"""


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
    from scipy import sparse

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
    from spectral_core.palette.qp.tied import TiedSolver, tied_from_links

    quadratics = tied_from_links(problem)
    everything = np.arange(len(problem.blocks))
    solver = TiedSolver(*quadratics.linear.shape)
    if start is not None and start.size == quadratics.color_linear.size:
        solver.begin_at(np.clip(start.ravel(), *quadratics.color_bounds))
    values, colors = solver.solve(quadratics, everything, everything)
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
        # Past the polish, dense engines cost n³ and gain nothing that an eye sees: an answer that passes is taken.
        if answer.check.good or (answer.check.passed and problem.size > polish_below):
            break
        rejected.append(name)
        if answer.infeasible and name == "piqp":
            break
    if best is None:
        raise InvalidInputError(f"none of the engines {', '.join(order)} takes equalities; use piqp for exact cells")
    missed = tuple(name for name in rejected if name != best.engine)
    return Answer(
        best.x, best.engine, best.check, problem.has_equalities and (best.infeasible or not best.check.passed), missed
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
    if not (check.good and check.gap <= Check.SHARP) and not infeasible and polish and check.equality < 1e-3:
        better, better_check = polished(problem, x)
        if better_check.worst <= check.worst:
            x, check = better, better_check
    return Answer(x, name, check, infeasible)
