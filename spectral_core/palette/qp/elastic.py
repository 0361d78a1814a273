# SPDX-License-Identifier: GPL-3.0-or-later
"""Nearest compromise: exact rows that cannot all hold become rows of large weight, in proportion to their cells."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.arrow import median_weight
from spectral_core.palette.qp.block import Block, typical
from spectral_core.palette.qp.feasibility import can_hold
from spectral_core.palette.qp.quadratic import Quadratic

Array = NDArray[np.float64]

ELASTIC = 1e4
"""Weight, relative to the median, of exact rows that cannot hold together."""
LEAST_ELASTIC = 1e-2
"""Least squared weight of an exact row among other exact ones, relative to the median."""


def softened(problem: Quadratic, which: Collection[int] | None = None, *, everything: bool = False) -> Quadratic:
    """The problem with the exact rows of cells, in all blocks or in some, as rows of large weight.

    Rows that are no cells (the white of a light, the energy of a dye) stay exact if they can hold by themselves, unless
    ``everything`` must be soft.
    """
    unit = unit_of(problem)
    blocks = list(problem.blocks)
    for k in range(len(blocks)) if which is None else which:
        blocks[k] = _softened(problem, k, unit, everything=everything)
    # Rows that are soft now do not count as soft cells, if others become soft after them.
    return replace(problem, blocks=tuple(blocks), cell_unit=unit)


def unit_of(problem: Quadratic) -> float:
    """Median weight of the soft cells, to which the weights of exact rows are relative."""
    return median_weight(problem)[0] if problem.cell_unit is None else problem.cell_unit


def _softened(problem: Quadratic, k: int, unit: float, *, everything: bool = False) -> Block:
    block = problem.blocks[k]
    if not block.any_exact:
        return block
    soft = block.exact.copy()
    if not everything and soft[3 * len(block.keys) :].any() and can_hold(problem, k, cells=False):
        soft[3 * len(block.keys) :] = False
    # Rows keep their order of importance among each other, but none may become so small that it has no effect.
    among = 1.0 if block.own_weights is None else np.maximum(block.own_weights / unit, LEAST_ELASTIC)
    return block.with_weights(block.targets, np.where(soft, ELASTIC * unit * among, block.weights), block.own_weights)


def within(problem: Quadratic, elsewhere: Array) -> Quadratic:
    """A part of a palette, with the unit of the whole. ``elsewhere``: the weights of the soft rows of all others."""
    own = [block.soft_weights for block in problem.blocks]
    return replace(problem, cell_unit=typical(np.concatenate([problem.known_weights, *own, elsewhere]))[0])


class Elastic:
    """The elastic problem of each edit while a conflict lasts; only the blocks that the edit changed are made anew."""

    def __init__(self) -> None:
        self._which: frozenset[int] | None = None
        self._asked: Quadratic | None = None
        self._found: Quadratic | None = None
        self._unit = 1.0

    def forget(self) -> None:
        """Forget the last problem."""
        self._asked = self._found = None

    def of(
        self, problem: Quadratic, which: Collection[int] | None, changed: list[int] | None
    ) -> tuple[Quadratic, list[int] | None]:
        """The problem ``softened``, and the blocks that differ from the last one.

        Parameters
        ----------
        problem
            The problem with exact rows.
        which
            Blocks whose exact rows become soft; None for all.
        changed
            Blocks of ``problem`` that differ from the last one; None for all.
        """
        wanted, asked, found = None if which is None else frozenset(which), self._asked, self._found
        self._asked = problem
        if changed is None or asked is None or found is None or (wanted is None) != (self._which is None):
            self._which, self._unit = wanted, unit_of(problem)
            self._found = softened(problem, which)
            return self._found, changed
        self._which = wanted
        anew = set(changed)
        if any(problem.blocks[k].weights is not asked.blocks[k].weights for k in changed):
            unit = unit_of(problem)
            if unit != self._unit:
                # Elastic weights are relative to the median, so all soft blocks change with it.
                self._unit, found = unit, replace(found, cell_unit=unit)
                soft = range(len(problem.blocks)) if wanted is None else wanted
                anew |= {k for k in soft if problem.blocks[k].any_exact}
        for k in sorted(anew):
            block, before = problem.blocks[k], found.blocks[k]
            if wanted is None or k in wanted:
                block = _softened(problem, k, self._unit)
                # A dragged color does not change the weights, nor the results that were computed from them.
                if block.rows is before.rows and np.array_equal(block.weights, before.weights):
                    block = before.with_targets(block.targets)
            found = found.with_block(k, block)
        self._found = found
        return found, sorted(anew)
