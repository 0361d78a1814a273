# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights of every texel: exact if the wanted colors can be reached, else nearest in CIELAB.

Most texels are solved by one matrix product; the others are searched for. Texels are handled in tiles, several at a
time, so memory does not grow with the picture.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from spectral_core.blas_threads import on_one_thread
from spectral_core.child import cores
from spectral_core.errors import InvalidInputError
from spectral_core.palette.texture.nearest import NearestInBox

Array = NDArray[np.float64]
Texels = NDArray[np.float32]
Found = TypeVar("Found")

TILE = 1 << 18
"""Texels per tile."""
INTERPOLATED = 1 << 13
"""Texels whose colors are interpolated between corners at a time; the values of 64 corners then fit into the cache."""
SAME_COLOR = 1e-5
"""Difference in linear RGB that single precision leaves between a wanted and a shown color."""
MOST_THREADS = 8


@on_one_thread
def over_tiles(
    work: Callable[[slice], Found], tiles: Sequence[slice], progress: Callable[[float], None] | None = None
) -> list[Found]:
    """Call ``work`` for each tile, several at a time; ``progress`` receives the completed share after each, in
    order.
    """
    found = []
    with ThreadPoolExecutor(min(cores(), MOST_THREADS)) as pool:
        jobs = [pool.submit(work, tile) for tile in tiles]
        try:
            for number, job in enumerate(jobs, 1):
                found.append(job.result())
                if progress is not None:
                    progress(number / len(jobs))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return found


def require_importance(importance: tuple[float, ...], count: int) -> tuple[float, ...]:
    """Importances of the pictures under ``count`` lights; raises InvalidInputError unless all are positive numbers."""
    if len(importance) != count or not all(0 < each < np.inf for each in importance):  # also NaN
        raise InvalidInputError(
            f"{len(importance)} importances {importance} for {count} lights; give one positive number per light"
        )
    return importance


@dataclass(frozen=True, eq=False)
class Fitter:
    """Solver of texels. ``color_from_weights``: (3L, K), linear RGB under each light.

    ``importance``: (L,), weights of the color differences of each picture if not all can be met. ``corner_weights``:
    (8^L, K), weights within [0, 1] of the corners of the mapped display colors, if all of them can be reached; with
    more spectra than colors (K > 3L) their multilinear interpolation is exact and inside the box at every texel.
    """

    color_from_weights: Array
    importance: tuple[float, ...]
    corner_weights: Array | None = None

    def __post_init__(self) -> None:
        require_importance(self.importance, self.color_from_weights.shape[0] // 3)

    @cached_property
    def _search(self) -> NearestInBox:
        return NearestInBox(self.color_from_weights, self.importance)

    @cached_property
    def _weights_from_color(self) -> Texels:
        return np.linalg.pinv(self.color_from_weights).astype(np.float32)

    def solve(self, wanted: Texels, progress: Callable[[float], None] | None = None) -> tuple[Texels, int]:
        """Find the weights of texels.

        Parameters
        ----------
        wanted : (3L, m) float32, linear RGB of each texel under each light, relative to the light's white.
        progress : called with the share done, from 0 to 1, after each tile.

        Returns
        -------
        weights (K, m) float32 within [0, 1], and the count of texels whose colors cannot be reached.
        """
        count = wanted.shape[1]
        weights = np.empty((self.color_from_weights.shape[1], count), dtype=np.float32)

        def work(tile: slice) -> int:
            weights[:, tile], outside = self.solve_tile(wanted[:, tile])
            return len(outside)

        tiles = [slice(start, min(start + TILE, count)) for start in range(0, count, TILE)]
        return weights, sum(over_tiles(work, tiles, progress))

    def solve_tile(self, wanted: Texels) -> tuple[Texels, NDArray[np.intp]]:
        """Weights (K, m) of one tile (3L, m), and the texels whose colors cannot be reached."""
        rows, count = self.color_from_weights.shape
        if rows == count:
            weights = self._weights_from_color @ wanted
        elif self.corner_weights is not None:
            weights = self._between_corners(wanted)
        else:
            # The least-norm answer is taken about the gray of each texel, which is inside the box for every texel.
            gray = np.clip(wanted.mean(axis=0), 0.0, 1.0)
            weights = self._weights_from_color @ (wanted - gray) + gray
        missed = (weights.min(axis=0) < 0) | (weights.max(axis=0) > 1)
        if self.corner_weights is None or rows == count:
            # Of two nearly equal lights the product's weights are inside the box, but may have another color.
            if rows == count:
                missed |= not self._search.invertible
            else:
                shown = self.color_from_weights.astype(np.float32) @ weights
                missed |= np.abs(shown - wanted).max(axis=0) > SAME_COLOR
        outside = np.flatnonzero(missed)
        if outside.size:
            weights[:, outside] = self._search.solve(wanted[:, outside], weights[:, outside])
        return weights, outside

    def _between_corners(self, wanted: Texels) -> Texels:
        """Multilinear interpolation (K, m) of the corners' weights; it reproduces affine functions of the color."""
        assert self.corner_weights is not None
        colors = self.corner_weights[[0, -1]] @ self.color_from_weights.T
        low, high = colors[0].astype(np.float32)[:, None], colors[1].astype(np.float32)[:, None]
        width = np.where(high > low, high - low, 1)  # without contrast the pictures are gray: any share shows it
        corners = self.corner_weights.T.astype(np.float32)[:, :, None]
        found = np.empty((len(corners), wanted.shape[1]), dtype=np.float32)
        for start in range(0, wanted.shape[1], INTERPOLATED):
            block = slice(start, start + INTERPOLATED)
            share = np.clip((wanted[:, block] - low) / width, 0.0, 1.0)
            # The first axis of the color varies slowest in the order of the corners, so it is contracted last.
            values = corners
            for axis in reversed(range(len(share))):
                even, odd = values[:, ::2], values[:, 1::2]
                values = even + (odd - even) * share[axis]
            np.clip(values[:, 0], 0.0, 1.0, out=found[:, block])
        return found
