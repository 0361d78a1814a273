# SPDX-License-Identifier: GPL-3.0-or-later
"""Solvers that start cold: daqp where no spectrum depends on another, piqp if it is faster or the others fail.

PIQP (Schwan 2023) works on the rows themselves and does not square their condition.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.arrow import Arrow
from spectral_core.palette.qp.block import Block
from spectral_core.palette.qp.kept_spectrum import KeptSpectrum
from spectral_core.palette.qp.quadratic import Quadratic

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

REACHED = 1e-7
"""Linear RGB within which exact rows count as feasible together."""


def lone_spectra(arrow: Arrow) -> tuple[Array, Mask] | None:
    """All spectra by daqp if they share no color; None if they do, or if daqp fails."""
    # Free colors couple the spectra, and daqp would need all of them in one dense problem.
    if arrow.problem.color_lower.size:
        return None
    found = []
    for block, spectrum in zip(arrow.problem.blocks, arrow.spectra, strict=True):
        one = KeptSpectrum(spectrum, block.lower, block.upper).at(spectrum, np.zeros(0))
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
