# SPDX-License-Identifier: GPL-3.0-or-later
"""A transfer function as the tables that the march reads: node values, slopes and running integrals."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.transfer import TransferFunction

Array = NDArray[np.float64]
_FEWEST, _MOST = 1024, 1 << 14
_ERROR = 1e-4  # of the curve's root mean square; the table is refined until it is met


@dataclass(frozen=True, eq=False)
class TransferTable:
    """Columns of a transfer function at equally spaced data values.

    ``low`` and ``high`` are the data values of the first and last node (the part of the knots' span that the data
    reach). ``columns`` (nodes, C) holds the source of each material; behind them, where some material emits, the
    total extinction (else that is the sum of the sources). A two-dimensional function has the extinction of each
    material first, then the emission of each, and ``weights`` (nodes, K) over ``gradient_high`` (from 0).
    """

    low: float
    high: float
    columns: Array
    materials: int
    support: tuple[tuple[float, float, bool, bool], ...] = ()
    """Data values that show something: intervals (from, to) and whether either end does."""
    gradient_high: float = 0.0
    weights: Array | None = None

    @property
    def cells(self) -> int:
        """Number of intervals between nodes."""
        return len(self.columns) - 1

    @cached_property
    def nodes_with_slopes(self) -> NDArray[np.float32]:
        """(nodes + 1, 2C): value and rise per cell, for cell k at row k + 1; rows 0 and last extend constantly."""
        return _extended(self.columns)

    @cached_property
    def clearance(self) -> NDArray[np.float32]:
        """(nodes + 1, 2): distance in cells to the next cell that shows anything, and its rise; rows as above.

        Linear inside each cell, and there never more than the true distance.
        """
        from scipy import ndimage

        shown = (self.columns > 0).any(axis=1)
        if not shown.any():
            return np.tile(np.array([[1e9, 0.0]], np.float32), (len(shown) + 1, 1))
        near = shown.copy()
        near[1:] |= shown[:-1]
        near[:-1] |= shown[1:]
        distance = ndimage.distance_transform_edt(~near)
        rise = np.concatenate([[shown[0] - 1.0], np.diff(distance), [1.0 - shown[-1]]])
        return np.column_stack([np.append(distance[:1], distance), rise]).astype(np.float32)

    @cached_property
    def integrals(self) -> Array:
        """(nodes, C): ∫ of the columns from the first node, in cells, exact for the piecewise linear columns."""
        pieces = 0.5 * (self.columns[1:] + self.columns[:-1])
        return np.vstack([np.zeros(self.columns.shape[1]), np.cumsum(pieces, axis=0)])


def tabulate(transfer: TransferFunction, volume: ScalarVolume, gradient_high: float = 0.0) -> TransferTable:
    """Table of ``transfer`` over the values that ``volume`` holds, fine enough to stand for the exact curves.

    ``gradient_high`` is the greatest gradient magnitude of the field in data units per world unit, for a
    two-dimensional function. The node count grows from 1024 until the table differs from the curves by less
    than 1e-4 (root mean square, relative) or 16384 cells are reached, as at a jump.
    """
    low, high = _span(transfer, volume)
    count = _FEWEST
    while True:
        columns = _columns(transfer, np.linspace(low, high, count + 1))
        if count >= _MOST or _table_error(transfer, low, high, columns) < _ERROR:
            break
        count *= 4
    weights = None
    if transfer.uses_gradient:
        at = np.linspace(0.0, max(gradient_high, 1e-30), 4 * _FEWEST + 1)
        weights = np.stack([material.weight(at) for material in transfer.materials], axis=-1)
    return TransferTable(low, high, columns, len(transfer.materials), support(transfer), gradient_high, weights)


def support(transfer: TransferFunction) -> tuple[tuple[float, float, bool, bool], ...]:
    """Intervals of data values where some material has extinction or emission, exactly (gradient weights aside)."""
    pieces = []
    for m in transfer.materials:
        height = m.extinction + (0.0 if m.emission is None else m.emission)
        knots, heights = m.values.tolist(), height.tolist()
        ends = [(-np.inf, knots[0], heights[0], heights[0]), (knots[-1], np.inf, heights[-1], heights[-1])]
        inner = zip(knots, knots[1:], heights, heights[1:], strict=False)
        pieces += [(a, b, left > 0, right > 0) for a, b, left, right in [*ends, *inner] if max(left, right) > 0]
    return tuple(sorted(set(pieces)))


def _span(transfer: TransferFunction, volume: ScalarVolume) -> tuple[float, float]:
    low, high = volume.value_range
    first = min(float(material.values[0]) for material in transfer.materials)
    last = max(float(material.values[-1]) for material in transfer.materials)
    start, end = min(max(low, first), high), max(min(high, last), low)
    start, end = min(start, end), max(start, end)
    if end <= start:
        margin = max(abs(start), 1e-30) * 1e-3
        return start - margin, end + margin
    # The ends are nodes, so a background that lies on the first knot gets exactly its height. A jump there needs
    # nodes on both of its sides.
    margin = (end - start) / 1024
    jumps = [m for m in transfer.materials if len(m.values) > 1]
    before = any(m.values[0] == m.values[1] == start for m in jumps)
    after = any(m.values[-1] == m.values[-2] == end for m in jumps)
    return start - margin * before, end + margin * after


def _columns(transfer: TransferFunction, values: Array) -> Array:
    taken, source = _flat_curves(transfer, values)
    if transfer.uses_gradient:
        return np.hstack([taken, source - taken])
    return np.hstack([source, taken.sum(-1, keepdims=True)]) if transfer.has_emission else source


def _flat_curves(transfer: TransferFunction, values: Array) -> tuple[Array, Array]:
    """The curves over the value alone: a two-dimensional function with its weights left out."""
    from dataclasses import replace

    flat = [replace(m, gradient_values=None, gradient_weights=None) for m in transfer.materials]
    return TransferFunction(tuple(flat), transfer.wavelengths_nm).curves(values)


def _table_error(transfer: TransferFunction, low: float, high: float, columns: Array) -> float:
    """Root mean square difference at places between nodes, over the root mean square of the curves."""
    cells = len(columns) - 1
    part = np.random.default_rng(0).random(cells)
    exact = _columns(transfer, low + (high - low) * (np.arange(cells) + part) / cells)
    linear = columns[:-1] + part[:, None] * (columns[1:] - columns[:-1])
    scale = np.sqrt(np.mean(exact**2, axis=0))
    error = np.sqrt(np.mean((exact - linear) ** 2, axis=0))
    return float(np.max(error / np.where(scale > 0, scale, 1.0)))


def _extended(columns: Array) -> NDArray[np.float32]:
    rise = np.diff(columns, axis=0)
    level = np.zeros((1, columns.shape[1]))
    values = np.vstack([columns[:1], columns])
    return np.hstack([values, np.vstack([level, rise, level])]).astype(np.float32)
