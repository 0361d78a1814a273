# SPDX-License-Identifier: GPL-3.0-or-later
"""External solvers beside the engine: daqp for a single spectrum, piqp if it is faster or the others fail.

daqp (Arnström 2022) factors H when a workspace is made, which costs n³. After that, other colors or targets change only
right-hand sides: the next answer starts from the last active bounds and takes some ten microseconds. PIQP (Schwan 2023)
works on the rows themselves and does not square their condition.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.arrow import Arrow
from spectral_core.palette.qp.block import Block
from spectral_core.palette.qp.quadratic import FAR, Quadratic
from spectral_core.palette.qp.squares import Spectrum

if TYPE_CHECKING:
    from scipy import sparse

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

STIFFEST = 1e8
"""Largest weight, relative to the median, in daqp: its normal equations lose digits beyond that."""
EQUAL = 5
"""daqp's sense of an equality."""
TOLERANCES = {"primal_tol": 1e-11, "dual_tol": 1e-12}
PIQP_STEPS = 200
"""Most steps of piqp; ten to forty are usual."""
SOLVED, IMPOSSIBLE = "PIQP_SOLVED", "PIQP_PRIMAL_INFEASIBLE"
"""Names of piqp's statuses."""
REACHED = 1e-7
"""Linear RGB within which exact rows count as feasible together."""


class KeptSpectrum:
    """One spectrum in a daqp workspace.

    With many exact rows, or very large weights, its answers are guesses of the active bounds rather than optima.

    Parameters
    ----------
    spectrum
        Rows and roughness in squares.
    lower, upper
        Bounds, (n,).
    """

    def __init__(self, spectrum: Spectrum, lower: Array, upper: Array) -> None:
        import daqp

        self._spectrum, self._lower, self._upper = spectrum, lower, upper
        self._exact = spectrum.compliance == 0
        self._high, self._low = np.minimum(upper, FAR), np.maximum(lower, -FAR)
        self._hessian = np.ascontiguousarray(spectrum.hessian)
        # daqp takes no compliances. Rows of large weight go back into H, capped: the answer serves as a guess of
        # active bounds only.
        self._stiff: Array | None = None
        if len(self._exact) and not self._exact.all():
            stiff = spectrum.border[~self._exact]
            self._stiff = np.minimum(1.0 / spectrum.compliance[~self._exact], STIFFEST)[:, None] * stiff
            self._hessian = np.ascontiguousarray(self._hessian + stiff.T @ self._stiff)
        self._rows = np.ascontiguousarray(spectrum.border[self._exact])
        self._model = daqp.Model()
        self._model.settings = TOLERANCES
        self._ready = False

    def fits(self, spectrum: Spectrum) -> bool:
        """True if a spectrum differs from this one by its targets alone."""
        own = self._spectrum
        return spectrum.hessian is own.hessian and spectrum.border is own.border and spectrum.ties is own.ties

    def at(self, spectrum: Spectrum, colors: Array, start: Array | None = None) -> tuple[Array, Mask] | None:
        """The optimum at given free colors, and the samples off their bounds; None if daqp fails.

        Parameters
        ----------
        spectrum
            One that ``fits``, with its present targets.
        colors
            The free colors, (q,).
        start
            Values near the answer, (n,), for the first call: those at bounds are tried there first.
        """
        colors = colors[spectrum.colors]
        linear = spectrum.linear - colors @ spectrum.ties
        high, low = self._high, self._low
        if len(self._exact):
            right = spectrum.border_target + spectrum.border_ties @ colors
            equal = right[self._exact]
            high, low = np.concatenate([high, equal]), np.concatenate([low, equal])
            if self._stiff is not None:
                linear = linear - right[~self._exact] @ self._stiff
        found = self._solved(linear, high, low, start)
        if found is None:
            self._ready = False
            return None
        x, multipliers = found
        # Exactly on the bound if its multiplier is not 0: rounding must not make an active bound look free.
        value = np.minimum(np.maximum(x, self._lower), self._upper)
        np.copyto(value, self._upper, where=multipliers > 0)
        np.copyto(value, self._lower, where=multipliers < 0)
        return value, multipliers == 0

    def _solved(self, linear: Array, high: Array, low: Array, start: Array | None) -> tuple[Array, Array] | None:
        """Values and multipliers of the bounds, from the last active bounds if there are any, else from ``start``."""
        if self._ready:
            if len(self._rows):
                failed = self._model.update(f=linear, bupper=high, blower=low) < 0
            else:
                failed = self._model.update(f=linear) < 0
            found = None if failed else self._answer()
            if found is not None:
                return found
        # Without a start as well: it is a hint and saves time only, and daqp must not fail because of it.
        for begin in (start, None) if start is not None else (None,):
            sense = np.zeros(len(high), dtype=np.int32)
            sense[self._lower.size :] = EQUAL
            status, _ = self._model.setup(self._hessian, linear, self._rows, high, low, sense, primal_start=begin)
            found = self._answer() if status >= 0 else None
            if found is not None:
                self._ready = True
                return found
        return None

    def _answer(self) -> tuple[Array, Array] | None:
        x, _, flag, info = self._model.solve()
        x = np.asarray(x)
        # A sum of finite numbers of this size is finite.
        if flag <= 0 or not isfinite(x.sum()):
            return None
        return x, np.asarray(info["lam"])[: x.size]


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


