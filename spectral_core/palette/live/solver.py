# SPDX-License-Identifier: GPL-3.0-or-later
"""The compiled half of a live session: knows what an edit changed, and solves only that again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import SolveError
from spectral_core.palette.assemble.compiled import Known, WishArrays, compiled, recompiled_row, smoothness_gram
from spectral_core.palette.assemble.phase import COLOR_NORM, Side
from spectral_core.palette.assemble.phase_solve import PhaseAnswer
from spectral_core.palette.assemble.wishes import WEIGHT_RATIO, Wishes
from spectral_core.palette.live.state import PaletteState
from spectral_core.palette.problem import Cell, CellIndex, CellMode, PaletteProblem
from spectral_core.palette.qp.exact import ExactSide, Shifts
from spectral_core.palette.qp.least_squares import Check
from spectral_core.palette.qp.tied import TiedProblem, TiedSolver

Array = NDArray[np.float64]

EXACT_MISS = 1e-9
"""Linear RGB by which an exact cell may be off in a compiled solve."""
TARGET_MODES = (CellMode.FIXED, CellMode.BLACK)


@dataclass(eq=False)
class _Side:
    """What one side keeps between solves."""

    items: tuple[int, ...]
    solver: TiedSolver
    arrays: WishArrays | None = None
    known: Known | None = None
    problem: TiedProblem | None = None
    shifts: Shifts | None = None


class LiveSolver:
    """Solvers, matrices and wishes of a palette that ``is_simple``, between edits."""

    def __init__(self, problem: PaletteProblem, wishes: Wishes) -> None:
        self.load(problem, wishes)
        free: dict[Side, tuple[int, ...]] = {
            "reflectances": tuple(k for k, item in enumerate(problem.reflectances) if item.free),
            "lights": tuple(k for k, light in enumerate(problem.lights) if light.free),
        }
        self._sides = {
            side: _Side(items, TiedSolver(len(items), problem.grid.size)) for side, items in free.items() if items
        }

    def load(self, problem: PaletteProblem, wishes: Wishes) -> None:
        """Take the wishes of a problem of the same shape."""
        self._wishes = wishes
        self._arrays = WishArrays.of(problem, wishes)
        self._row: int | None = None
        self._heaviest = wishes.weight_scale
        self._capped = bool(wishes.notes)

    def edit_targets(self, before: PaletteProblem, wishes: Mapping[CellIndex, Cell]) -> bool:
        """Take an edit of a single cell that had, and has, a color of its own; False where ``load`` must be called."""
        if len(wishes) != 1 or self._capped:
            return False
        ((i, j), wish) = next(iter(wishes.items()))
        old = before.cells[i][j]
        heavy = self._heaviest
        if wish.mode not in TARGET_MODES or old.mode not in TARGET_MODES or wish.exact or old.exact:
            return False
        if not heavy / WEIGHT_RATIO <= wish.weight <= heavy or self._arrays.group[i, j] >= 0:
            return False
        arrays = self._arrays.copy()
        arrays.target_weights[i, j] = (wish.weight / heavy / COLOR_NORM) ** 2
        arrays.targets[i, j] = 0.0 if wish.target is None else wish.target
        self._arrays, self._row = arrays, i
        return True

    def solve(
        self, problem: PaletteProblem, state: PaletteState, rounds: int
    ) -> tuple[PaletteState, dict[Side, PhaseAnswer], Array] | None:
        """New state, checks by side and colors (R, L, 3) after some rounds; None where an answer fails its check."""
        answers: dict[Side, PhaseAnswer] = {}
        both = len(self._sides) == 2
        for _ in range(rounds if both else 1):
            for side, kept in self._sides.items():
                known = Known.of(state, side) if both or kept.known is None else kept.known
                answer = self._solve_side(side, problem, state, known)
                if answer is None:
                    return None
                answers[side] = answer
                state = self._with_answer(side, answer, state)
        self._row = None
        return state, answers, self._colors(problem, state)

    def half_round(
        self, side: Side, problem: PaletteProblem, state: PaletteState
    ) -> tuple[PhaseAnswer, PaletteState, float] | None:
        """One side: its answer, the new state and the sum of squares; None where the answer is not beyond doubt.

        Exact cells are left to the general engines: where a common color is nearly free, multipliers round it off at
        1e-6, which is nothing while editing and too much for a final answer.
        """
        if self._arrays.any_exact:
            return None
        answer = self._solve_side(side, problem, state, Known.of(state, side))
        if answer is None or not answer.check.good:
            return None
        state = self._with_answer(side, answer, state)
        return (
            answer,
            state,
            self._arrays.sum_of_squares(state.colors(), answer.colors)
            + sum(float(values @ smoothness_gram(problem, self._wishes, side) @ values) for values in answer.blocks),
        )

    def _with_answer(self, side: Side, answer: PhaseAnswer, state: PaletteState) -> PaletteState:
        found = dict(zip(self._sides[side].items, answer.blocks, strict=True))
        return state.with_reflectances(found) if side == "reflectances" else state.with_lights(found)

    def _solve_side(self, side: Side, problem: PaletteProblem, state: PaletteState, known: Known) -> PhaseAnswer | None:
        kept, arrays = self._sides[side], self._arrays
        reshaped, changed = self._differences(side, known)
        exact = arrays.any_exact
        one_row = side == "reflectances" and self._row is not None and known is kept.known and not exact
        if one_row and kept.problem is not None and self._row in kept.items:
            row, gram = kept.items.index(self._row), smoothness_gram(problem, self._wishes, side)
            tied = recompiled_row(kept.problem, row, self._row, arrays, known, gram)
        else:
            _, tied = compiled(problem, self._wishes, arrays, known, state, side)
        try:
            if exact:
                holding = self._exact_side(side, problem, state, known)
                kept.shifts = kept.shifts.kept_where(holding.arrays) if kept.shifts else Shifts.none(holding.arrays)
                tied, values, colors, miss = holding.solve(kept.solver, tied, kept.shifts, changed, reshaped)
            else:
                values, colors = kept.solver.solve(tied, changed, reshaped)
                miss = 0.0
            # An exact cell that is off by more is left to the general engines, which say whether it can hold at all.
            check = Check(tied.kkt(values, colors), 0.0, 0.0 if miss <= EXACT_MISS else np.inf)
        except (SolveError, np.linalg.LinAlgError):
            check = Check(np.inf, 0.0, 0.0)
        if not check.passed:
            kept.solver = TiedSolver(*kept.solver.values.shape)
            kept.arrays = kept.known = kept.problem = kept.shifts = None
            return None
        kept.arrays, kept.known, kept.problem = arrays, known, tied
        engine = "tied" if colors.size else "daqp"
        return PhaseAnswer(tuple(values.copy()), colors.reshape(-1, 3).copy(), check, (engine,), False, ())

    def _exact_side(self, side: Side, problem: PaletteProblem, state: PaletteState, known: Known) -> ExactSide:
        arrays, rows = self._arrays, np.array(self._sides[side].items)
        # Present colors matter only for what is given on this side.
        colors = state.colors() if len(rows) < len(getattr(problem, side)) else np.zeros(arrays.targets.shape)
        if side == "lights":
            arrays, colors = arrays.turned(), colors.swapaxes(0, 1)
        return ExactSide(arrays, known, rows, colors)

    def _differences(self, side: Side, known: Known) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Unknowns whose curvature, and whose anything, differs from the last solve."""
        kept, arrays = self._sides[side], self._arrays
        before = kept.arrays
        everything = np.arange(len(kept.items))
        if before is None or known is not kept.known or not before.same_groups(arrays):
            return everything, everything
        axis = 1 if side == "reflectances" else 0
        curved = (before.target_weights != arrays.target_weights) | (before.link_weights != arrays.link_weights)
        pulled = curved | (before.targets != arrays.targets).any(axis=2)
        rows = np.array(kept.items)
        return np.flatnonzero(curved.any(axis=axis)[rows]), np.flatnonzero(pulled.any(axis=axis)[rows])

    def _colors(self, problem: PaletteProblem, state: PaletteState) -> Array:
        """Colors of all cells, from the compiled matrices where every reflectance is designed and no light is."""
        kept = self._sides.get("reflectances")
        if len(self._sides) == 2 or kept is None or kept.known is None or len(kept.items) < len(problem.reflectances):
            return state.colors()
        lights, _, n = kept.known.matrices.shape
        return (kept.solver.values @ kept.known.matrices.reshape(-1, n).T).reshape(-1, lights, 3)
