# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact rows that cannot all hold, as heavy ones: the nearest compromise, with the cells' relative weights."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from spectral_core.palette.qp.arrow import median_weight
from spectral_core.palette.qp.feasibility import can_hold
from spectral_core.palette.qp.quadratic import Quadratic

ELASTIC = 1e4
"""Weight, relative to the median, of exact rows that cannot hold together."""
LEAST_ELASTIC = 1e-2
"""Least squared weight of an exact row among other exact ones, relative to the median."""


def softened(problem: Quadratic, which: Collection[int] | None = None, *, everything: bool = False) -> Quadratic:
    """The problem with the exact rows of cells, in all blocks or in some, as heavy ones.

    Rows that are no cells (the white of a light, the energy of a dye) stay exact if they can hold by themselves, unless
    ``everything`` must be soft.
    """
    unit = median_weight(problem)[0]
    blocks = list(problem.blocks)
    for k in range(len(blocks)) if which is None else which:
        block = blocks[k]
        soft = block.exact.copy()
        if not everything and soft[3 * len(block.keys) :].any() and can_hold(problem, k, cells=False):
            soft[3 * len(block.keys) :] = False
        # Rows keep their relative importance, but none may become so light that it is ignored.
        among = 1.0 if block.own_weights is None else np.maximum(block.own_weights / unit, LEAST_ELASTIC)
        blocks[k] = replace(block, weights=np.where(soft, ELASTIC * unit * among, block.weights))
    return replace(problem, blocks=tuple(blocks))
