# SPDX-License-Identifier: GPL-3.0-or-later
"""Phases of the rays of a picture: an even pattern without structure, so that errors of steps look like fine grain."""

from __future__ import annotations

from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

EDGE = 32
"""Pixels along an edge of the pattern, which repeats."""
_RADIUS = 1.5
"""Pixels over which two values count as neighbors."""


@cache
def blue_noise(edge: int = EDGE) -> NDArray[np.float32]:
    """Values (edge, edge) in (0, 1), each once, whose neighbors differ: void-and-cluster (R. Ulichney, 1993).

    Every prefix of the values, as a set of pixels, is spread evenly.
    """
    across = np.minimum(np.arange(edge), edge - np.arange(edge))
    near = np.tile(np.exp(-(across[:, None] ** 2 + across**2) / (2 * _RADIUS**2)), (2, 2))
    crowd, first = np.zeros((edge, edge)), np.zeros((edge, edge), bool)

    def put(place: int, sign: float) -> None:
        row, column = divmod(place, edge)
        crowd[...] += sign * near[edge - row : 2 * edge - row, edge - column : 2 * edge - column]
        first.ravel()[place] = sign > 0

    for place in np.random.default_rng(0).choice(edge * edge, edge * edge // 10, replace=False):
        put(int(place), 1.0)
    while True:  # from the tightest cluster to the largest void, until they are the same
        cluster = int(np.argmax(np.where(first, crowd, -np.inf)))
        put(cluster, -1.0)
        void = int(np.argmin(np.where(first, np.inf, crowd)))
        put(void, 1.0)
        if void == cluster:
            break
    ranks, start, at_start = np.empty(edge * edge), first.copy(), crowd.copy()
    for rank in range(int(start.sum()) - 1, -1, -1):
        cluster = int(np.argmax(np.where(first, crowd, -np.inf)))
        put(cluster, -1.0)
        ranks[cluster] = rank
    first[...], crowd[...] = start, at_start
    for rank in range(int(start.sum()), edge * edge):
        void = int(np.argmin(np.where(first, np.inf, crowd)))
        put(void, 1.0)
        ranks[void] = rank
    return ((ranks + 0.5) / edge**2).astype(np.float32).reshape(edge, edge)


def phase_at(types: Any, x: Any, y: Any) -> Any:
    """Phases in (0, 1) of the rays through places in a picture, in pixels."""
    import drjit as dr

    column, row = (types.UInt32(types.Int32(dr.floor(part)) & (EDGE - 1)) for part in (x, y))
    return dr.gather(types.Float, _on_device(types), row * EDGE + column)


@lru_cache(maxsize=8)
def _on_device(types: Any) -> Any:
    return types.Float(blue_noise().ravel())
