# SPDX-License-Identifier: GPL-3.0-or-later
"""Means of a table's columns over the data values between the ends of a step, and where in the step their source is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from spectral_core.volume.march.arithmetic import bounded, larger, mean_place
from spectral_core.volume.march.device.table import DeviceTable, Segment

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


@dataclass  # not frozen: the loop writes its state
class EndOfStep:
    """What a lit march knows of the value at the end of a step: the ``nearest`` visible value, and the ``source``."""

    nearest: Any
    source: Any

    @classmethod
    def at(cls, table: DeviceTable, value: Any, segment: Segment) -> EndOfStep:
        """That of a stored ``value`` in its ``segment``."""
        heights = table.column_values(segment, segment.part)[: table.table.materials]
        return cls(value - table.from_visible(segment), sum(heights[1:], heights[0]))

    def kept(self, missed: Any, after: EndOfStep) -> EndOfStep:
        """This one where a step ``missed`` something, else the one ``after`` it."""
        import drjit as dr

        return EndOfStep(dr.select(missed, self.nearest, after.nearest), dr.select(missed, self.source, after.source))


class Ended(Protocol):
    """A stored ``value`` and its ``end``, None in a march that is not lit."""

    value: Any
    end: EndOfStep | None


@dataclass(frozen=True)
class Extent:
    """The part of a step in which its source is: from ``first`` to ``last``, as shares of the step.

    ``slope`` is the rise of the source from the one end to the other, relative to its mean there.
    """

    first: Any
    last: Any
    slope: Any

    @classmethod
    def between(cls, before: Ended, after: Ended, source: list[Any]) -> Extent | None:
        """From the visible value nearest to the first one to that nearest to the other one, where the value changes
        evenly; None in a march that is not lit. ``source`` is the mean of each material over the step.
        """
        import drjit as dr

        if before.end is None or after.end is None:
            return None
        run = after.value - before.value
        inverse = dr.select(run == 0.0, 0.0, dr.rcp(run))
        first, last = ((end.nearest - before.value) * inverse for end in (before.end, after.end))
        # The nearest visible value may be on the other side: then the source is somewhere between the two values.
        is_known = (run != 0.0) & (first >= 0.0) & (last <= 1.0) & (first < last)
        first, last = dr.select(is_known, first, 0.0), dr.select(is_known, last, 1.0)
        mean = larger(sum(source[1:], source[0]), 1e-30)
        return cls(first, last, (after.end.source - before.end.source) * (last - first) / mean)

    def place(self, depth: Any, transmittance: Any) -> Any:
        """Mean place, as a share of the step, of the light that leaves it through its optical ``depth``."""
        # The light of an even source, moved by its slope times the variance of places, which is nearly 1/(12 + τ²).
        within = mean_place(depth, transmittance) + self.slope / (12.0 + depth * depth)
        return self.first + (self.last - self.first) * bounded(within, 0.0, 1.0)
