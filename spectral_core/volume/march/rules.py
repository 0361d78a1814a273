# SPDX-License-Identifier: GPL-3.0-or-later
"""Step rules: longest step in each brick, for a field and a transfer function.

- `uniform`: one length everywhere.
- `thesis`: inverse to the band limit of g(f(x)), which is the essential frequency of g times the greatest slope of f
  around a voxel (Eq. 4.14, section 4.2).
- `error`: inverse to the cube root of an estimate of the second derivative of g(f(x)), which spreads the error of a
  midpoint rule evenly over the steps; and longer as T^(-5/16) where little light is left.
- `cells`: the steps of `error`, which also end at each face between two cells of the grid, and divide the way to the
  next one evenly. The field is smooth inside a cell, and has its kinks at the faces.

All fill the same grid of brick words, and one march reads it, with one gather per iteration.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.march.brick_word import BrickWord, Words
from spectral_core.volume.march.bricks import BrickStatistics
from spectral_core.volume.march.ranges import BINS, RangeTables
from spectral_core.volume.march.tables import TransferTable

Rule = Literal["uniform", "thesis", "error", "cells"]
RULES: tuple[Rule, ...] = ("uniform", "thesis", "error", "cells")


@dataclass(frozen=True, eq=False)
class StepGrid:
    """Steps and skips of one rule: ``words`` (bz, by, bx) are ``BrickWord``s.

    ``longest`` is the longest step in voxels that the rule allows (its statistics hold no further than that).
    ``adapts``: True if the step grows as T^(-5/16), because light from further on hardly counts, and if words hold a
    pace. ``first`` is the relative step of a midpoint march in the same iteration as a skip, before the brick at its
    end is known.
    """

    rule: Rule
    edge: int
    centered: bool
    words: Words
    longest: float
    adapts: bool
    first: float

    def bounds(self, shape: tuple[int, int, int]) -> tuple[list[float], list[float]]:
        """Index box (low, high), x first, of the visible bricks in a field of ``shape`` voxels.

        Empty (low above high) if nothing is visible: rays then end before they begin.
        """
        filled = BrickWord.shown(self.words)
        low, high = [], []
        for axis, voxels in enumerate(shape):
            # Words are stored (z, y, x), boxes are stated x first.
            others = tuple(a for a in range(3) if a != 2 - axis)
            at = np.flatnonzero(filled.any(axis=others))
            if not len(at):
                return [1.0] * 3, [0.0] * 3
            shift = 0.5 if self.centered else 0.0
            # The outermost bricks also own the half voxel between the last center and the face.
            low.append(-0.5 if at[0] == 0 else at[0] * self.edge - shift)
            high.append(voxels - 0.5 if at[-1] == filled.shape[2 - axis] - 1 else (at[-1] + 1) * self.edge - shift)
        return low, high


def step_grid(rule: Rule, statistics: BrickStatistics, ranges: RangeTables, unit: float = 1.0) -> StepGrid:
    """Fill the step grid of ``rule``.

    Parameters
    ----------
    rule
        One of ``RULES``.
    statistics
        Of the field: those of ``voxel_statistics`` for `thesis`, any for the others.
    ranges
        Of the transfer function.
    unit : float
        Data units in one stored unit of the field, for the paces.
    """
    pair = ranges.bins(statistics.low) * BINS + ranges.bins(statistics.high)
    shows, empty = ranges.empties(statistics)
    edge, longest, paces = statistics.edge, np.inf, None
    if rule == "uniform":
        relative = np.ones(pair.shape)
    elif rule == "thesis":
        frequency = essential_frequency(ranges.table)
        # The slope holds for two voxels on each side of a step's middle: for 4 in all.
        relative, longest = _inverse(2.0 * frequency * statistics.slope), 4.0
    else:
        # Second derivative of g(f(x)) by the chain rule: g'' f'² + g' f''. g is piecewise linear: its kink, met within
        # one voxel, approximates g'' f'.
        rough = ranges.kink.ravel()[pair] * statistics.slope + ranges.slope.ravel()[pair] * statistics.second_difference
        rough = _with_neighbors(np.where(shows, rough, 0.0), 0.5 if edge < 4 else 0.75)
        # Steps are relative to that of the median brick; the quality then scales all of them alike.
        typical = float(np.median(rough[shows])) if shows.any() else 0.0
        longest = 3.0
        if typical > 0:
            # Midpoint error per unit length grows as h²·rough; spread evenly over samples of density 1/h, the optimum
            # is h ~ rough^(-1/3).
            relative = np.cbrt(typical / np.maximum(rough, 1e-3 * typical))
        else:  # most bricks are level
            relative = np.where(rough > 0, 1.0, longest)
        # The pace of a constant brick is infinite; 1e9 voxels serve as well and are far below the limit of float32.
        paces = (unit / np.maximum(statistics.slope.astype(np.float64), 1e-9 * unit)).astype(np.float32)
    words = BrickWord.pack(relative.astype(np.float32), paces, empty, shows)
    first = 0.0 if rule == "thesis" else 1.0
    return StepGrid(rule, edge, statistics.centered, words, longest=longest, adapts=paces is not None, first=first)


def _with_neighbors(rough: NDArray[np.float64], own: float) -> NDArray[np.float64]:
    """Roughness of bricks, raised by the roughest neighbor, because a step may end in it (more often in small bricks).

    The result is the geometric mean of the brick's roughness, with weight ``own``, and its neighborhood's maximum.
    Weights from 1/3 to 1 were tried on eight fields at 50 dB. Seven took the fewest iterations with the weight 1/2 and
    bricks of two voxels, one with 3/4 and bricks of four.
    """
    from scipy import ndimage

    around = ndimage.maximum_filter(rough, size=3, mode="nearest")
    share = rough / np.where(around > 0, around, 1.0)
    raised: NDArray[np.float64] = around * np.maximum(share, 0.05) ** own
    return raised


def essential_frequency(table: TransferTable, energy: float = 0.99) -> float:
    """ν_g of Eq. 4.14 in cycles per data unit: the frequency under which ``energy`` of the columns' power lies."""
    low, high = float(table.knots[0]), float(table.knots[-1])
    if high <= low:
        return 0.0
    curve = table.columns_at(np.linspace(low, high, 4097))
    # A constant needs no samples, so its power must not count.
    curve = curve - curve.mean(axis=0)
    # Padding by zeros to four times the length resolves frequencies below one period of the range.
    power = (np.abs(np.fft.rfft(curve, n=4 * len(curve), axis=0)) ** 2).sum(-1)
    if power.sum() == 0:
        return 0.0
    share = np.cumsum(power) / power.sum()
    index = int(np.searchsorted(share, energy))
    step = (high - low) / (len(curve) - 1)
    return max(index, 1) / (4 * len(curve) * step)


def _inverse(values: NDArray[np.float32]) -> NDArray[np.float64]:
    return 1.0 / np.maximum(values.astype(np.float64), 1e-12)
