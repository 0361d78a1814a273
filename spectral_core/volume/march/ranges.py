# SPDX-License-Identifier: GPL-3.0-or-later
"""Roughness of a transfer function between any two data values: it converts a brick's range to a step."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.march.brick_word import BrickWord, Mask, Words
from spectral_core.volume.march.bricks import BrickStatistics
from spectral_core.volume.march.tables import LEAST_WIDTH, TransferTable

BINS = 512
Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RangeTables:
    """Bounds of a transfer function between two data values: arrays (bins, bins) read at [lowest, highest].

    ``slope`` is the steepest rise of opacity-saturated source per data unit, ``kink`` the greatest change of that rise.
    Saturated (1 - exp(-σ·voxel)): more extinction than fills a voxel cannot make a picture rougher. They determine the
    length of steps, never visibility, which is exact.
    """

    table: TransferTable
    voxel: float

    def shows(self, low: NDArray[np.float32], high: NDArray[np.float32]) -> Mask:
        """True if any value between ``low`` and ``high`` is visible; exact for any narrow peak."""
        shown = np.zeros(low.shape, bool)
        for start, end, at_start, at_end in self.table.support:
            above = (high >= start) if at_start else (high > start)
            # Half-open if the height is 0 at the end: a value exactly there is invisible.
            shown |= above & ((low <= end) if at_end else (low < end))
        return shown

    def empties(self, statistics: BrickStatistics) -> tuple[Mask, Words]:
        """(visible bricks, words as if all were empty); cached, because every rule's grid starts from them."""
        key = (statistics.edge, statistics.centered)
        if key not in self._empties:
            shows = self.shows(statistics.low, statistics.high)
            self._empties[key] = (shows, BrickWord.pack_empty(shows))
        return self._empties[key]

    @cached_property
    def _empties(self) -> dict[tuple[int, bool], tuple[Mask, Words]]:
        return {}

    @cached_property
    def is_even(self) -> bool:
        """True if bins of equal width resolve the function: at least two of them lie between any two knots."""
        knots = self.table.knots
        return len(knots) < 2 or float(np.diff(knots).min()) * BINS > 2.0 * float(knots[-1] - knots[0])

    @cached_property
    def edges(self) -> Floats:
        """Data values (bins + 1,) between the bins: the span of the knots, and a bin more on either side.

        Bins have equal width, or equal numbers between any two knots if the knots are too uneven for that.
        """
        knots = self.table.knots
        if len(knots) < 2:
            # A field of one value has a table of one knot; the bins still need a width.
            knots = knots[0] + max(abs(float(knots[0])), 1e-30) * np.array([-1e-3, 1e-3])
        if self.is_even:
            inner = np.linspace(knots[0], knots[-1], BINS - 1)
        else:
            inner = np.interp(np.linspace(0, len(knots) - 1, BINS - 1), np.arange(len(knots)), knots)
        beyond = (knots[-1] - knots[0]) / (BINS - 2)
        return np.concatenate([[inner[0] - beyond], inner, [inner[-1] + beyond]])

    @cached_property
    def _rises(self) -> Floats:
        """Rise of each saturated column per data unit, per bin: (bins, K)."""
        columns = self.table.columns_at(self.edges)
        k = self.table.materials
        extinction = columns.sum(-1) if columns.shape[1] == k else columns[:, k:].sum(-1)
        if self.table.weights is not None:
            extinction, columns = columns[:, :k].sum(-1), columns[:, :k] + columns[:, k:]
        # Where the depth is tiny the quotient is 0/0; its limit is 1.
        depth = extinction * self.voxel
        mean = np.where(depth > 1e-6, -np.expm1(-depth) / np.where(depth > 0, depth, 1.0), 1.0)
        saturated = columns[:, :k] * (mean * self.voxel)[:, None]
        # Bins of a narrow range far from zero may have less width than the numbers there can have.
        widths = np.maximum(np.diff(self.edges), max(np.spacing(np.abs(self.edges).max()), LEAST_WIDTH))
        rises: Floats = np.diff(saturated, axis=0) / widths[:, None]
        return rises

    @cached_property
    def slope(self) -> Floats:
        return _over_ranges(np.abs(self._rises).sum(-1), np.maximum)

    @cached_property
    def kink(self) -> Floats:
        """Sum over materials of (greatest - least rise); the range's neighbors count, for a kink on a bin's edge."""
        # Bins do not fall on knots: a kink may lie on the border between two of them.
        wider = np.pad(self._rises, ((1, 1), (0, 0)), mode="edge")
        most = np.maximum(np.maximum(wider[:-2], wider[1:-1]), wider[2:])
        least = np.minimum(np.minimum(wider[:-2], wider[1:-1]), wider[2:])
        change = np.zeros((BINS, BINS))
        for k in range(wider.shape[1]):
            change += _over_ranges(most[:, k], np.maximum) - _over_ranges(least[:, k], np.minimum)
        return change

    def bins(self, values: NDArray[np.float32]) -> NDArray[np.intp]:
        """Bin of each data value; values beyond the edges count as in the first or last bin."""
        if self.is_even:
            # Equal bins need no search: this runs over every brick of the field, millions of them.
            scale = BINS / max(float(self.edges[-1] - self.edges[0]), LEAST_WIDTH)
            with np.errstate(over="ignore"):  # values far beyond the edges are in the first or last bin as well
                return np.clip((values - np.float64(self.edges[0])) * scale, 0, BINS - 1).astype(np.intp)
        return np.clip(np.searchsorted(self.edges, values, side="right") - 1, 0, BINS - 1)


def _over_ranges(per_bin: Floats, pick: np.ufunc) -> Floats:
    """[a, b] -> pick over the bins a to b; the lower triangle is the upper one's mirror and never read."""
    # Running maxima from the diagonal to the right: entry [a, b] covers bins a to b. One pass gives all pairs.
    spread = np.where(np.tri(BINS, k=-1, dtype=bool), per_bin[:, None], per_bin[None, :])
    return pick.accumulate(spread, axis=1) if pick is np.maximum else -np.maximum.accumulate(-spread, axis=1)
