# SPDX-License-Identifier: GPL-3.0-or-later
"""How an iteration of the march advances in one field, and what it sees there.

Within a step, sources and extinction are taken as constant. `midpoint` takes them at the middle of the step.
`preintegrated` takes their mean over the data values between the step's ends, from running integrals: no feature of
the transfer function is stepped over, however narrow. Both pass quickly over values that show nothing: the distance
from the value to the nearest one that does, times the pace (voxels per stored unit) of the brick, is a length in which
nothing can be missed.

An iteration has two parts, a skip through which nothing is gained and a step. All fields on a path share them, so a
field says how far it could skip, then how long its step may be after the skip that was agreed on, and then what it
saw in that step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from spectral_core.volume.march.arithmetic import larger, smaller
from spectral_core.volume.march.device_grid import BEYOND
from spectral_core.volume.march.device_table import DeviceTable, Segment
from spectral_core.volume.march.path import FieldPath

_GROWTH = 1.3  # of boldness, per step that missed nothing
_UNLIKELY = 0.8  # of the bound on a brick's slope, which is loose: `volume-bold` prints what is missed
# A mean from the difference of two integrals is off by float32's rounding of these over the run of values between.
# Where that is more than 1/4096 of the greatest height, the line through the middle of the run is nearer.
_ROUNDED = 2.0**-12


@dataclass(frozen=True)
class Ahead:
    """What lies before one field in an iteration, in voxels of that field.

    ``steps``: the ray stands in a brick that shows something. ``planned`` is the step of the rule (after a skip, the
    rule's first step). ``leap`` ends past the empty bricks, or past this one if it shows something; where the ray is
    not yet in the field, at the entry. ``pace`` is as in ``BrickWord``, any number where nothing shows.
    """

    steps: Any
    planned: Any
    leap: Any
    pace: Any = None

    def stays(self, way: Any) -> Any:
        """Whether the ray is still in this brick after ``way``, by a margin over how far ahead bricks are looked up."""
        return self.steps & (way < self.leap - 3.0 * BEYOND)


@dataclass(frozen=True)
class Step:
    """The step that all fields agreed on, in units of t: it begins at ``begin``, after the skip, and ends at ``end``.

    ``before`` is t before the skip.
    """

    before: Any
    begin: Any
    end: Any


@dataclass(frozen=True)
class Seen:
    """What one field shows in a step: ``source`` per material and ``extinction``, both per world unit.

    ``after`` is the field's state after the step. ``missed`` says that the step was too bold and is to be taken back;
    None where that cannot be.
    """

    source: list[Any]
    extinction: Any
    after: Any
    missed: Any = None


class FieldMarch(Protocol):
    """A quadrature: what the loop asks of each field."""

    def begin(self, field: FieldPath) -> Any:
        """The state at t = 0."""

    def skip(self, ahead: Ahead, now: Any) -> Any:
        """Voxels that this field can pass without a look."""

    def step(self, field: FieldPath, ahead: Ahead, now: Any, rest: Any) -> Any:
        """Voxels that a step may be long when ``rest`` of the own skip is left."""

    def see(self, field: FieldPath, ahead: Ahead, now: Any, step: Step) -> Seen:
        """Sources and extinction in the step."""

    def settled(self, now: Any, seen: Seen, missed: Any) -> Any:
        """The state after the step, or the one before where any field ``missed`` something."""


@dataclass
class MidpointState:
    """``clear``: voxels ahead in which nothing can show; None where the rule does not ask."""

    clear: Any


class Midpoint:
    """Sources and extinction at the middle of the step."""

    def begin(self, field: FieldPath) -> MidpointState:
        return MidpointState(field.rays.length * 0.0 if field.data.adapts else None)

    def skip(self, ahead: Ahead, now: MidpointState) -> Any:
        import drjit as dr

        clear = 0.0 if now.clear is None else smaller(now.clear, ahead.leap)
        return dr.select(ahead.steps, clear, ahead.leap)

    def step(self, field: FieldPath, ahead: Ahead, now: MidpointState, rest: Any) -> Any:
        import drjit as dr

        # A skip has its step in the same iteration, into a brick that is not known yet.
        return ahead.planned if rest is None else dr.select(ahead.steps, ahead.planned, larger(rest, ahead.planned))

    def see(self, field: FieldPath, ahead: Ahead, now: MidpointState, step: Step) -> Seen:
        import drjit as dr

        data, table = field.data, field.data.table
        middle = dr.fma(step.end - step.begin, 0.5, step.begin)
        point = field.rays.at(field.local(middle))
        segment = table.find(data.volume.value(point))
        source, extinction = data.optics(table.column_values(segment, segment.part), point)
        after = MidpointState(None)
        if now.clear is not None:
            # Known for this brick's slope alone, so only while the ray stays in it.
            half = field.local(step.end) - field.local(middle)
            clear = larger(table.clearance(segment) * ahead.pace - half, 0.0)
            after.clear = dr.select(
                ahead.stays(field.local(step.end) - field.local(step.before)) & field.inside(middle), clear, 0.0
            )
        return Seen(*_within(field.inside(middle), source, extinction), after)

    def settled(self, now: MidpointState, seen: Seen, missed: Any) -> MidpointState:
        import drjit as dr

        after: MidpointState = seen.after
        if missed is not None and after.clear is not None:
            after.clear = dr.select(missed, now.clear, after.clear)
        return after


@dataclass
class PreintegratedState:
    """Where the last step ended on the data's axis.

    ``value`` is the stored value there, ``segment`` its segment's number and ``integrals`` the running integrals of
    the columns. ``clear`` is the distance in stored units to the next value that shows something, and ``bold`` how
    many times as far the ray dares to go; both None where the rule does not ask.
    """

    value: Any
    segment: Any
    integrals: list[Any]
    clear: Any
    bold: Any


class Preintegrated:
    """Means over the data values between the ends of the step."""

    def begin(self, field: FieldPath) -> PreintegratedState:
        table = field.data.table
        value = field.data.volume.value(field.rays.origin, field.rays.length > 0)
        segment = table.find(value, field.rays.length > 0)
        clear, bold = (table.clearance(segment), value * 0.0 + 1.0) if field.data.adapts else (None, None)
        return PreintegratedState(value, segment.index, table.running_integrals(segment), clear, bold)

    def skip(self, ahead: Ahead, now: PreintegratedState) -> Any:
        import drjit as dr

        return dr.select(ahead.steps, 0.0, ahead.leap)

    def step(self, field: FieldPath, ahead: Ahead, now: PreintegratedState, rest: Any) -> Any:
        """A step through values that are known to show nothing may be longer than planned: its means are zero."""
        import drjit as dr

        return dr.select(ahead.steps, self._reach(ahead, now), 0.0 if rest is None else rest)

    def _reach(self, ahead: Ahead, now: PreintegratedState) -> Any:
        if now.clear is None:
            return ahead.planned
        return larger(ahead.planned, smaller(now.clear * now.bold * ahead.pace, ahead.leap))

    def see(self, field: FieldPath, ahead: Ahead, now: PreintegratedState, step: Step) -> Seen:

        data, table = field.data, field.data.table
        local = field.local(step.end)
        point = field.rays.at(smaller(local if field.begin is None else larger(local, 0.0), field.rays.length))
        value = data.volume.value(point)
        segment = table.find(value)
        after = PreintegratedState(value, segment.index, table.running_integrals(segment), None, None)
        means = _means(table, now, after, segment)
        inside = field.inside(step.begin)
        # On a path of its own the field has no width without a step; only among others is there something to hide.
        seen = Seen(*_within(inside if inside is True else inside & ahead.steps, *data.optics(means, point)), after)
        if now.clear is None:
            return seen
        after.clear, after.bold = table.clearance(segment), now.bold
        way = local - field.local(step.before)
        # A bold step was longer than planned and than certain. What if something showed on the way?
        bold = ahead.steps & (self._reach(ahead, now) > ahead.planned) & (now.bold > 1.0)
        return Seen(seen.source, seen.extinction, after, bold & _missed(now, after, way, ahead.pace))

    def settled(self, now: PreintegratedState, seen: Seen, missed: Any) -> PreintegratedState:
        """Where a step is taken back the field stays as it was; the one that missed goes on with care."""
        import drjit as dr

        after: PreintegratedState = seen.after
        if missed is None:
            return after

        def kept(old: Any, new: Any) -> Any:
            return dr.select(missed, old, new)

        bold = now.bold
        if bold is not None:
            bold = dr.select(seen.missed, 1.0, smaller(bold * _GROWTH, self.boldest))
        return PreintegratedState(
            kept(now.value, after.value),
            kept(now.segment, after.segment),
            [kept(old, new) for old, new in zip(now.integrals, after.integrals, strict=True)],
            None if now.clear is None else kept(now.clear, after.clear),
            bold,
        )

    def __init__(self, boldest: Any) -> None:
        self.boldest = boldest


def quadrature_of(field: FieldPath) -> FieldMarch:
    """The quadrature that a field asks for."""
    return Midpoint() if field.data.quadrature == "midpoint" else Preintegrated(field.data.boldest)


def _within(inside: Any, source: list[Any], extinction: Any) -> tuple[list[Any], Any]:
    """Nothing outside the field, or where a field that others share the path with has no step of its own."""
    import drjit as dr

    if inside is True:
        return source, extinction
    return [dr.select(inside, each, 0.0) for each in source], dr.select(inside, extinction, 0.0)


def _missed(now: PreintegratedState, after: PreintegratedState, way: Any, pace: Any) -> Any:
    """Whether a long step may have met what shows: at its end, between values on both sides, or there and back.

    The last needs a value that changes as fast as any in its brick does, first one way and then the other; as fast as
    ``_UNLIKELY`` of that is left out.
    """
    at_end = after.clear <= 0.0
    there_and_back = (now.clear + after.clear) * pace < _UNLIKELY * way
    missed = at_end | there_and_back
    for old, new in zip(now.integrals, after.integrals, strict=True):
        missed |= old != new
    return missed


def _means(table: DeviceTable, now: PreintegratedState, after: PreintegratedState, segment: Segment) -> list[Any]:
    """Mean of each column between two stored values.

    Inside one segment the column's line at the middle is exact. Else it is the difference of the running integrals,
    unless these have been rounded to too much: then the line of the segment that the step ends in.
    """
    import drjit as dr

    run = after.value - now.value
    crosses = now.segment != segment.index
    inverse = dr.rcp(dr.select(crosses & (run != 0.0), run, 1.0))
    lines = table.column_values(segment, segment.part - 0.5 * run)
    length = dr.abs(run)
    means = []
    for line, old, new, height in zip(lines, now.integrals, after.integrals, table.heights, strict=True):
        by_difference = crosses & (length * height > _ROUNDED * dr.abs(new))
        means.append(larger(dr.select(by_difference, (new - old) * inverse, line), 0.0))
    return means
