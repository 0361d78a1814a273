# SPDX-License-Identifier: GPL-3.0-or-later
"""Two external solvers beside the engine: daqp for single spectra and feasibility, piqp if it is faster or the others
fail.

Dual active sets (daqp, Arnström 2022) take microseconds for a single spectrum. PIQP (Schwan 2023) works on the rows
themselves and does not square their condition.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.arrow import Arrow, Spectrum
from spectral_core.palette.qp.block import Block
from spectral_core.palette.qp.quadratic import FAR, Quadratic

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

STIFFEST = 1e8
"""Largest weight, relative to the median, in daqp: its normal equations lose digits beyond that."""
EQUAL = 5
"""daqp's sense of an equality."""
REACHED = 1e-7
"""Linear RGB within which exact rows count as feasible together."""


def lone_spectrum(
    spectrum: Spectrum, lower: Array, upper: Array, colors: Array, start: Array | None = None
) -> tuple[Array, Mask] | None:
    """One spectrum at given free colors, by daqp, and the samples off their bounds; None if it fails.

    With many exact rows, or very large weights, the answer is a guess of the active bounds rather than an optimum.

    Parameters
    ----------
    spectrum
        Rows and roughness in squares.
    lower, upper
        Bounds, (n,).
    colors
        The free colors, (q,).
    start
        Values near the answer, (n,): those at bounds are tried there first.
    """
    import daqp

    size = lower.size
    exact = spectrum.compliance == 0
    hessian, linear = spectrum.hessian, spectrum.linear - colors @ spectrum.ties
    right = spectrum.border_target + spectrum.border_ties @ colors
    if not exact.all():
        # daqp takes no compliances. Rows of large weight go back into H, capped: the answer serves as a guess of
        # active bounds only.
        stiff, stiffness = spectrum.border[~exact], np.minimum(1.0 / spectrum.compliance[~exact], STIFFEST)
        hessian = hessian + (stiff.T * stiffness) @ stiff
        linear = linear - (stiffness * right[~exact]) @ stiff
    rows, equal = np.ascontiguousarray(spectrum.border[exact]), right[exact]
    high, low = np.minimum(upper, FAR), np.maximum(lower, -FAR)
    sense = np.zeros(size + len(equal), dtype=np.int32)
    sense[size:] = EQUAL
    if len(equal):
        high, low = np.concatenate([high, equal]), np.concatenate([low, equal])
    tolerances = {"primal_tol": 1e-11, "dual_tol": 1e-12}
    x, _, flag, info = daqp.solve(hessian, linear, rows, high, low, sense, primal_start=start, **tolerances)
    # The start is a hint and saves time only: daqp must not fail because of it.
    if start is not None and (flag <= 0 or not np.all(np.isfinite(x))):
        x, _, flag, info = daqp.solve(hessian, linear, rows, high, low, sense, **tolerances)
    if flag <= 0 or not np.all(np.isfinite(x)):
        return None
    multipliers = np.asarray(info["lam"])[:size]
    # Exactly on the bound if its multiplier is not 0: rounding must not make an active bound look free.
    value = np.where(multipliers > 0, upper, np.where(multipliers < 0, lower, np.asarray(x)))
    return np.clip(value, lower, upper), multipliers == 0


def lone_spectra(arrow: Arrow) -> tuple[Array, Mask] | None:
    """All spectra by daqp if they share no color; None if they do, or if daqp fails."""
    # Free colors couple the spectra, and daqp would need all of them in one dense problem.
    if arrow.problem.color_lower.size:
        return None
    found = []
    for block, spectrum in zip(arrow.problem.blocks, arrow.spectra, strict=True):
        one = lone_spectrum(spectrum, block.lower, block.upper, np.zeros(0))
        if one is None:
            return None
        found.append(one)
    return np.concatenate([x for x, _ in found]), np.concatenate([free for _, free in found])


def by_piqp(problem: Quadratic) -> tuple[Array, list[Array]] | None:
    """All unknowns and the multipliers of exact rows by block, from piqp in least-squares form; None if it fails."""
    import piqp
    from scipy import sparse

    matrix, target = problem.least_squares()
    equality, equality_target = problem.equalities()
    count, n = matrix.shape
    solver = piqp.SparseSolver()
    solver.settings.eps_abs, solver.settings.eps_rel = 1e-11, 1e-11
    solver.settings.eps_duality_gap_abs, solver.settings.eps_duality_gap_rel = 1e-12, 1e-12
    # Limit on the time for a problem without an optimum.
    solver.settings.max_iter = 200
    # Unknowns x and the residual r = M x − y: the objective is then the square of r alone, and M is not squared.
    squares = sparse.diags(np.concatenate([np.zeros(n), np.ones(count)]), format="csc")
    left = sparse.bmat([[matrix, -sparse.identity(count)], [equality, None]], format="csc")
    lower = np.concatenate([problem.lower, np.full(count, -np.inf)])
    upper = np.concatenate([problem.upper, np.full(count, np.inf)])
    try:
        solver.setup(
            squares, np.zeros(n + count), left, np.concatenate([target, equality_target]), x_l=lower, x_u=upper
        )
        solver.solve()
    except (RuntimeError, ValueError):
        return None
    x, duals = np.array(solver.result.x[:n]), np.array(solver.result.y[count:])
    if not np.all(np.isfinite(x)):
        return None
    ends = np.cumsum([int(block.exact.sum()) for block in problem.blocks])[:-1]
    # piqp returns the equality multipliers in the order of the rows: block after block.
    return np.clip(x, problem.lower, problem.upper), np.split(duals, ends)


def nearest_miss(problem: Quadratic) -> float:
    """Least possible residual of the exact rows within the bounds: 0 if they can hold together."""
    blocks = tuple(_only_exact(block) for block in problem.blocks)
    colors = problem.color_lower.size
    # Least squares of the exact rows alone: their residual at the optimum is the least possible one.
    soft = Quadratic(blocks, problem.color_lower, problem.color_upper, np.zeros((0, colors)), np.zeros(0), np.zeros(0))
    found = by_piqp(soft)
    if found is None:
        return np.inf
    shown, values = soft.split(found[0])
    misses = [
        float(np.abs(block.misses(value, shown.ravel())).max(initial=0.0))
        for block, value in zip(blocks, values, strict=True)
    ]
    return max(misses, default=0.0)


def _only_exact(block: Block) -> Block:
    """The exact rows of a block as soft ones, with a tiny ridge that makes the answer unique."""
    exact, n = block.exact, block.lower.size
    return Block(
        block.rows[exact],
        block.targets[exact],
        block.ties[exact],
        np.ones(int(exact.sum())),
        1e-7 * np.eye(n),
        1e-14 * np.eye(n),
        block.lower,
        block.upper,
    )
