# SPDX-License-Identifier: GPL-3.0-or-later
"""One convex step of the search for distinct colors: a quadratic program, by piqp or stated in cvxpy."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from spectral_core.errors import MissingDependencyError, UnknownNameError
from spectral_core.palette.qp.answer import FAILED, Check
from spectral_core.palette.qp.quadratic import FAR

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Step:
    """½ xᵀ H x + linear·x, subject to equalities, rows within limits, and bounds.

    With ``least``, t is the last unknown and −t is part of ``linear``.
    """

    hessian: sparse.csc_matrix
    linear: Array
    equality: sparse.csc_matrix
    equality_target: Array
    rows: sparse.csc_matrix
    rows_lower: Array
    rows_upper: Array
    lower: Array
    upper: Array
    least: bool = False

    def with_least(
        self, pair_rows: Array, pair_offsets: Array, moved: sparse.csc_matrix, middle: Array, radius: float
    ) -> Step:
        """The step with t: t ≤ pair_rows @ x + pair_offsets is maximized while |moved @ x − middle| ≤ radius."""
        one = sparse.csc_matrix(np.ones((1, 1)) * 1e-9)
        pairs = sparse.hstack([sparse.csc_matrix(pair_rows), -np.ones((len(pair_rows), 1))])
        rows = sparse.vstack([_widened(self.rows), pairs, _widened(moved)], format="csc")
        return replace(
            self,
            hessian=sparse.block_diag([self.hessian, one], format="csc"),
            linear=np.append(self.linear, -1.0),
            equality=_widened(self.equality),
            rows=rows,
            rows_lower=np.concatenate([self.rows_lower, -pair_offsets, middle - radius]),
            rows_upper=np.concatenate([self.rows_upper, np.full(len(pair_rows), np.inf), middle + radius]),
            lower=np.append(self.lower, -1e3),
            upper=np.append(self.upper, 1e3),
            least=True,
        )


@dataclass(frozen=True, eq=False)
class StepAnswer:
    """Unknowns without t, t (0 where the step has none), and how well the answer satisfies optimality."""

    x: Array
    t: float
    check: Check

    @property
    def feasible(self) -> bool:
        """True if x satisfies equalities and limits, optimal or not."""
        return self.check.equality <= Check.LIMIT


def solve_step(step: Step, engine: str = "piqp") -> StepAnswer:
    """Solve by ``"piqp"`` or ``"cvxpy"``; the answer is held to its bounds and checked either way."""
    if engine not in ENGINES:
        raise UnknownNameError.among("engine for distinct colors", engine, ENGINES)
    x, multipliers = ENGINES[engine](step)
    if not np.all(np.isfinite(x)):
        count = x.size - int(step.least)
        return StepAnswer(np.clip(np.zeros(count), step.lower[:count], step.upper[:count]), -np.inf, FAILED)
    x = np.clip(x, step.lower, step.upper)  # rounding only: the check includes its effect
    check = _checked(step, x, multipliers)
    return StepAnswer(x[:-1], float(x[-1]), check) if step.least else StepAnswer(x, 0.0, check)


Multipliers = tuple[Array, Array]
"""Of the equalities, and of the rows (positive at the upper limit)."""


def _piqp(step: Step) -> tuple[Array, Multipliers]:
    import piqp

    solver = piqp.SparseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-12
    solver.settings.eps_duality_gap_abs = solver.settings.eps_duality_gap_rel = 1e-12
    solver.settings.max_iter = 200
    solver.setup(
        sparse.csc_matrix(step.hessian), step.linear, step.equality, step.equality_target, step.rows,
        np.maximum(step.rows_lower, -FAR), np.minimum(step.rows_upper, FAR),
        np.maximum(step.lower, -FAR), np.minimum(step.upper, FAR),
    )  # fmt: skip
    status = solver.solve()
    result = solver.result
    if status == piqp.PIQP_PRIMAL_INFEASIBLE:
        return np.full(step.linear.size, np.nan), (np.zeros(0), np.zeros(0))
    return np.array(result.x), (np.array(result.y), np.array(result.z_u) - np.array(result.z_l))


def _cvxpy(step: Step) -> tuple[Array, Multipliers]:
    """The step in cvxpy: the oracle of the test, and an interface to other solvers."""
    try:
        import cvxpy
    except ImportError as error:
        raise MissingDependencyError.package(
            "cvxpy", "stating distinct colors for general solvers", "general"
        ) from error
    x = cvxpy.Variable(step.linear.size)
    objective = 0.5 * cvxpy.quad_form(x, cvxpy.psd_wrap(step.hessian)) + step.linear @ x
    equal = step.equality @ x == step.equality_target
    over = step.rows @ x <= np.minimum(step.rows_upper, FAR)
    under = step.rows @ x >= np.maximum(step.rows_lower, -FAR)
    bounds = [x >= np.maximum(step.lower, -FAR), x <= np.minimum(step.upper, FAR)]
    stated = cvxpy.Problem(cvxpy.Minimize(objective), [equal, over, under, *bounds])
    stated.solve(solver="CLARABEL", tol_gap_abs=1e-11, tol_gap_rel=1e-11, tol_feas=1e-11)
    if x.value is None:
        return np.full(step.linear.size, np.nan), (np.zeros(0), np.zeros(0))
    return np.asarray(x.value), (
        np.asarray(equal.dual_value),
        np.asarray(over.dual_value) - np.asarray(under.dual_value),
    )


ENGINES = {"piqp": _piqp, "cvxpy": _cvxpy}


def _checked(step: Step, x: Array, multipliers: Multipliers) -> Check:
    """Projected-gradient residual of the Lagrangian, scaled; limits and equalities."""
    parts = (step.hessian @ x, step.linear, step.equality.T @ multipliers[0], step.rows.T @ multipliers[1])
    gradient = sum(parts)
    # The natural size of the gradient is that of its terms, which cancel.
    scale = max(1.0, float(step.hessian.diagonal().max()), *(float(np.abs(part).max()) for part in parts))
    moved = np.clip(x - gradient / scale, step.lower, step.upper)
    kkt = float(np.abs(x - moved)[: x.size - int(step.least)].max(initial=0.0))
    shown = step.rows @ x
    size = np.maximum(1.0, np.abs(shown))
    outside = np.maximum(step.rows_lower - shown, shown - step.rows_upper) / size
    equality = np.abs(step.equality @ x - step.equality_target).max(initial=0.0)
    return Check(kkt, 0.0, max(float(equality), float(outside.max(initial=0.0))))


def _widened(matrix: sparse.csc_matrix) -> sparse.csc_matrix:
    """One more column, of zeros, for t."""
    return sparse.hstack([matrix, sparse.csc_matrix((matrix.shape[0], 1))], format="csc")
