# SPDX-License-Identifier: GPL-3.0-or-later
"""One block of an arrow system in squares, in the free colors that it depends on, and sums over all blocks.

A large table has many free colors, and each spectrum depends on a few of them. Arrays of all colors for each block
would grow with the cube of the number of materials.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.block import Block

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Numbers = NDArray[np.intp] | slice
"""Numbers of some free colors; ``ALL`` of them."""
Index = tuple[Numbers, ...]
Part = tuple[Index, Array]

ALL = slice(None)
MOST_DENSE = 64
"""Most free colors of a palette whose blocks count with all of them: a sum of whole arrays takes less time."""
RIDGE = 1e-13
"""Added to the diagonal of H, relative to its mean: spectra without smoothness have no unique minimum."""


@dataclass(slots=True)
class Spectrum:
    """One block in squares; ``arrow`` has the letters. Weights are divided by the median weight."""

    hessian: Array
    linear: Array
    ties: Array
    border: Array
    border_target: Array
    border_ties: Array
    compliance: Array
    in_border: Mask
    """Rows of the block that have a border row."""
    weights: Array
    """ω in H, (m,)."""
    color_hessian: Array
    color_linear: Array
    colors: Numbers
    """Free colors of ``ties``, ``border_ties``, ``color_hessian`` and ``color_linear``; the block has no other."""
    largest: float
    """Largest curvature, max of the diagonal of H."""


def squared(block: Block, unit: float, cap: float) -> Spectrum:
    """A block's rows as squares and border rows; weights relative to ``unit``, in H at most ``cap``."""
    relative = block.weights / unit
    exact = np.isinf(relative)
    # An exact row also counts in H, with the median weight: its error is 0 at the answer, and it keeps H regular.
    weights = np.where(exact, 1.0, np.minimum(relative, cap))
    in_border = exact | (relative > cap)
    weighted = weights[:, None] * block.rows
    hessian = weighted.T @ block.rows + block.gram / unit
    # Relative to the mean of the diagonal, which is positive; 1e-12 for a block without rows.
    hessian.flat[:: len(hessian) + 1] += RIDGE * max(float(hessian.trace()) / len(hessian), 1e-12)
    colors = colors_of(block)
    ties = block.ties[:, colors]
    tied = weights[:, None] * ties
    with np.errstate(divide="ignore"):
        # The weight cap in H and the weight ω − cap of the border row add up to ω.
        compliance = np.where(exact, 0.0, 1.0 / (relative - weights))[in_border]
    return Spectrum(
        hessian,
        -(block.targets @ weighted),
        ties.T @ weighted,
        block.rows[in_border],
        block.targets[in_border],
        ties[in_border],
        compliance,
        in_border,
        weights,
        tied.T @ ties,
        -(block.targets @ tied),
        colors,
        float(hessian.diagonal().max(initial=0.0)),
    )


def retargeted(before: Spectrum, block: Block) -> Spectrum:
    """The squares of a block whose targets alone changed: H and its factors stay."""
    # Only right-hand sides are computed: O(m n), where H costs O(m n²).
    pushes = before.weights * block.targets
    return Spectrum(
        before.hessian,
        -(pushes @ block.rows),
        before.ties,
        before.border,
        block.targets[before.in_border] if len(before.border) else before.border_target,
        before.border_ties,
        before.compliance,
        before.in_border,
        before.weights,
        before.color_hessian,
        -(pushes @ block.ties[:, before.colors]),
        before.colors,
        before.largest,
    )


def colors_of(block: Block) -> Numbers:
    """The free colors that a block's rows depend on; all of them where they are few."""
    if block.ties.shape[1] <= MOST_DENSE:
        return ALL
    colors = block.ties.any(axis=0).nonzero()[0]
    return ALL if colors.size == block.ties.shape[1] else colors


def with_constant(colors: Numbers) -> Numbers:
    """The places of a constant and of some colors after it."""
    return colors if isinstance(colors, slice) else np.concatenate([[0], 1 + colors])


def across(rows: Numbers, columns: Numbers) -> Index:
    """The index of some rows and columns of a matrix."""
    if isinstance(rows, slice) or isinstance(columns, slice):
        return rows, columns
    return np.ix_(rows, columns)


class SumOfBlocks:
    """A constant and the array of each block, at its own index of the constant; None for an array of zeros."""

    def __init__(self, constant: Array, parts: Sequence[Part | None]) -> None:
        self._constant, self._parts = constant, list(parts)
        self._stack: Array | None = None
        if len(constant) <= MOST_DENSE:
            zeros = np.zeros(constant.shape)
            self._stack = np.array([constant, *(zeros if part is None else part[1] for part in parts)])

    def put(self, k: int, at: Index, values: Array) -> None:
        """Set the array of block ``k``, which is not copied, and its index ``at``."""
        if self._stack is None:
            self._parts[k] = at, values
        else:
            self._stack[1 + k] = values

    def exchange(self, k: int, at: Index, values: Array, total: Array) -> None:
        """``put`` a copy; ``total``, a sum with the earlier array of the block, becomes one with the new array."""
        total[at] += values
        if self._stack is not None:
            total -= self._stack[1 + k]
            self._stack[1 + k] = values
            return
        before = self._parts[k]
        if before is not None:
            total[before[0]] -= before[1]
        self._parts[k] = at, values.copy()

    def total(self) -> Array:
        """The sum."""
        if self._stack is not None:
            return np.asarray(self._stack.sum(axis=0))
        found = self._constant.copy()
        for part in self._parts:
            if part is not None:
                found[part[0]] += part[1]
        return found
