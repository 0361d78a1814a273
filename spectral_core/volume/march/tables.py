# SPDX-License-Identifier: GPL-3.0-or-later
"""A transfer function as an exact table: one linear segment between two neighboring knots of any of its materials.

Nothing is sampled. A few records represent the function over any range of data, however narrow a peak is relative to
the range: a density over six decades, or one voxel of 1e6 in a field of 0 to 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.transfer import Material, TransferFunction, interpolate

LEAST_WIDTH = 1e-305
"""Least difference of two data values that quotients are formed with, so that these are doubles."""

Array = NDArray[np.float64]
Curves = Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class TransferTable:
    """Linear segments over the data value: segment i lies between ``knots[i - 1]`` and ``knots[i]``.

    ``knots`` (n,) increase; the first segment reaches down without end, the last one up. At a knot itself the later
    segment counts. A segment's columns are ``values`` + ``rises``·(v - ``anchors``), arrays (n + 1, C), (n + 1, C)
    and (n + 1,); ``integrals`` (n + 1, C) are those of the columns from the first knot to the anchor.

    Columns are the source of each material and behind them, where some material emits, the total extinction (else that
    is the sum of the sources). A two-dimensional function has the extinction of each material first, then the
    emission of each, and the table ``weights`` of the materials' weights over the gradient magnitude.

    Where ``is_empty`` (n + 1,), no column is visible, and the anchor is the nearest visible data value: so |v - anchor|
    is the distance to it, and an empty interval between two peaks consists of two segments.
    """

    knots: Array
    anchors: Array
    values: Array
    rises: Array
    integrals: Array
    is_empty: NDArray[np.bool_]
    materials: int
    support: tuple[tuple[float, float, bool, bool], ...] = ()
    """Visible data values: intervals (from, to) with a flag for each end."""
    weights: TransferTable | None = None

    @property
    def segments(self) -> int:
        """Number of segments, one more than there are knots."""
        return len(self.anchors)

    def columns_at(self, values: Array) -> Array:
        """Columns (..., C) at data values of any shape."""
        segment = np.searchsorted(self.knots, values, side="right")
        part = np.where(self.is_empty[segment], 0.0, np.asarray(values) - self.anchors[segment])
        columns: Array = self.values[segment] + self.rises[segment] * part[..., None]
        return columns


def tabulate(transfer: TransferFunction, volume: ScalarVolume, gradient_high: float = 0.0) -> TransferTable:
    """Build the exact table of ``transfer`` over the values that ``volume`` holds.

    Parameters
    ----------
    transfer
        The transfer function.
    volume
        The field; knots beyond its least and greatest value are left out, since no ray meets them.
    gradient_high : float
        Greatest gradient magnitude of the field in data units per world unit, for a two-dimensional function.
    """
    flat = replace(
        transfer,
        # The gradient's weights are a table of their own, so this one depends on the data value alone.
        materials=tuple(replace(m, gradient_values=None, gradient_weights=None) for m in transfer.materials),
    )
    low, high = volume.value_range
    knots = np.concatenate([m.values for m in transfer.materials])
    mirrored = replace(flat, materials=tuple(_mirrored(m) for m in flat.materials))
    table = _segments(
        _between(knots, low, high),
        lambda v: _columns(transfer, *flat.curves(v)),
        # At a jump a curve gives its limit from the right, so the mirrored curve at -v gives that from the left.
        lambda v: _columns(transfer, *mirrored.curves(-v)),
        len(transfer.materials),
    )
    weights = _weights(transfer, gradient_high) if transfer.uses_gradient else None
    return replace(table, support=support(transfer), weights=weights)


def support(transfer: TransferFunction) -> tuple[tuple[float, float, bool, bool], ...]:
    """Intervals of data values where some material has extinction or emission, exactly (gradient weights aside)."""
    pieces = []
    for m in transfer.materials:
        height = m.extinction + (0.0 if m.emission is None else m.emission)
        knots, heights = m.values.tolist(), height.tolist()
        # Beyond its knots a function keeps its end heights without limit.
        ends = [(-np.inf, knots[0], heights[0], heights[0]), (knots[-1], np.inf, heights[-1], heights[-1])]
        inner = zip(knots, knots[1:], heights, heights[1:], strict=False)
        pieces += [(a, b, left > 0, right > 0) for a, b, left, right in [*ends, *inner] if max(left, right) > 0]
    return tuple(sorted(set(pieces)))


def _mirrored(material: Material) -> Material:
    emission = None if material.emission is None else material.emission[::-1]
    return replace(material, values=-material.values[::-1], extinction=material.extinction[::-1], emission=emission)


def _weights(transfer: TransferFunction, highest: float) -> TransferTable:
    """Weights of the materials over the gradient magnitude, from 0 to ``highest``."""
    pairs = []
    for m in transfer.materials:
        if m.gradient_values is None or m.gradient_weights is None:
            pairs.append((np.zeros(1), np.ones(1)))
        else:
            pairs.append((m.gradient_values, m.gradient_weights))

    def after(v: Array) -> Array:
        return np.stack([interpolate(v, at, heights) for at, heights in pairs], axis=-1)

    def before(v: Array) -> Array:
        return np.stack([interpolate(-v, -at[::-1], heights[::-1]) for at, heights in pairs], axis=-1)

    knots = np.concatenate([at for at, _ in pairs])
    return _segments(_between(knots, 0.0, highest), after, before, len(pairs))


def _columns(transfer: TransferFunction, extinction: Array, source: Array) -> Array:
    if transfer.uses_gradient:
        return np.concatenate([extinction, source - extinction], axis=-1)
    if transfer.has_emission:
        return np.concatenate([source, extinction.sum(-1, keepdims=True)], axis=-1)
    return source


def _between(knots: Array, low: float, high: float) -> Array:
    """The knots between ``low`` and ``high``, and these two, each once."""
    return np.unique(np.concatenate([[low, high], knots[(knots > low) & (knots < high)]]))


def _segments(knots: Array, after: Curves, before: Curves, materials: int) -> TransferTable:
    """Table over ``knots``; ``after`` and ``before`` are the columns' limits from the right and from the left."""
    right, left = after(knots), before(knots)
    width = np.diff(knots)[:, None]
    # The columns are linear between knots, so the trapezoid rule is exact.
    cumulative = np.vstack([np.zeros(right.shape[1]), np.cumsum(0.5 * (right[:-1] + left[1:]) * width, axis=0)])
    # Outside the knots the columns are level: no rise.
    level = np.zeros((1, right.shape[1]))
    with np.errstate(over="ignore"):
        rises = (left[1:] - right[:-1]) / width
    rises = np.where(np.isfinite(rises), rises, 0.0)  # between values as near as 1e-308, a step
    table = TransferTable(
        knots,
        np.concatenate([knots[:1], knots]),
        np.vstack([right[:1], right]),
        np.vstack([level, rises, level]),
        np.vstack([cumulative[:1], cumulative]),
        ~np.concatenate(
            [(right[:1] > 0).any(-1), ((right[:-1] > 0) | (left[1:] > 0)).any(-1), (right[-1:] > 0).any(-1)]
        ),
        materials,
    )
    return _with_merged_empties(table)


