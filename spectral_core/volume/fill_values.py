# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of a field that mark missing data, and the range of the others."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

_FAR = 10.0  # ranges of the other values: the least gap to a value that means "no data"
_MOST_SORTED = 2e6


def range_without_fill_values(data: NDArray[Any]) -> tuple[float, float]:
    """Least and greatest value of (nx, ny, nz) data, without those far beyond the others that mean "no data"."""
    some = some_values(data)
    kept = without_fill_values(some)
    low, high = float(data.min()), float(data.max())
    span = float(kept[-1] - kept[0])
    # Voxels between those looked at may hold lower and higher values, and fill values as well.
    if kept[0] > some[0] or kept[0] - low > _gap(low) * span > 0.0:
        low = float(kept[0])
    if kept[-1] < some[-1] or high - kept[-1] > _gap(high) * span > 0.0:
        high = float(kept[-1])
    return low, high


def some_values(data: NDArray[Any]) -> NDArray[np.float64]:
    """Sorted values of all voxels, or of about two million evenly spread ones."""
    stride = max(1, round((data.size / _MOST_SORTED) ** (1 / 3)))
    return np.sort(data[::stride, ::stride, ::stride].astype(np.float64), axis=None)


def without_fill_values(values: np.ndarray) -> np.ndarray:
    """Sorted ``values`` without those at an end that mean "no data".

    A value at either end is a fill value if the gap to the next one is ten times as wide as the range of the others. A
    gap as wide as that range is sufficient for values that file formats and instruments use for missing data (-9999,
    -32768, 1e20, …).
    """
    for _ in range(4):  # both ends, and a second kind of fill value behind each
        distinct = np.unique(values)
        if len(distinct) < 4:
            return values
        below, above = distinct[1] - distinct[0], distinct[-1] - distinct[-2]
        at_low = below > _gap(distinct[0]) * (distinct[-1] - distinct[1])
        at_high = above > _gap(distinct[-1]) * (distinct[-2] - distinct[0])
        if not (at_low or at_high):
            return values
        drop_low = at_low and (not at_high or below >= above)
        values = values[values > distinct[0]] if drop_low else values[values < distinct[-1]]
    return values


def _gap(value: float) -> float:
    """Size of a gap, in ranges of the other values: smaller for a value that often marks missing data."""
    magnitude = abs(value)
    known = magnitude in (999.0, 9999.0, 99999.0, 32768.0, 32767.0, 65535.0) or magnitude >= 1e15
    return 1.0 if known or value == -1e9 else _FAR
