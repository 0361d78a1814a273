# SPDX-License-Identifier: GPL-3.0-or-later
"""Step rules: one word per brick, for a field and a transfer function.

A positive number is the relative step in voxels, to be multiplied by the step scale. In `error`'s, the lower 16 bits
hold another, the upper half of a float32: how far at least a ray goes while the data value moves by one cell of the
transfer table. Values that are many cells away from all that shows are thus passed in few steps, as in sphere tracing
(Hart 1996), however fine the brick's own step is. Where a brick shows nothing, the sign bit is set and the others hold,
in three bits for each octant of ray directions, how large a cube of bricks ahead is empty too (``LEAPS``), so a ray
leaves a surface in one leap although the surface is near behind it. All rules fill the same grid, and one march reads
it, with one gather per turn.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.march.bricks import BrickStatistics
from spectral_core.volume.march.tables import TransferTable

Rule = Literal["uniform", "thesis", "error"]
RULES: tuple[Rule, ...] = ("uniform", "thesis", "error")
SHORTEST_STEP = 0.01  # voxels: the thesis' "hundred times the frequency of the data grid"
_BINS = 512
LEAPS = (1, 2, 4, 7, 11, 16, 22, 29)  # bricks: 1 + l(l+1)/2; each at most twice the one before
EMPTY = np.uint32(1 << 31)


@dataclass(frozen=True, eq=False)
class StepGrid:
    """Steps and leaps of one rule: ``words`` (bz, by, bx) as the module says, float32 or bits, as uint32.

    ``longest`` is the longest step in voxels that the rule allows (its statistics hold no further than that).
    ``adapts`` says that the step grows as T^(-5/16), where light from further on hardly counts, and that words tell how
    far a ray may go through values that show nothing. ``first`` is the relative step that a midpoint march makes in the
    same turn as a leap, before it knows the brick where that ends.
    """

    rule: Rule
    edge: int
    centred: bool
    words: NDArray[np.uint32]
    longest: float
    adapts: bool
    first: float

    def bounds(self, shape: tuple[int, int, int]) -> tuple[list[float], list[float]]:
        """Index box (low, high), x first, of the bricks that show something in a field of ``shape`` voxels.

        Empty (low above high) where nothing shows: rays then end before they begin.
        """
        filled = self.words < EMPTY
        low, high = [], []
        for axis, voxels in enumerate(shape):
            others = tuple(a for a in range(3) if a != 2 - axis)
            at = np.flatnonzero(filled.any(axis=others))
            if not len(at):
                return [1.0] * 3, [0.0] * 3
            shift = 0.5 if self.centred else 0.0
            low.append(-0.5 if at[0] == 0 else at[0] * self.edge - shift)
            high.append(voxels - 0.5 if at[-1] == filled.shape[2 - axis] - 1 else (at[-1] + 1) * self.edge - shift)
        return low, high


@dataclass(frozen=True, eq=False)
class RangeTables:
    """What a transfer function does between two data values: arrays (bins, bins) read at [lowest, highest].

    ``slope`` is the steepest rise of opacity-saturated source per data unit,
    ``kink`` the greatest change of that rise. Saturated (1 - exp(-σ·voxel)): more extinction than fills a voxel
    cannot make a picture rougher.
    """

    table: TransferTable
    voxel: float

    def shows(self, low: NDArray[np.float32], high: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Whether anything is seen at some value between ``low`` and ``high``; exact, as narrow as a peak may be."""
        seen = np.zeros(low.shape, bool)
        for start, end, at_start, at_end in self.table.support:
            above = (high >= start) if at_start else (high > start)
            seen |= above & ((low <= end) if at_end else (low < end))
        return seen

    def leaps(self, statistics: BrickStatistics) -> tuple[NDArray[np.bool_], NDArray[np.uint32]]:
        """(bricks that show something, leap words of all bricks); kept, since every rule's grid starts from them."""
        key = (statistics.edge, statistics.centred)
        if key not in self._leaps:
            shows = self.shows(statistics.low, statistics.high)
            self._leaps[key] = (shows, leap_words(shows))
        return self._leaps[key]

    @cached_property
    def _leaps(self) -> dict[tuple[int, bool], tuple[NDArray[np.bool_], NDArray[np.uint32]]]:
        return {}

    @cached_property
    def _rises(self) -> NDArray[np.float64]:
        """Rise of each saturated column per data unit, per bin: (bins, K)."""
        at = np.linspace(0, self.table.cells, _BINS + 1)
        columns = np.stack([np.interp(at, np.arange(self.table.cells + 1), c) for c in self.table.columns.T], axis=-1)
        k = self.table.materials
        extinction = columns.sum(-1) if columns.shape[1] == k else columns[:, k:].sum(-1)
        if self.table.weights is not None:
            extinction, columns = columns[:, :k].sum(-1), columns[:, :k] + columns[:, k:]
        depth = extinction * self.voxel
        reach = np.where(depth > 1e-6, -np.expm1(-depth) / np.where(depth > 0, depth, 1.0), 1.0)
        seen = columns[:, :k] * (reach * self.voxel)[:, None]
        return np.diff(seen, axis=0) / ((self.table.high - self.table.low) / _BINS)

    @cached_property
    def slope(self) -> NDArray[np.float64]:
        return _over_ranges(np.abs(self._rises).sum(-1), np.maximum)

    @cached_property
    def kink(self) -> NDArray[np.float64]:
        """Sum over materials of (greatest - least rise); the range's neighbours count, for a kink on a bin's edge."""
        wider = np.pad(self._rises, ((1, 1), (0, 0)), mode="edge")
        most = np.maximum(np.maximum(wider[:-2], wider[1:-1]), wider[2:])
        least = np.minimum(np.minimum(wider[:-2], wider[1:-1]), wider[2:])
        change = np.zeros((_BINS, _BINS))
        for k in range(wider.shape[1]):
            change += _over_ranges(most[:, k], np.maximum) - _over_ranges(least[:, k], np.minimum)
        return change

    def voxels_per_cell(self, slope: NDArray[np.float32]) -> NDArray[np.float32]:
        """Voxels in which a value that changes by at most ``slope`` per voxel moves by one cell of the table."""
        cell = (self.table.high - self.table.low) / self.table.cells
        return (cell / np.maximum(slope, 1e-9 * cell)).astype(np.float32)

    def bins(self, values: NDArray[np.float32]) -> NDArray[np.intp]:
        """Bin of each data value; values beyond the table count as its ends."""
        scale = _BINS / (self.table.high - self.table.low)
        return np.clip((values - np.float64(self.table.low)) * scale, 0, _BINS - 1).astype(np.intp)