def _with_merged_empties(table: TransferTable) -> TransferTable:
    """Each run of empty segments as two that are anchored at its ends, or one if the run is unbounded."""
    bounds = np.concatenate([[-np.inf], table.knots, [np.inf]])
    rows: list[int] = []
    anchors: list[float] = []
    starts: list[float] = []
    i = 0
    while i < table.segments:
        if not table.is_empty[i]:
            rows, anchors, starts = [*rows, i], [*anchors, float(table.anchors[i])], [*starts, float(bounds[i])]
            i += 1
            continue
        end = i
        # A run of empty segments is one gap; only its two ends matter to the distance.
        while end < table.segments and table.is_empty[end]:
            end += 1
        low, high = float(bounds[i]), float(bounds[end])
        near, far = np.isfinite(low), np.isfinite(high)
        if near or not far:  # visible values are below, or there are none: then the distance to them is infinite
            rows, anchors, starts = [*rows, i], [*anchors, low], [*starts, low]
        if far:
            # Halves are added, not the sum halved, which might overflow. Below the middle the lower end is the nearer
            # one.
            middle = 0.5 * low + 0.5 * high if near else low
            rows, anchors, starts = [*rows, i], [*anchors, high], [*starts, middle]
        i = end
    kept = np.array(rows)
    knots = np.array(starts[1:])
    # The guide needs at least one knot; in a table of one segment its position has no effect.
    if not len(knots):
        kept, anchors, knots = np.repeat(kept, 2), anchors * 2, table.knots[:1]
    return replace(
        table,
        knots=knots,
        anchors=np.array(anchors),
        values=table.values[kept],
        rises=table.rises[kept],
        integrals=table.integrals[kept],
        is_empty=table.is_empty[kept],
    )
