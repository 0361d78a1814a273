# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra that exact cells make black: the samples that must be 0, found before any engine.

Under a lamp whose power falls off without an end, as that of an LED, the coefficients of a black cell run from 1 to
1e-300, and the multipliers of its rows to the inverse. No engine has an answer in these digits, and none is needed:
colors of lights and reflectances of at least 0 are sums of positive parts, so that black leaves each part 0.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.block import Block
from spectral_core.palette.qp.quadratic import FAR, Quadratic
from spectral_core.spectra.color import XYZ_FROM_RGB

Array = NDArray[np.float64]

UNSEEN = 1e-10
"""Color, in linear RGB, of all samples together that are not held at 0: a tenth of what the check allows."""
ROUNDING = 1e-12
"""Share of a row's largest coefficient in XYZ below 0 that is rounding."""


def dark(problem: Quadratic) -> Quadratic | None:
    """The problem with the samples at 0 that exact black cells leave no other value, and without the rows that hold
    then; None if it has no such cells.
    """
    blocks = [_dark(block) for block in problem.blocks]
    if all(one is two for one, two in zip(blocks, problem.blocks, strict=True)):
        return None
    return Quadratic(
        tuple(blocks),
        problem.color_lower,
        problem.color_upper,
        problem.known_ties,
        problem.known_targets,
        problem.known_weights,
        problem.cell_unit,
    )


def _dark(block: Block) -> Block:
    if (block.lower != 0).any() or not block.any_exact:
        return block
    for number in range(len(block.keys)):
        at = slice(3 * number, 3 * number + 3)
        if block.exact[at].all() and not block.targets[at].any() and not block.ties[at].any():
            block = _without_light(block, at)
    return block


def _without_light(block: Block, at: slice) -> Block:
    """A block with the samples at 0 that the three rows of a black cell show."""
    parts = XYZ_FROM_RGB @ block.rows[at]
    if parts.min() < -ROUNDING * np.abs(parts).max():
        return block  # a light with negative power
    shown = np.abs(block.rows[at]).max(axis=0) * np.minimum(block.upper, FAR)
    order = np.argsort(shown, kind="stable")
    is_seen = np.zeros(len(shown), dtype=bool)
    is_seen[order] = np.cumsum(shown[order]) > UNSEEN
    rows, weights = block.rows.copy(), block.weights.copy()
    rows[at], weights[at] = 0.0, 0.0
    return replace(block, rows=rows, weights=weights, upper=np.where(is_seen, 0.0, block.upper))
