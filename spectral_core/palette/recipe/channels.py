# SPDX-License-Identifier: GPL-3.0-or-later
"""Sets of LED channels that reach a white, in the order in which they promise good color rendering.

The drives of a set that have the white are a polytope, whose corners use three channels each. The quality at the mean
of these corners, and at the corners, ranks the sets of one size; the first ones are optimized.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.recipe.white import xyz_from_spd

Array = NDArray[np.float64]
Set = tuple[int, ...]

MOST_RANKED = 400
"""Sets of one size that are ranked, the broadest spectra first: all sets of up to 11 channels but a few."""
TRIED = 12
"""Sets of one size that are optimized."""
ROUNDING = 1e-12
"""Share of the largest drive below 0 that is rounding."""


def combinations_of(spds: Array, white: Array, most: int, quality: Callable[[Array], float]) -> Iterator[Set]:
    """Sets of channels (k, n) that reach a white, XYZ (3,), the smallest first; of one size those that promise most.

    ``most``: channels in a set at most. ``quality``: of drives (k,), the larger the better.
    """
    corners = _corners(spds, white)
    masks, drives = np.array([_mask(each) for each in corners], dtype=np.int64), np.array(list(corners.values()))
    at_corners = {chosen: quality(own) for chosen, own in corners.items()}
    of_corner = np.array(list(at_corners.values()))
    for size in range(3, most + 1):
        ranked: list[tuple[float, Set]] = []
        for chosen in _broadest_first(spds, size):
            inside = (masks & ~_mask(chosen)) == 0 if len(masks) else np.zeros(0, dtype=bool)
            if not inside.any():
                continue
            middle = quality(drives[inside].mean(axis=0)) if size > 3 else at_corners[chosen]
            ranked.append((max(middle, float(of_corner[inside].max())), chosen))
            if size > 3 and len(ranked) == MOST_RANKED:
                break
        yield from (chosen for _, chosen in sorted(ranked, key=lambda each: -each[0])[:TRIED])


def _corners(spds: Array, white: Array) -> dict[Set, Array]:
    """Drives (k,) on the white of each three channels that have it."""
    matrix = spds @ xyz_from_spd().T
    found: dict[Set, Array] = {}
    for chosen in itertools.combinations(range(len(spds)), 3):
        three = matrix[list(chosen)].T
        if np.linalg.matrix_rank(three) < 3:
            continue
        own = np.linalg.solve(three, white)
        if own.min() >= -ROUNDING * np.abs(own).max():
            found[chosen] = np.zeros(len(spds))
            found[chosen][list(chosen)] = np.maximum(own, 0.0)
    return found


def _broadest_first(spds: Array, size: int) -> list[Set]:
    """All sets of one size. A broad spectrum renders colors well: the mean overlap with equal energy orders them."""
    shapes = spds / spds.max(axis=1, keepdims=True)
    sets = list(itertools.combinations(range(len(spds)), size))
    return sorted(sets, key=lambda chosen: -float(np.sqrt(shapes[list(chosen)].max(axis=0)).mean()))


def _mask(chosen: Set) -> int:
    return sum(1 << k for k in chosen)