def step_grid(rule: Rule, statistics: BrickStatistics, ranges: RangeTables) -> StepGrid:
    """The step grid of ``rule``; `thesis` wants the statistics of ``voxel_statistics``, the others any."""
    pair = ranges.bins(statistics.low) * _BINS + ranges.bins(statistics.high)
    shows, leaps = ranges.leaps(statistics)
    edge = statistics.edge
    if rule == "uniform":
        relative, longest = np.ones(pair.shape), np.inf
    elif rule == "thesis":
        frequency = essential_frequency(ranges.table)
        # A step in the middle of a window of two voxels either way, as long as the window.
        relative, longest = _inverse(2.0 * frequency * statistics.slope), 4.0
    else:
        rough = ranges.kink.ravel()[pair] * statistics.slope + ranges.slope.ravel()[pair] * statistics.bend
        rough = _with_neighbours(np.where(shows, rough, 0.0), 0.5 if edge < 4 else 0.75)
        typical = float(np.median(rough[shows])) if shows.any() else 0.0
        longest = 3.0
        if typical > 0:
            relative = np.cbrt(typical / np.maximum(rough, 1e-3 * typical))
        else:  # most bricks are level
            relative = np.where(rough > 0, 1.0, longest)
    steps = relative.astype(np.float32).view(np.uint32)
    adapts = rule == "error"
    if adapts:
        steps = (steps & np.uint32(0xFFFF0000)) | _upper_half(ranges.voxels_per_cell(statistics.slope))
    words = np.where(shows, steps, leaps)
    first = 0.0 if rule == "thesis" else 1.0
    return StepGrid(rule, edge, statistics.centred, words, longest=longest, adapts=adapts, first=first)


