# SPDX-License-Identifier: GPL-3.0-or-later
"""Means of a table's columns over the data values between the ends of a step."""

from __future__ import annotations

from typing import Any, Protocol

from spectral_core.volume.march.arithmetic import larger
from spectral_core.volume.march.device_table import DeviceTable, Segment

# The difference of two running integrals has float32's rounding error, which is divided by the span of values between
# them. Where the result is off by more than 1/4096 of the greatest height, the line through the middle is more exact.
_ROUNDED = 2.0**-12


class Reading(Protocol):
    """A stored ``value``, its segment's number, and the running ``integrals`` of the columns there."""

    value: Any
    segment: Any
    integrals: list[Any]


def column_means(table: DeviceTable, before: Reading, after: Reading, segment: Segment) -> list[Any]:
    """Mean of each column between two stored values, the second one in ``segment``.

    Inside one segment the column's line at the middle is exact. Otherwise the mean is the difference of the running
    integrals, unless their rounding error is too large: then the line of the segment in which the step ends.
    """
    import drjit as dr

    run = after.value - before.value
    crosses = before.segment != segment.index
    # Within one segment the difference is not read, so its division must only be harmless.
    inverse = dr.rcp(dr.select(crosses & (run != 0.0), run, 1.0))
    lines = table.column_values(segment, segment.part - 0.5 * run)
    length = dr.abs(run)
    means = []
    for line, old, new, height in zip(lines, before.integrals, after.integrals, table.heights, strict=True):
        by_difference = crosses & (length * height > _ROUNDED * dr.abs(new))
        # Rounding may leave a mean of tiny height just below 0, and light is never negative.
        means.append(larger(dr.select(by_difference, (new - old) * inverse, line), 0.0))
    return means
