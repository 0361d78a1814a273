# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of a field that mark missing data, and the range of the others.

A value at either end of the data is a fill value if it is far beyond all others and is either a number that file
formats and instruments use for missing data (-9999, -32768, 1e20, …), or one that many voxels of measured data share.
The labels of a segmentation, of which {0, 1, 2, 255} is one, are far from each other as well, and so is a single bright
voxel from its neighbors. Both are data.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

MARKS = (999.0, 9999.0, 99999.0, 32767.0, 32768.0, 65535.0, 2147483647.0, 2147483648.0, 4294967295.0)
"""Sizes of numbers that often mark missing data; so do all from ``GREAT_MARK`` on."""
GREAT_MARK = 1e15
_NEAR, _FAR = 1.0, 10.0  # ranges of the other values: the least gap to a mark, and to any other fill value
_FEWEST_KINDS = 256  # distinct other values: fewer of them may be labels
_FEWEST_VOXELS = 10  # that share a fill value that is no mark
_MOST_SORTED = 2e6


def range_without_fill_values(data: NDArray[Any]) -> tuple[float, float]:
    """Least and greatest value of (nx, ny, nz) data, without those far beyond the others that mean "no data"."""
    some = some_values(data)
    kept = without_fill_values(some)
    low, high = float(data.min()), float(data.max())
    span = float(kept[-1] - kept[0])
    # Voxels between those looked at may hold lower and higher values, and marks as well.
    if kept[0] > some[0] or (_is_mark(low) and kept[0] - low > _NEAR * span > 0.0):
        low = float(kept[0])
    if kept[-1] < some[-1] or (_is_mark(high) and high - kept[-1] > _NEAR * span > 0.0):
        high = float(kept[-1])
    return low, high


def fill_values_note(data: NDArray[Any], used: tuple[float, float]) -> str | None:
    """One sentence for the user if the range ``used`` leaves out values of the data; else None."""
    low, high = float(data.min()), float(data.max())
    omitted = [f"{value:g}" for value, is_out in ((low, low < used[0]), (high, high > used[1])) if is_out]
    if not omitted:
        return None
    return (
        f"{' and '.join(omitted)} {'count' if len(omitted) > 1 else 'counts'} as missing data; presets and fractions "
        f"refer to {used[0]:g} to {used[1]:g}"
    )


def some_values(data: NDArray[Any]) -> NDArray[np.float64]:
    """Sorted values of all voxels, or of about two million evenly spread ones."""
    stride = max(1, round((data.size / _MOST_SORTED) ** (1 / 3)))
    return np.sort(data[::stride, ::stride, ::stride].astype(np.float64), axis=None)


def without_fill_values(values: np.ndarray) -> np.ndarray:
    """Sorted ``values`` without those at an end that mean "no data"."""
    for _ in range(4):  # both ends, and a second kind of fill value behind each
        distinct, counts = np.unique(values, return_counts=True)
        if len(distinct) < 4:
            return values
        below, above = distinct[1] - distinct[0], distinct[-1] - distinct[-2]
        is_measured = len(distinct) > _FEWEST_KINDS
        at_low = below > _gap(distinct[0], counts[0], is_measured) * (distinct[-1] - distinct[1])
        at_high = above > _gap(distinct[-1], counts[-1], is_measured) * (distinct[-2] - distinct[0])
        if not (at_low or at_high):
            return values
        drop_low = at_low and (not at_high or below >= above)
        values = values[values > distinct[0]] if drop_low else values[values < distinct[-1]]
    return values


def with_width(low: float, high: float) -> tuple[float, float]:
    """The range ``low`` to ``high`` of a field, made wide if it has one value: that of a field above 0 begins at 0, as
    grids are empty there, so that its value is the greatest; another one is the least.
    """
    if high > low:
        return low, high
    return (0.0, high) if high > 0.0 else (low, low + 1.0)


def _gap(value: float, voxels: int, is_measured: bool) -> float:
    """Least gap, in ranges of the other values, that makes ``value`` a fill value; infinite if none does."""
    if _is_mark(value):
        return _NEAR
    return _FAR if is_measured and voxels >= _FEWEST_VOXELS else np.inf


def _is_mark(value: float) -> bool:
    return abs(value) in MARKS or abs(value) >= GREAT_MARK or value == -1e9
