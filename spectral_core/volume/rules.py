# SPDX-License-Identifier: GPL-3.0-or-later
"""Step rules: one float per brick, for a field and a transfer function.

A positive number is the relative step in voxels, to be multiplied by the step scale; a negative number -n says that
this brick and all bricks nearer than n (in the chessboard metric) show nothing, so a ray may leap over them. All
rules fill the same grid, and one march reads it, with one gather per step.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.bricks import BrickStatistics
from spectral_core.volume.tables import TransferTable

Rule = Literal["uniform", "thesis", "error"]
RULES: tuple[Rule, ...] = ("uniform", "thesis", "error")
SHORTEST_STEP = 0.01  # voxels: the thesis' "hundred times the frequency of the data grid"
_BINS = 512
_LEAPS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)


@dataclass(frozen=True, eq=False)
class StepGrid:
    """Steps and leaps of one rule: ``values`` (bz, by, bx) as the module says, float32.

    ``longest`` is the longest step in voxels that the rule allows (its statistics hold no further than that), and
    ``weighs_transmittance`` says that the step grows as T^(-1/4) where light from further on hardly counts.
    """

    rule: Rule
    edge: int
    centred: bool
    values: NDArray[np.float32]
    longest: float
    weighs_transmittance: bool

    @property
    def occupied(self) -> float:
        """Share of bricks that show something."""
        return float(np.mean(self.values > 0))

    def bounds(self, shape: tuple[int, int, int]) -> tuple[list[float], list[float]]:
        """Index box (low, high), x first, of the bricks that show something in a field of ``shape`` voxels.

        Empty (low above high) where nothing shows: rays then end before they begin.
        """
        filled = self.values > 0
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

    ``shows`` says that something is seen, ``slope`` is the steepest rise of opacity-saturated source per data unit,
    ``kink`` the greatest change of that rise. Saturated (1 - exp(-σ·voxel)): more extinction than fills a voxel
    cannot make a picture rougher.
    """

    table: TransferTable
    voxel: float

    @cached_property
    def shows(self) -> NDArray[np.bool_]:
        nodes = self.table.columns.sum(-1) > 0
        at = np.linspace(0, self.table.cells, _BINS + 1).astype(int)
        filled = np.array([nodes[a : b + 1].any() for a, b in zip(at[:-1], at[1:], strict=True)])
        return _over_ranges(filled.astype(np.float64), np.maximum) > 0

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

    def bins(self, values: NDArray[np.float32]) -> NDArray[np.intp]:
        """Bin of each data value; values beyond the table count as its ends."""
        scale = _BINS / (self.table.high - self.table.low)
        return np.clip((values - np.float64(self.table.low)) * scale, 0, _BINS - 1).astype(np.intp)


def step_grid(rule: Rule, statistics: BrickStatistics, ranges: RangeTables) -> StepGrid:
    """The step grid of ``rule``; `thesis` wants the statistics of ``voxel_statistics``, the others any."""
    pair = ranges.bins(statistics.low) * _BINS + ranges.bins(statistics.high)
    shows = ranges.shows.ravel()[pair]
    edge = statistics.edge
    if rule == "uniform":
        relative, longest = np.ones(pair.shape), np.inf
    elif rule == "thesis":
        frequency = essential_frequency(ranges.table)
        relative, longest = _inverse(2.0 * frequency * statistics.slope), 2.0
    else:
        rough = ranges.kink.ravel()[pair] * statistics.slope + ranges.slope.ravel()[pair] * statistics.bend
        if edge < 4:  # a step may reach over a small brick, so it must know its neighbours
            from scipy import ndimage

            rough = ndimage.maximum_filter(np.where(shows, rough, 0.0), size=3, mode="nearest")
        typical = float(np.median(rough[shows])) if shows.any() else 0.0
        floor = 1e-3 * typical or 1.0
        relative, longest = np.cbrt(max(typical, 1e-30) / np.maximum(rough, floor)), 3.0
    values = np.where(shows, relative, -leap_distance(shows)).astype(np.float32)
    return StepGrid(rule, edge, statistics.centred, values, longest, rule == "error")


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


def leap_distance(shows: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Per empty brick, n such that all bricks nearer than n in the chessboard metric are empty too; 0 where filled.

    From a short list of distances, since each costs three cheap passes: 1, 2, 3, 4, 6, 8, 12, 16, 24, 32.
    """
    empty = ~shows
    distance = empty.astype(np.uint8)
    reached = 1
    for leap in _LEAPS[1:]:
        # A cube of radius leap - 1 is the union of cubes of radius reached - 1, moved by up to the difference.
        empty = _eroded(empty, leap - reached)
        if not empty.any():
            break
        distance[empty] = leap
        reached = leap
    return distance.astype(np.float32)


def _eroded(empty: NDArray[np.bool_], radius: int) -> NDArray[np.bool_]:
    """Bricks whose neighbours at -radius, 0 and +radius along every axis are empty; outside the grid is empty."""
    for axis in range(3):
        moved = np.moveaxis(empty, axis, 0)
        eroded = moved.copy()
        if radius < len(moved):
            eroded[radius:] &= moved[:-radius]
            eroded[:-radius] &= moved[radius:]
        empty = np.moveaxis(eroded, 0, axis)
    return empty


def _over_ranges(per_bin: NDArray[np.float64], pick: np.ufunc) -> NDArray[np.float64]:
    """[a, b] -> pick over the bins a to b; the lower triangle is the upper one's mirror and never read."""
    spread = np.where(np.tri(_BINS, k=-1, dtype=bool), per_bin[:, None], per_bin[None, :])
    return pick.accumulate(spread, axis=1) if pick is np.maximum else -np.maximum.accumulate(-spread, axis=1)


def _inverse(values: NDArray[np.float32]) -> NDArray[np.float64]:
    return 1.0 / np.maximum(values.astype(np.float64), 1e-12)
