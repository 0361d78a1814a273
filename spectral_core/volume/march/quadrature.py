# SPDX-License-Identifier: GPL-3.0-or-later
"""Advance of an iteration of the march in one field, with the source and extinction of its step.

Within a step, sources and extinction are taken as constant. `midpoint` takes them at the middle of the step.
`preintegrated` takes their mean over the data values between the step's ends, from running integrals: no feature of the
transfer function between these values is missed, however narrow. Both take long steps through invisible values: the
distance from the value to the nearest visible one, times the pace (voxels per stored unit) of the brick, is a length
over which nothing can be visible.

An iteration has two parts: a skip, over which no light is added, and a step. All fields on a path share both. So each
field first returns its longest skip, then its longest step after the common skip, and then evaluates the common step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from spectral_core.volume.march.arithmetic import larger, smaller
from spectral_core.volume.march.column_means import EndOfStep, Extent, column_means
from spectral_core.volume.march.device.grid import BEYOND
from spectral_core.volume.march.march_input import on_face
from spectral_core.volume.march.path import FieldPath

_GROWTH = 1.3  # of the factor ``stretch``, per step in which nothing was missed
_WIDENING = 1.25  # of steps through visible values, where the march approaches objects
_UNLIKELY = (
    0.8  # of the bound on a brick's slope, which is loose; `volume-speculation` prints the error that this causes
)


@dataclass(frozen=True)
class Ahead:
    """The brick lookup of one field in an iteration; lengths are in voxels of that field.

    ``steps``: True if the ray is in a visible brick. ``planned`` is the step of the rule (after a skip, the rule's
    first step). ``skip`` is the distance to the end of the empty bricks, or of this brick if it is visible, or to the
    entry if the ray is not yet in the field. ``pace`` is as in ``BrickWord``; it has no meaning in empty bricks.
    """

    steps: Any
    planned: Any
    skip: Any
    pace: Any = None

    def stays(self, way: Any) -> Any:
        """True if the ray is still in this brick after ``way`` voxels, with a margin above the lookahead ``BEYOND``."""
        return self.steps & (way < self.skip - 3.0 * BEYOND)


@dataclass(frozen=True)
class Step:
    """The common step of all fields, in units of t: it begins at ``begin``, after the skip, and ends at ``end``.

    ``before`` is t before the skip.
    """

    before: Any
    begin: Any
    end: Any


@dataclass(frozen=True)
class StepOptics:
    """Optical properties of one field in a step: ``source`` per material and ``extinction``, both per world unit.

    ``after`` is the field's state after the step. ``missed``: True if the step was too long and must be repeated; None
    if that cannot happen. ``extent`` is where in the step the source is; None if it is everywhere, or if no light asks.
    """

    source: list[Any]
    extinction: Any
    after: Any
    missed: Any = None
    extent: Extent | None = None


class FieldMarch(Protocol):
    """A quadrature: the methods that the loop calls for each field."""

    def begin(self, field: FieldPath) -> Any:
        """The state at t = 0."""

    def skip(self, ahead: Ahead, now: Any) -> Any:
        """Voxels that this field can skip without a sample."""

    def step(self, field: FieldPath, ahead: Ahead, now: Any, rest: Any) -> Any:
        """Longest step in voxels when ``rest`` voxels of the field's own skip are left."""

    def evaluate(self, field: FieldPath, ahead: Ahead, now: Any, step: Step) -> StepOptics:
        """Evaluate sources and extinction in the step."""

    def settled(self, now: Any, optics: StepOptics, missed: Any) -> Any:
        """The state after the step, or the one before if any field ``missed`` something."""


@dataclass
class MidpointState:
    """``clear``: voxels ahead in which nothing can be visible; None if the rule does not use it."""

    clear: Any


