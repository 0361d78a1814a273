# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact cells in a compiled palette, by the method of multipliers (Hestenes 1969, Powell 1969).

An exact cell is taken as a heavy soft one whose target is shifted, after each solve, by what it still missed. The
shifts converge to the multipliers of the equality. Between solves only linear terms change, so each costs microseconds;
from the shifts of the last edit on, a few are enough.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.compiled import Known, WishArrays
from spectral_core.palette.qp.tied import TiedProblem, TiedSolver

Array = NDArray[np.float64]

STEPS = 40
GOAL = 1e-11
"""Linear RGB at which an exact cell holds; steps go on while they gain, for the multipliers are finer than that."""
HOPELESS = 1e-3
"""Miss above which a step without gain ends the attempt."""


@dataclass(eq=False)
class Shifts:
    """Scaled multipliers of exact targets and exact links, (R, L, 3) each, in the side's own orientation."""

    targets: Array
    links: Array

    @classmethod
    def none(cls, arrays: WishArrays) -> Shifts:
        return cls(np.zeros(arrays.targets.shape), np.zeros(arrays.targets.shape))

    def kept_where(self, arrays: WishArrays) -> Shifts:
        """These shifts where the cells are still exact, 0 elsewhere."""
        if self.targets.shape != arrays.targets.shape:
            return Shifts.none(arrays)
        return Shifts(self.targets * arrays.exact_targets[..., None], self.links * arrays.exact_links[..., None])


@dataclass(eq=False)
class ExactSide:
    """One side of a compiled palette whose exact cells are to hold; arrays in the side's orientation."""

    arrays: WishArrays
    known: Known
    rows: NDArray[np.intp]
    """Which items of the side are designed."""
    shown: Array
    """(R, L, 3): present colors, of which those of given items are used."""

    def solve(
        self,
        solver: TiedSolver,
        problem: TiedProblem,
        shifts: Shifts,
        changed: NDArray[np.intp],
        reshaped: NDArray[np.intp],
    ) -> tuple[TiedProblem, Array, Array, float]:
        """Move ``shifts`` until exact cells hold; the shifted problem, its spectra and colors, and the largest miss."""
        exact = self.arrays.exact_targets | self.arrays.exact_links
        involved = np.flatnonzero(exact[self.rows].any(axis=1))
        changed = np.union1d(changed, involved)
        best = np.inf
        for _ in range(STEPS):
            shifted = self._shifted(problem, shifts)
            values, colors = solver.solve(shifted, changed, reshaped)
            target_miss, link_miss = self._misses(values, colors)
            worst = float(max(np.abs(target_miss).max(initial=0.0), np.abs(link_miss).max(initial=0.0)))
            if worst > (0.5 * best if best <= GOAL else 0.99 * best) and (best <= GOAL or best > HOPELESS):
                break  # as exact as rounding lets it be, or cells that cannot all hold
            best = min(best, worst)
            shifts.targets += target_miss
            shifts.links += link_miss
            changed, reshaped = involved, np.zeros(0, dtype=np.intp)
        return shifted, values, colors, worst

    def _shifted(self, problem: TiedProblem, shifts: Shifts) -> TiedProblem:
        """``problem`` with the exact cells' targets shifted."""
        arrays, n = self.arrays, problem.linear.shape[1]
        target_pull = arrays.target_weights[..., None] * shifts.targets
        link_pull = arrays.link_weights[..., None] * shifts.links
        pulls = (target_pull + link_pull)[self.rows].reshape(len(self.rows), -1)
        linear = problem.linear + pulls @ self.known.matrices.reshape(-1, n)
        color_linear = problem.color_linear
        if color_linear.size:
            common = color_linear.reshape(-1, 3).copy()
            members = arrays.group >= 0
            np.add.at(common, arrays.group[members], link_pull[members])
            color_linear = common.ravel()
        return replace(problem, linear=linear, color_linear=color_linear)

    def _misses(self, values: Array, colors: Array) -> tuple[Array, Array]:
        """What exact targets and links are off by, (R, L, 3) each, 0 for all other cells."""
        arrays = self.arrays
        shown = self.shown.copy()
        n = values.shape[1]
        shown[self.rows] = (values @ self.known.matrices.reshape(-1, n).T).reshape(len(self.rows), -1, 3)
        designed = np.zeros(len(shown), dtype=bool)
        designed[self.rows] = True
        held = (arrays.exact_targets & designed[:, None])[..., None]
        target_miss = np.where(held, shown - arrays.targets, 0.0)
        link_miss = np.zeros_like(shown)
        if colors.size:
            common = colors.reshape(-1, 3)[arrays.group]
            # A group that nothing designed belongs to has a color of no consequence.
            touched = np.isin(arrays.group, arrays.group[designed]) & arrays.exact_links
            link_miss = np.where(touched[..., None], shown - common, 0.0)
        return target_miss, link_miss