def _with_neighbours(rough: NDArray[np.float64], own: float) -> NDArray[np.float64]:
    """Roughness that heeds the roughest neighbour: a step may reach over into it, the more so the smaller bricks are.

    ``own`` is the power of a brick's own roughness, the rest is its neighbourhood's. Tried were powers from 1/3 to 1 at
    50 dB: seven fields took fewest turns at 1/2 in bricks of two voxels, one field at 3/4 in bricks of four.
    """
    from scipy import ndimage

    around = ndimage.maximum_filter(rough, size=3, mode="nearest")
    share = rough / np.where(around > 0, around, 1.0)
    heeded: NDArray[np.float64] = around * np.maximum(share, 0.05) ** own
    return heeded


def _upper_half(values: NDArray[np.float32]) -> NDArray[np.uint32]:
    """Sign, exponent and first mantissa bits of float32: not above the value, and at most 1/128 under it."""
    return values.view(np.uint32) >> np.uint32(16)


def essential_frequency(table: TransferTable, energy: float = 0.99) -> float:
    """ν_g of Eq. 4.14 in cycles per data unit: the frequency under which ``energy`` of the columns' power lies."""
    curve = table.columns[:: max(1, table.cells // 4096)]
    curve = curve - curve.mean(axis=0)
    power = (np.abs(np.fft.rfft(curve, n=4 * len(curve), axis=0)) ** 2).sum(-1)
    if power.sum() == 0:
        return 0.0
    share = np.cumsum(power) / power.sum()
    index = int(np.searchsorted(share, energy))
    step = (table.high - table.low) / (len(curve) - 1)
    return max(index, 1) / (4 * len(curve) * step)


def leap_words(shows: NDArray[np.bool_]) -> NDArray[np.uint32]:
    """Per brick of (bz, by, bx) the sign bit and, in bits 3o to 3o + 2, the level l of octant o.

    Octant bits are 1, 2 and 4 for rays that run down x, y and z. Level l: the cube of ``LEAPS[l]`` bricks per axis
    that starts with this brick and reaches ahead is empty (outside the grid counts as empty).
    """
    words = np.full(shows.shape, EMPTY, np.uint32)
    for octant in range(8):
        empty, levels = (~shows).view(np.uint8), np.zeros(shows.shape, np.uint8)
        for size, larger in itertools.pairwise(LEAPS):
            for axis in range(3):
                empty = _and_ahead(empty, larger - size, 2 - axis, bool(octant >> axis & 1))
            if not empty.any():
                break
            levels += empty
        words |= levels.astype(np.uint32) << np.uint32(3 * octant)
    return words


def _and_ahead(empty: NDArray[np.uint8], shift: int, axis: int, down: bool) -> NDArray[np.uint8]:
    """``empty`` and itself ``shift`` bricks further along ``axis`` (back, if ``down``); outside counts as empty."""
    both = empty.copy()
    if shift < empty.shape[axis]:
        near, far = [slice(None)] * 3, [slice(None)] * 3
        near[axis], far[axis] = slice(None, -shift), slice(shift, None)
        here, there = (far, near) if down else (near, far)
        np.bitwise_and(empty[tuple(here)], empty[tuple(there)], out=both[tuple(here)])
    return both


def _over_ranges(per_bin: NDArray[np.float64], pick: np.ufunc) -> NDArray[np.float64]:
    """[a, b] -> pick over the bins a to b; the lower triangle is the upper one's mirror and never read."""
    spread = np.where(np.tri(_BINS, k=-1, dtype=bool), per_bin[:, None], per_bin[None, :])
    return pick.accumulate(spread, axis=1) if pick is np.maximum else -np.maximum.accumulate(-spread, axis=1)


def _inverse(values: NDArray[np.float32]) -> NDArray[np.float64]:
    return 1.0 / np.maximum(values.astype(np.float64), 1e-12)
