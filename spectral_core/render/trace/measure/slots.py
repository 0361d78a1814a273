# SPDX-License-Identifier: GPL-3.0-or-later
"""Probabilities of cells as whole numbers of slots: the cell of a random number is then one entry of a table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError

Array = NDArray[np.float64]

SLOTS = 1 << 16
"""Equal intervals of probability. Single precision holds multiples of 1 / SLOTS exactly: no line of a lamp is off by
the rounding of its probability.
"""


def in_slots(share: Array, needed: NDArray[np.bool_]) -> Array:
    """Give probabilities near ``share`` (m,) that are multiples of 1 / SLOTS, add up to 1, and are not 0 where
    ``needed``. Raises InvalidInputError without a positive share, and for more needed cells than slots.
    """
    total, least = float(share.sum()), needed.astype(np.int64)
    if not total > 0.0 or least.sum() >= SLOTS:
        raise InvalidInputError(
            f"{least.sum()} needed cells of a total share {total:g}; expected fewer than {SLOTS} and a share above 0"
        )
    # The share of a cell beyond its first slot is divided by the method of the largest remainder.
    beyond = np.maximum(share / total * SLOTS - least, 0.0)
    left = SLOTS - int(least.sum())
    beyond *= left / beyond.sum()
    counts = least + np.floor(beyond).astype(np.int64)
    more = np.argsort(np.floor(beyond) - beyond, kind="stable")[: SLOTS - int(counts.sum())]
    counts[more] += 1
    return counts / SLOTS
