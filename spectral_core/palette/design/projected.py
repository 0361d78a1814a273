# SPDX-License-Identifier: GPL-3.0-or-later
"""φ of any palette: the least sum of squares after the inner side is solved.

Value and gradient come from the engine's answer (the envelope theorem).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.side import Assembled, Assembler
from spectral_core.palette.assemble.state import PaletteState
from spectral_core.palette.assemble.view import Side
from spectral_core.palette.qp.answer import Answer
from spectral_core.palette.qp.block import Block, RowKey
from spectral_core.palette.qp.engine import Engine

Array = NDArray[np.float64]


class Projected:
    """φ of any palette, by the engine."""

    def __init__(self, assembler: Assembler, outer: Side) -> None:
        self._assembler = assembler
        self._outer: Side = outer
        self._inner: Side = "reflectances" if outer == "lights" else "lights"
        self._engine = Engine()
        self._perceptual = assembler.problem.match == "perceptual"

    def objective(self, state: PaletteState) -> tuple[float, Array, PaletteState]:
        """φ, its gradient by the outer side, and the state with the best inner side."""
        inner = self._assembler.assembled(self._inner, state, perceptual=self._perceptual)
        answer = self._engine.solve(inner.quadratic)
        state = state.with_values(self._inner, dict(zip(inner.items, answer.values, strict=True)))
        outer = self._assembler.assembled(self._outer, state, perceptual=self._perceptual)
        quadratic = outer.quadratic
        values = [known(getattr(state, self._outer)[j]) for j in outer.items]
        colors = quadratic.best_colors(values)
        common = dict(zip(inner.group_conditions, answer.colors, strict=True))
        for number, column in enumerate(outer.group_conditions):
            colors[number] = common.get(column, colors[number])
        x = quadratic.joined(colors, values)
        gradient = quadratic.gradient(x, quadratic.forces(x, _exact_forces(inner, outer, answer)))[colors.size :]
        objective = inner.quadratic.objective(inner.quadratic.joined(answer.colors, answer.values))
        objective += _strain(inner, answer) + _beside(inner, outer, x)
        return objective, gradient, state


def _exact_forces(inner: Assembled, outer: Assembled, answer: Answer) -> list[Array]:
    """Multipliers of exact rows on the outer side: an exact cell has the same multiplier there as on the inner side."""
    multipliers: dict[RowKey, Array] = {}
    for block, force in zip(inner.quadratic.blocks, answer.forces, strict=True):
        for r, key in enumerate(block.keys):
            if np.isinf(block.weights[3 * r]):
                multipliers[key] = force[3 * r : 3 * r + 3]
    found = []
    for block in outer.quadratic.blocks:
        held = [multipliers[key] for r, key in enumerate(block.keys) if np.isinf(block.weights[3 * r])]
        # Rows that belong to no cell, as the white of a light, are constraints of the descent itself.
        others = np.zeros(int(block.exact[3 * len(block.keys) :].sum()))
        found.append(np.concatenate([*held, others]))
    return found


def _strain(inner: Assembled, answer: Answer) -> float:
    """Cost of exact rows that cannot hold at these outer values and got a large weight; 0 if they hold."""
    if not answer.infeasible:
        return 0.0
    total = 0.0
    for block, value, force in zip(inner.quadratic.blocks, answer.values, answer.forces, strict=True):
        misses = block.misses(value, answer.colors.ravel())
        total += 0.5 * float(force[block.exact] @ misses[block.exact])
    return total


def _beside(inner: Assembled, outer: Assembled, x: Array) -> float:
    """Terms that the outer side adds to the inner side's objective: its roughness, and rows that the inner side lacks.

    These are targets on given inner factors, and groups without designed inner factors.
    """
    colors, values = outer.quadratic.split(x)
    axis = 0 if inner.side == "reflectances" else 1
    own = {n for n, key in enumerate(outer.group_conditions) if key not in inner.group_conditions}
    total = 0.0
    for block, value in zip(outer.quadratic.blocks, values, strict=True):
        total += 0.5 * float(value @ (block.gram @ value))
        squares = block.soft_weights * block.misses(value, colors.ravel()) ** 2
        for r, (_, cell) in enumerate(block.keys):
            column = _column(block, r)
            lacking = column in own if column is not None else cell[axis] not in inner.items
            total += 0.5 * float(squares[3 * r : 3 * r + 3].sum()) if lacking else 0.0
    quadratic = outer.quadratic
    left = quadratic.known_weights * (quadratic.known_targets + quadratic.known_ties @ colors.ravel()) ** 2
    for number in own:
        total += 0.5 * float(left[quadratic.known_ties[:, 3 * number : 3 * number + 3].any(axis=1)].sum())
    return total


def _column(block: Block, r: int) -> int | None:
    """Index of the free color that the rows of a cell are tied to; None for a target."""
    tied = np.flatnonzero(block.ties[3 * r])
    return int(tied[0]) // 3 if tied.size else None


def known(values: Array | None) -> Array:
    """The values of a spectrum that is designed."""
    assert values is not None
    return values
