# SPDX-License-Identifier: GPL-3.0-or-later
"""A transfer table on the device: one small record per segment, found through a guide.

The guide divides the stored values above the first knot into cells of equal *ratio*: the upper bits of a float32 are
such a scale, and reading them costs a shift. So knots at 10, 100, … 1e6 have cells of their own, as evenly spaced ones
do. A cell stores its first segment; a comparison, or a bisection of a few if knots are dense, finds the segment
exactly. Rounding cannot affect it: every operation from the value to the cell is monotone, and the same operations are
applied to knots.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.march.arithmetic import larger, smaller
from spectral_core.volume.march.device.voxels import DeviceVolume, aligned, opaque
from spectral_core.volume.march.tables import TransferTable

Floats = NDArray[np.float32]
_PACKET = 8  # numbers per gather of a record; packets are padded to powers of two
_MOST_CELLS = 4096  # of the guide: 32 kB; more only for more knots
_ENDLESS = 1e30  # stored units


@dataclass(frozen=True)
class Guide:
    """Cells over float32 bits: ``first`` (cells,) is the first segment that may lie in each.

    A value x is in cell (bits(max(x - ``origin``, ``least``)) >> ``shift``) - ``offset``, at most the last one.
    ``probes`` comparisons find the segment: 2^probes - 1 knots at most share a cell.
    """

    origin: np.float32
    least: np.float32
    shift: int
    offset: int
    first: NDArray[np.int64]
    probes: int

    @classmethod
    def of(cls, knots: Floats) -> Guide:
        """The coarsest guide over increasing ``knots`` (n,) in which no two share a cell; else the best one."""
        above = knots - knots[0]
        positive = above[above > 0]
        # Distances below half the least one need not be distinguished; the scale of ratios would have no end there.
        least = np.float32(0.5 * positive.min()) if len(positive) else np.float32(1.0)
        least = max(least, np.float32(1e-30))
        # For positive floats the order of the bit patterns is the order of the numbers.
        bits = np.maximum(above, least).view(np.uint32).astype(np.int64)
        lowest = int(np.array(least).view(np.uint32))
        best: tuple[int, int, NDArray[np.int64]] | None = None
        # Each further bit of the mantissa doubles the cells; the first guide in which no two knots share one is taken.
        for mantissa in range(2, 17):
            shift = 23 - mantissa
            cell = (bits >> shift) - (lowest >> shift)
            cells = int(cell[-1]) + 1
            if best is not None and cells > max(_MOST_CELLS, 4 * len(knots)):
                break
            crowd = int(np.bincount(cell).max())
            if best is None or crowd.bit_length() < best[0]:
                best = crowd.bit_length(), shift, np.searchsorted(cell, np.arange(cells))
            if crowd == 1:
                break
        assert best is not None
        return cls(knots[0], least, best[1], lowest >> best[1], best[2], best[0])


@dataclass(frozen=True)
class Segment:
    """The segment of a stored value on the device: its ``index``, its ``record``, and the distance of the value from
    its anchor.
    """

    index: Any
    part: Any
    record: list[Any]


class DeviceTable:
    """A transfer table in a field's stored units; ``find(x)`` reads one segment.

    A record contains the anchor, the empty flag of the segment, the values and rises of the columns and, with
    ``integrals``, their integrals from stored value 0 to the anchor. They start there because float32 is finest there.
    """

    def __init__(self, types: Any, table: TransferTable, volume: DeviceVolume, *, integrals: bool) -> None:
        self.types, self.table = types, table
        self.columns = table.values.shape[1]

        def stored(values: Any) -> Any:
            return (values - volume.base) / volume.unit

        # If nothing is visible at all, the anchor is infinitely far; float32 products need a finite number.
        anchors = np.where(np.isfinite(table.anchors), stored(table.anchors), -_ENDLESS)
        blocks = [anchors[:, None], table.is_empty[:, None], table.values, table.rises * volume.unit]
        if integrals:
            # Integrals are differences of large sums elsewhere; at stored value 0, the densest part of float32, they
            # are small.
            origin = float(np.clip(volume.base, table.knots[0], table.knots[-1]))
            blocks.append((table.integrals - _integral(table, origin)) / volume.unit)
        with np.errstate(over="ignore"):  # two knots that float32 cannot tell apart: a jump, whose rise is not read
            records = np.hstack(blocks).astype(np.float32)
        parts = [_padded(records[:, start : start + _PACKET]) for start in range(0, records.shape[1], _PACKET)]
        self.widths = [part.shape[1] for part in parts]
        self.stores: list[Any] = [types.Float(aligned(part.ravel())) for part in parts]
        ends = table.values + table.rises * _widths(table)
        # Heights determine the effect of a rounding error, see ``column_means``.
        self.heights = opaque(types.Float, np.maximum(table.values, ends).max(axis=0))
        self._upload_guide(stored(table.knots).astype(np.float32))

    def _upload_guide(self, knots: Floats) -> None:
        types, guide = self.types, Guide.of(knots)
        self.probes = guide.probes
        # Probes may read past the last knot: every value is below the padding.
        padded = np.concatenate([knots, np.full(1 << guide.probes, np.inf, np.float32)])
        threshold = padded[guide.first + (1 << guide.probes - 1) - 1]
        self.guide = types.Float(aligned(np.column_stack([threshold, guide.first]).astype(np.float32).ravel()))
        self.knots = types.Float(padded)
        self.origin, self.least = opaque(types.Float, [guide.origin, guide.least])
        self.shift, self.offset, self.last = opaque(types.UInt32, [guide.shift, guide.offset, len(guide.first) - 1])

    def find(self, x: Any, active: Any = True) -> Segment:
        """The segment of the stored value ``x``."""
        import drjit as dr

        types = self.types
        # Values at or below the first knot fall into the first cell instead of below it.
        bits = dr.reinterpret_array(types.UInt32, larger(x - self.origin, self.least))
        cell = smaller((bits >> self.shift) - self.offset, self.last)
        # Threshold and first segment in one packet: one memory access serves the usual cell with one knot.
        entry = dr.gather(types.ArrayXf, self.guide, cell, active, shape=(2, dr.width(x)))
        step = 1 << self.probes - 1
        index = types.UInt32(entry[1]) + dr.select(x >= entry[0], types.UInt32(step), types.UInt32(0))
        while step > 1:
            step >>= 1
            knot = dr.gather(types.Float, self.knots, index + (step - 1), active)
            index += dr.select(x >= knot, types.UInt32(step), types.UInt32(0))
        record: list[Any] = []
        for width, store in zip(self.widths, self.stores, strict=True):
            packet = dr.gather(types.ArrayXf, store, index, active, shape=(width, dr.width(x)))
            record += [packet[i] for i in range(width)]
        return Segment(index, x - record[0], record)

    def column_values(self, segment: Segment, part: Any) -> list[Any]:
        """Columns at ``part`` from the segment's anchor."""
        import drjit as dr

        c, record = self.columns, segment.record
        return [dr.fma(part, record[2 + c + k], record[2 + k]) for k in range(c)]

    def clearance(self, segment: Segment) -> Any:
        """Distance in stored units to the next visible value; zero if this one is visible."""
        import drjit as dr

        return dr.abs(segment.part) * segment.record[1]

    def from_visible(self, segment: Segment) -> Any:
        """How far the stored value is above the nearest visible one; zero if it is visible."""
        return segment.part * segment.record[1]

    def running_integrals(self, segment: Segment) -> list[Any]:
        """Integral of each column from stored value 0: quadratic inside the segment, so exact."""
        import drjit as dr

        c, record, part = self.columns, segment.record, segment.part
        return [
            dr.fma(part, dr.fma(part * 0.5, record[2 + c + k], record[2 + k]), record[2 + 2 * c + k]) for k in range(c)
        ]


def _integral(table: TransferTable, at: float) -> NDArray[np.float64]:
    """Integral of the columns from the first knot to the data value ``at``."""
    i = int(np.searchsorted(table.knots, at, side="right"))
    part = 0.0 if table.is_empty[i] else at - table.anchors[i]
    integral: NDArray[np.float64] = table.integrals[i] + part * (table.values[i] + 0.5 * part * table.rises[i])
    return integral


def _widths(table: TransferTable) -> NDArray[np.float64]:
    """Width of each segment (n, 1); 0 for the two unbounded ones, which are constant."""
    return np.concatenate([[0.0], np.diff(table.knots), [0.0]])[:, None]


def _padded(columns: Floats) -> Floats:
    width = 1 << (columns.shape[1] - 1).bit_length()
    return np.pad(columns, ((0, 0), (0, width - columns.shape[1])))
