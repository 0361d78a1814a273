# SPDX-License-Identifier: GPL-3.0-or-later
"""An OpenVDB grid as arrays: leaves of 8³ voxels, and tiles, which are cubes of one value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.files.vdb.write import LEAF


@dataclass(frozen=True)
class Tiles:
    """Cubes of one value each: first indices (n, 3), voxels along an edge (n,), values (n,), True for active ones (n,).

    Arrays, because a small file may contain millions of tiles.
    """

    corners: NDArray[np.int64]
    widths: NDArray[np.int64]
    values: NDArray[Any]
    active: NDArray[np.bool_]


@dataclass(frozen=True)
class PlainGrid:
    """One grid: leaves (n, 8, 8, 8) or (n, 8, 8, 8, 3), their first indices (n, 3), the mask of active voxels,
    tiles.
    """

    name: str
    metadata: dict[str, Any]
    world_from_index: NDArray[np.float64]
    background: Any
    leaves: NDArray[Any]
    origins: NDArray[np.int64]
    active: NDArray[np.bool_]
    tiles: Tiles

    def active_box(self) -> tuple[tuple[int, int, int], tuple[int, int, int]] | None:
        """First and last index of the active voxels; None without any."""
        kept = self.tiles.active
        lows = [self.tiles.corners[kept]]
        highs = [self.tiles.corners[kept] + self.tiles.widths[kept, None] - 1]
        for axis in range(3):
            # along each axis: the first and last layer of a leaf that holds an active voxel
            layers = self.active.any(axis=tuple(other + 1 for other in range(3) if other != axis))
            used = np.flatnonzero(layers.any(axis=1))
            low, high = self.origins[used].copy(), self.origins[used].copy()
            low[:, axis] += layers[used].argmax(axis=1)
            high[:, axis] += LEAF - 1 - layers[used][:, ::-1].argmax(axis=1)
            lows.append(np.where(np.arange(3) == axis, low, np.iinfo(np.int64).max))
            highs.append(np.where(np.arange(3) == axis, high, np.iinfo(np.int64).min))
        first, last = np.concatenate(lows), np.concatenate(highs)
        if not len(first):
            return None
        (a, b, c), (d, e, f) = first.min(axis=0).tolist(), last.max(axis=0).tolist()
        return (a, b, c), (d, e, f)

    def fill(self, array: NDArray[Any], low: tuple[int, int, int]) -> None:
        """Copy the part in the box of ``array``, whose first voxel has index ``low``."""
        array[...] = self.background
        firsts = np.maximum(self.tiles.corners - np.array(low), 0)
        lasts = np.minimum(self.tiles.corners - np.array(low) + self.tiles.widths[:, None], array.shape[:3])
        for index in np.flatnonzero((firsts < lasts).all(axis=1)):
            here = tuple(slice(a, b) for a, b in zip(firsts[index], lasts[index], strict=True))
            array[here] = self.tiles.values[index]
        for values, origin in zip(self.leaves, self.origins - np.array(low), strict=True):
            first = np.maximum(origin, 0)
            last = np.minimum(origin + LEAF, array.shape[:3])
            if (first < last).all():
                here = tuple(slice(a, b) for a, b in zip(first, last, strict=True))
                there = tuple(slice(a - o, b - o) for a, b, o in zip(first, last, origin, strict=True))
                array[here] = values[there]