class Midpoint:
    """Sources and extinction at the middle of the step."""

    def begin(self, field: FieldPath) -> MidpointState:
        return MidpointState(field.rays.length * 0.0 if field.data.adapts else None)

    def skip(self, ahead: Ahead, now: MidpointState) -> Any:
        import drjit as dr

        # The clearance holds within its brick only, and the skip ends with it.
        clear = 0.0 if now.clear is None else smaller(now.clear, ahead.skip)
        return dr.select(ahead.steps, clear, ahead.skip)

    def step(self, field: FieldPath, ahead: Ahead, now: MidpointState, rest: Any) -> Any:
        import drjit as dr

        # The step after a skip belongs to the same iteration, and its brick has not been looked up.
        return ahead.planned if rest is None else dr.select(ahead.steps, ahead.planned, larger(rest, ahead.planned))

    def evaluate(self, field: FieldPath, ahead: Ahead, now: MidpointState, step: Step) -> StepOptics:
        import drjit as dr

        data, table = field.data, field.data.table
        middle = dr.fma(step.end - step.begin, 0.5, step.begin)
        point = field.rays.at(field.local(middle))
        segment = table.find(data.volume.value(point))
        source, extinction = data.optics(table.column_values(segment, segment.part), point)
        after = MidpointState(None)
        if now.clear is not None:
            # The clearance follows from this brick's slope, so it holds only while the ray stays in this brick.
            half = field.local(step.end) - field.local(middle)
            clear = larger(table.clearance(segment) * ahead.pace - half, 0.0)
            after.clear = dr.select(
                ahead.stays(field.local(step.end) - field.local(step.before)) & field.inside(middle), clear, 0.0
            )
        return StepOptics(*_within(field.inside(middle), source, extinction), after)

    def settled(self, now: MidpointState, optics: StepOptics, missed: Any) -> MidpointState:
        import drjit as dr

        after: MidpointState = optics.after
        if missed is not None and after.clear is not None:
            after.clear = dr.select(missed, now.clear, after.clear)
        return after


@dataclass
class PreintegratedState:
    """Data value at the end of the last step.

    ``value`` is the stored value there, ``segment`` its segment's number and ``integrals`` the running integrals of
    the columns. ``clear`` is the distance in stored units to the next value that shows something, and ``stretch`` the
    factor by which a step may exceed the certain distance; both None if the rule does not use them. ``step`` is the
    length of the last step in voxels, None unless the march ``approaches``; ``end`` is None unless the march is lit.
    """

    value: Any
    segment: Any
    integrals: list[Any]
    clear: Any
    stretch: Any
    step: Any = None
    end: EndOfStep | None = None