@dataclass(frozen=True, slots=True, eq=False)
class PiqpAnswer:
    """All unknowns ``x`` (n,) and the ``multipliers`` of exact rows by block; ``is_solved``: to piqp's tolerances;
    ``is_impossible``: by piqp the exact rows cannot hold together within the bounds.
    """

    x: Array
    multipliers: list[Array]
    is_solved: bool
    is_impossible: bool


def by_piqp(problem: Quadratic, most: int = PIQP_STEPS) -> PiqpAnswer | None:
    """The answer of piqp in least-squares form after at most ``most`` steps; None if it has no numbers."""
    found = _least_squares(problem, np.zeros(problem.size), 1.0, 1.0, most)
    if found is None:
        return None
    ends = np.cumsum([int(block.exact.sum()) for block in problem.blocks])[:-1]
    # piqp returns the equality multipliers in the order of the rows: block after block.
    return PiqpAnswer(found.x, np.split(found.multipliers, ends), found.status == SOLVED, found.status == IMPOSSIBLE)


def change_by_piqp(problem: Quadratic, start: Array, unit: float) -> Array | None:
    """A better point, from a start within bounds; unknowns that piqp finds at bounds lie on them. None if it fails.

    piqp's tolerances are absolute, and hide an optimum of tiny objective. The unknowns are therefore the change from
    the start, in some unit, and the objective at the start is 1 (iterative refinement, Gleixner et al. 2016).
    """
    here = problem.objective(start)
    found = _least_squares(problem, start, unit, 1.0 / np.sqrt(2.0 * here)) if here > 0 else None
    return None if found is None else _at_bounds(problem, found)


def change_on_rows(problem: Quadratic, start: Array, rows: Array, unit: float) -> Array | None:
    """The optimum near a start that meets all exact rows, with other rows (r, size) in their place that leave the same
    directions; unknowns that piqp finds at bounds lie on them. None if it fails.
    """
    from scipy import sparse

    here = problem.objective(start)
    if not here > 0:
        return None
    found = _least_squares(problem, start, unit, 1.0 / np.sqrt(2.0 * here), equality=sparse.csr_matrix(rows))
    return None if found is None else _at_bounds(problem, found)


def _at_bounds(problem: Quadratic, found: _Found) -> Array:
    nearer = np.where(found.x - problem.lower < problem.upper - found.x, problem.lower, problem.upper)
    return np.where(found.at_bounds, nearer, found.x)


class _Found(NamedTuple):
    """All unknowns, the multipliers of exact rows, which unknowns are at bounds, and the name of piqp's status."""

    x: Array
    multipliers: Array
    at_bounds: Mask
    status: str


def _least_squares(
    problem: Quadratic,
    start: Array,
    unit: float,
    scale: float,
    most: int = PIQP_STEPS,
    equality: sparse.csr_matrix | None = None,
) -> _Found | None:
    """``equality``: rows in place of the exact ones, which keep what they are at the start."""
    import piqp
    from scipy import sparse

    matrix, target = problem.least_squares()
    if equality is None:
        equality, equality_target = problem.equalities()
    else:
        equality_target = equality @ start
    count, n = matrix.shape
    matrix, target = matrix * (scale * unit), scale * (target - matrix @ start)
    solver = piqp.SparseSolver()
    solver.settings.eps_abs, solver.settings.eps_rel = 1e-11, 1e-11
    solver.settings.eps_duality_gap_abs, solver.settings.eps_duality_gap_rel = 1e-12, 1e-12
    # Limit on the time for a problem without an optimum.
    solver.settings.max_iter = most
    # Unknowns x and the residual r = M x − y: the objective is then the square of r alone, and M is not squared.
    squares = sparse.diags(np.concatenate([np.zeros(n), np.ones(count)]), format="csc")
    left = sparse.bmat([[matrix, -sparse.identity(count)], [equality, None]], format="csc")
    right = np.concatenate([target, (equality_target - equality @ start) / unit])
    lower = np.concatenate([(problem.lower - start) / unit, np.full(count, -np.inf)])
    upper = np.concatenate([(problem.upper - start) / unit, np.full(count, np.inf)])
    try:
        solver.setup(squares, np.zeros(n + count), left, right, x_l=lower, x_u=upper)
        status = solver.solve()
    except (RuntimeError, ValueError):
        return None
    result = solver.result
    x = start + unit * np.array(result.x[:n])
    if not np.all(np.isfinite(x)):
        return None
    at_bounds = np.array(result.z_bl[:n] > result.s_bl[:n]) | np.array(result.z_bu[:n] > result.s_bu[:n])
    return _Found(np.clip(x, problem.lower, problem.upper), np.array(result.y[count:]), at_bounds, status.name)


def nearest_miss(problem: Quadratic) -> float:
    """Least possible residual of the exact rows within the bounds: 0 if they can hold together."""
    blocks = tuple(_only_exact(block) for block in problem.blocks)
    colors = problem.color_lower.size
    # Least squares of the exact rows alone: their residual at the optimum is the least possible one.
    soft = Quadratic(blocks, problem.color_lower, problem.color_upper, np.zeros((0, colors)), np.zeros(0), np.zeros(0))
    found = by_piqp(soft)
    if found is None:
        return np.inf
    shown, values = soft.split(found.x)
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