class Preintegrated:
    """Means over the data values between the ends of the step."""

    def begin(self, field: FieldPath) -> PreintegratedState:
        table = field.data.table
        value = field.data.volume.value(field.rays.origin, field.rays.length > 0)
        segment = table.find(value, field.rays.length > 0)
        clear, stretch = (table.clearance(segment), value * 0.0 + 1.0) if field.data.adapts else (None, None)
        state = PreintegratedState(value, segment.index, table.running_integrals(segment), clear, stretch)
        if field.data.approaches and clear is not None:
            state.step = value * 0.0 + field.data.grid.longest
        if self.is_lit:
            state.end = EndOfStep.at(table, value, segment)
        return state

    def skip(self, ahead: Ahead, now: PreintegratedState) -> Any:
        import drjit as dr

        return dr.select(ahead.steps, 0.0, ahead.skip)

    def step(self, field: FieldPath, ahead: Ahead, now: PreintegratedState, rest: Any) -> Any:
        """A step through values that are known to be invisible may be longer than planned: its means are zero."""
        import drjit as dr

        reach = self._reach(ahead, now)
        if now.step is not None:
            # From an invisible value only as far as nothing is missed. A rest of the planned step that is shorter than
            # the least step joins it: the distance along the ray has too few digits for the width of a tiny step.
            certain, least = smaller(now.clear * ahead.pace, ahead.skip), 2.0 * field.data.shortest_step
            nears = (now.clear > 0.0) & (certain < ahead.planned - least)
            reach = dr.select(nears, larger(certain, least), reach)
            # A full step from the front of a thin object would end behind it; its mean would hardly show the object.
            reach = dr.select(now.clear > 0.0, reach, smaller(reach, _WIDENING * now.step))
        return dr.select(ahead.steps, reach, 0.0 if rest is None else rest)

    def _reach(self, ahead: Ahead, now: PreintegratedState) -> Any:
        if now.clear is None:
            return ahead.planned
        return larger(ahead.planned, smaller(now.clear * now.stretch * ahead.pace, ahead.skip))

    def evaluate(self, field: FieldPath, ahead: Ahead, now: PreintegratedState, step: Step) -> StepOptics:

        data, table = field.data, field.data.table
        local = field.local(step.end)
        point = field.rays.at(smaller(local if field.begin is None else larger(local, 0.0), field.rays.length))
        value = data.volume.value(on_face(point) if data.ends_at_faces else point)
        segment = table.find(value)
        after = PreintegratedState(value, segment.index, table.running_integrals(segment), None, None)
        means = column_means(table, now, after, segment)
        inside = field.inside(step.begin)
        # Where a single field has no step, the width is 0. Only on a shared path must its optics be set to zero.
        source, extinction = _within(inside if inside is True else inside & ahead.steps, *data.optics(means, point))
        if now.end is not None:
            after.end = EndOfStep.at(table, value, segment)
        extent = Extent.between(now, after, source)
        if now.clear is None:
            return StepOptics(source, extinction, after, extent=extent)
        after.clear, after.stretch = table.clearance(segment), now.stretch
        if now.step is not None:
            after.step = larger(local - field.local(step.begin), data.shortest_step)
        # The check covers the whole way since the last known value, the skip included.
        way = local - field.local(step.before)
        # A speculative step is longer than planned and longer than is certain, so it must be checked for missed values.
        speculative = ahead.steps & (self._reach(ahead, now) > ahead.planned) & (now.stretch > 1.0)
        return StepOptics(source, extinction, after, speculative & _missed(now, after, way, ahead.pace), extent)

    def settled(self, now: PreintegratedState, optics: StepOptics, missed: Any) -> PreintegratedState:
        """If a step is rejected, the state is kept, and the field that missed something resets ``stretch`` to 1."""
        import drjit as dr

        after: PreintegratedState = optics.after
        if missed is None:
            return after

        def kept(old: Any, new: Any) -> Any:
            return dr.select(missed, old, new)

        stretch = now.stretch
        if stretch is not None:
            stretch = dr.select(optics.missed, 1.0, smaller(stretch * _GROWTH, self.most_stretch))
        return PreintegratedState(
            kept(now.value, after.value),
            kept(now.segment, after.segment),
            [kept(old, new) for old, new in zip(now.integrals, after.integrals, strict=True)],
            None if now.clear is None else kept(now.clear, after.clear),
            stretch,
            None if now.step is None else kept(now.step, after.step),
            None if now.end is None or after.end is None else now.end.kept(missed, after.end),
        )

    def __init__(self, most_stretch: Any, is_lit: bool) -> None:
        self.most_stretch, self.is_lit = most_stretch, is_lit


def quadrature_of(field: FieldPath, *, is_lit: bool = False) -> FieldMarch:
    """The quadrature of a field; ``is_lit``: also find where in a step its light comes from."""
    return Midpoint() if field.data.quadrature == "midpoint" else Preintegrated(field.data.most_stretch, is_lit)


def _within(inside: Any, source: list[Any], extinction: Any) -> tuple[list[Any], Any]:
    """Zero outside the field, and where a field of a shared path has no step."""
    import drjit as dr

    if inside is True:
        return source, extinction
    return [dr.select(inside, each, 0.0) for each in source], dr.select(inside, extinction, 0.0)


def _missed(now: PreintegratedState, after: PreintegratedState, way: Any, pace: Any) -> Any:
    """True if a long step may have missed something: at its end, between the two end values, or on an excursion.

    On an excursion the value leaves the range of the end values and returns. It must then change nearly as fast as the
    brick's bound on the slope allows; excursions that need more than ``_UNLIKELY`` of that bound are disregarded.
    """
    at_end = after.clear <= 0.0
    # The path to a visible value and back needs at least this length, even with the slope at its bound everywhere.
    excursion = (now.clear + after.clear) * pace < _UNLIKELY * way
    missed = at_end | excursion
    for old, new in zip(now.integrals, after.integrals, strict=True):
        missed |= old != new
    return missed
