# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions of interest: ranges, linear constraints and a p-norm ball over the parameters of a sweep.

A region is stated in values; ranges that it does not name are those of the sweep. ``in_unit_cube`` is the same region
in the coordinates of the lattice. ``transferred`` applies it to another sweep by parameter names.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.explore.sweep.constraints import parse_constraint
from spectral_core.explore.sweep.parameters import Parameter, Space, Value
from spectral_core.lattice import Region, ball, box, halfspaces

ROUNDING = 1e-9
"""Of a scaled distance: points on the border of a ball are in it."""


@dataclass(frozen=True, slots=True)
class NormBall:
    """Points whose scaled distance from a center is at most 1, in the p-norm.

    ``center``: values by parameter. ``radii``: in the parameter's unit, in decades where its scale is log. A parameter
    without a radius is not limited by the ball.
    """

    center: Mapping[str, float]
    radii: Mapping[str, float]
    p: float = 2.0

    def distance(self, space: Space, values: Mapping[str, Value]) -> float:
        """Scaled distance of a point from the center, over the parameters that have a radius."""
        apart = []
        for name, radius in self.radii.items():
            parameter = space[name]
            away = parameter.coordinate(values[name]) - parameter.place(float(self.center[name]))
            apart.append(away * parameter.width / radius)
        return float(np.linalg.norm(apart, ord=self.p))


@dataclass(frozen=True, slots=True)
class RegionOfInterest:
    """Ranges (values by name, inside or beyond those of the sweep), chosen values, constraints, one ball."""

    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    choices: Mapping[str, tuple[Value, ...]] = field(default_factory=dict)
    constraints: tuple[str, ...] = ()
    ball: NormBall | None = None
    name: str = ""

    def checked(self, space: Space) -> RegionOfInterest:
        """This region, after a check against the parameters; raises InvalidInputError that names the misfit."""
        for name, (low, high) in self.ranges.items():
            parameter = space[name]
            if parameter.kind == "choice":
                raise InvalidInputError(f"{name} chooses among values; limit it with choices, not with a range")
            if not (math.isfinite(low) and math.isfinite(high) and low <= high):
                raise InvalidInputError(f"the region's {name} runs from {low} to {high}; expected low <= high")
            if low == high and parameter.kind == "real":
                raise InvalidInputError(f"the region's {name} is {low} alone; leave some room between low and high")
            if parameter.scale == "log" and low <= 0:
                raise InvalidInputError(f"the region's {name} starts at {low} on a log scale; expected above 0")
            if parameter.kind == "integer" and math.ceil(low) > math.floor(high):
                raise InvalidInputError(
                    f"the region's {name} runs from {low} to {high}; expected ends with a whole number between them"
                )
        chosen = {name: _own_choices(space[name], values) for name, values in self.choices.items()}
        for name, values in chosen.items():
            parameter = space[name]
            if not values:
                raise InvalidInputError(f"the region chooses no value of {name}; name some, or leave the entry out")
            for value in values:
                if parameter.kind != "choice" or value not in parameter.choices:
                    known = f"one of {', '.join(map(repr, parameter.choices))}" if parameter.choices else "a range"
                    raise InvalidInputError(f"the region's {name} has the value {value!r}; expected {known}")
        for text in self.constraints:
            parse_constraint(text, space)
        if self.ball is not None:
            _check_ball(self.ball, space)
        return replace(self, choices=chosen)

    def ends(self, parameter: Parameter) -> tuple[float, float]:
        """The ends of a range of numbers in this region, whole for a parameter that counts."""
        low, high = self.ranges.get(parameter.name, (parameter.low, parameter.high))
        return (math.ceil(low), math.floor(high)) if parameter.kind == "integer" else (low, high)

    def in_unit_cube(self, space: Space) -> Region:
        """A convex region over unit coordinates, with the whole interval of each whole number: a part of it would give
        the number at a border a smaller share. ``contains`` tells which points count, also as to choices.
        """
        low, high = self._unit_box(space)
        for index, parameter in enumerate(space.parameters):
            if self.ball is not None and parameter.kind == "integer" and parameter.name in self.ball.radii:
                first, last = (parameter.place(end) for end in _whole_in_ball(self.ball, parameter))
                low[index], high[index] = max(low[index], first), min(high[index], last)
                if low[index] >= high[index]:
                    raise InvalidInputError(f"the ball has no whole number of {parameter.name}; widen it, or move it")
        region = box(low, high)
        least = {p.name: self.ends(p)[0] for p in space.parameters if p.kind == "integer"}
        for one in (one for text in self.constraints for one in parse_constraint(text, space)):
            row, bound = one.row(space, least)
            region = region & halfspaces([row], [bound])
        within = self.ball and _unit_ball(self.ball, space)
        return region & within if within else region

    def _unit_box(self, space: Space) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Ends of the ranges in unit coordinates, (n,) each; choices have their whole axis."""
        low, high = np.zeros(len(space.parameters)), np.ones(len(space.parameters))
        for index, parameter in enumerate(space.parameters):
            if parameter.name in self.ranges:
                ends = self.ends(parameter)
                if parameter.kind == "integer":
                    low[index] = parameter.place(ends[0] - 0.5)
                    high[index] = parameter.place(ends[1] + 0.5)
                else:
                    low[index], high[index] = (parameter.coordinate(v) for v in ends)
        return low, high

    def contains(self, space: Space, values: Mapping[str, Value]) -> bool:
        """True if the point with these values lies in the region (ends included)."""
        return self.membership(space)(values)

    def membership(self, space: Space) -> Callable[[Mapping[str, Value]], bool]:
        """``contains`` for many points: the constraints are read once."""
        constraints = [one for text in self.constraints for one in parse_constraint(text, space)]

        def contains(values: Mapping[str, Value]) -> bool:
            for parameter in space.parameters:
                value = values[parameter.name]
                if parameter.kind == "choice":
                    if value not in self.choices.get(parameter.name, parameter.choices):
                        return False
                    continue
                low, high = self.ranges.get(parameter.name, (parameter.low, parameter.high))
                if isinstance(value, str) or not low <= value <= high:
                    return False
            numbers = {name: value for name, value in values.items() if not isinstance(value, str)}
            if not all(one.holds(space, numbers) for one in constraints):
                return False
            return self.ball is None or self.ball.distance(space, values) <= 1.0 + ROUNDING

        return contains

    def onto_choices(self, space: Space, drawn: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (m, n) of the unit cube, whose coordinates are spread over the values that the region chooses."""
        spread = drawn.copy()
        for index, parameter in enumerate(space.parameters):
            chosen = self.choices.get(parameter.name)
            if chosen:
                places = np.array([k for k, value in enumerate(parameter.choices) if value in chosen])
                within = drawn[:, index] * len(places)
                which = np.minimum(within.astype(int), len(places) - 1)
                spread[:, index] = (places[which] + within - which) / len(parameter.choices)
        return spread

    def spread(self, space: Space, drawn: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (m, n) of the unit cube, spread over the ranges and choices of the region; constraints and the ball do
        not count. Whole numbers and choices have the coordinates of their own values.
        """
        low, high = self._unit_box(space)
        spread = self.onto_choices(space, low + drawn * (high - low))
        for index, parameter in enumerate(space.parameters):
            if parameter.kind != "real":
                spread[:, index] = [parameter.coordinate(parameter.value(float(one))) for one in spread[:, index]]
        return spread

    def limited_as(self, other: RegionOfInterest) -> RegionOfInterest:
        """This region with the constraints and the ball of another: they tell which settings are wanted at all, and a
        part of the other region has them, too. Ranges and choices that this region does not name are the other's.
        """
        constraints = tuple(dict.fromkeys((*self.constraints, *other.constraints)))
        return RegionOfInterest(
            {**other.ranges, **self.ranges}, {**other.choices, **self.choices}, constraints, self.ball or other.ball,
            self.name,
        )  # fmt: skip

    def to_dict(self) -> dict[str, Any]:
        """Plain entries for a document."""
        plain: dict[str, Any] = {}
        if self.name:
            plain["name"] = self.name
        if self.ranges:
            plain["ranges"] = {name: list(ends) for name, ends in self.ranges.items()}
        if self.choices:
            plain["choices"] = {name: list(values) for name, values in self.choices.items()}
        if self.constraints:
            plain["constraints"] = list(self.constraints)
        if self.ball is not None:
            one = self.ball
            plain["ball"] = {
                "center": dict(one.center),
                "radii": dict(one.radii),
                "p": "inf" if math.isinf(one.p) else one.p,
            }
        return plain

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> RegionOfInterest:
        """The region of a document's table."""
        strange = sorted(set(plain) - {"name", "ranges", "choices", "constraints", "ball"})
        if strange:
            raise InvalidInputError(
                f"the region has the entry {strange[0]!r}; expected name, ranges, choices, constraints, ball"
            )
        try:
            ranges = {str(name): (float(low), float(high)) for name, (low, high) in plain.get("ranges", {}).items()}
            choices = {
                str(name): (values,) if isinstance(values, str) else tuple(values)
                for name, values in plain.get("choices", {}).items()
            }
            given = plain.get("constraints", [])
            constraints = (given,) if isinstance(given, str) else tuple(given)
            one = None
            if plain.get("ball") is not None:
                table = plain["ball"]
                one = NormBall(
                    {str(k): float(v) for k, v in table["center"].items()},
                    {str(k): float(v) for k, v in table["radii"].items()},
                    float(table.get("p", 2.0)),
                )
        except (TypeError, ValueError, KeyError, AttributeError, OverflowError) as error:
            raise InvalidInputError(
                f"the region cannot be read ({error!r}); expected ranges = {{name = [low, high]}}, constraints = "
                "[texts], ball = {center = {…}, radii = {…}, p = 2}"
            ) from error
        return cls(ranges, choices, constraints, one, str(plain.get("name", "")))


def bounding_region(space: Space, points: Sequence[Mapping[str, Value]], name: str = "") -> RegionOfInterest:
    """The smallest ranges and choices that contain all points: the region of a label."""
    if not points:
        raise InvalidInputError("no point is given, so there is no region around them; select some first")
    ranges: dict[str, tuple[float, float]] = {}
    choices: dict[str, tuple[Value, ...]] = {}
    for parameter in space.parameters:
        values = [point[parameter.name] for point in points]
        if parameter.kind == "choice":
            choices[parameter.name] = tuple(choice for choice in parameter.choices if choice in values)
            continue
        numbers = [float(value) for value in values]
        low, high = min(numbers), max(numbers)
        if low == high and parameter.kind == "real":  # one value: a hundredth of the range around it
            middle = parameter.coordinate(low)
            ends = np.array([middle - 0.005, middle + 0.005])
            if 0.0 <= middle <= 1.0:  # beyond the range of the sweep a value may have no meaning
                ends = np.clip(ends, 0.0, 1.0)
            low, high = (float(parameter.value(float(end))) for end in ends)
        ranges[parameter.name] = (low, high)
    return RegionOfInterest(ranges, choices, name=name)


def _own_choices(parameter: Parameter, values: Sequence[Value]) -> tuple[Value, ...]:
    """The values as the parameter has them: a table of numbers and texts has all of them as texts."""
    by_text = {str(choice): choice for choice in parameter.choices}
    return tuple(value if value in parameter.choices else by_text.get(str(value), value) for value in values)


def _check_ball(one: NormBall, space: Space) -> None:
    if not one.radii or not one.p >= 1:
        raise InvalidInputError(f"the ball has p = {one.p} and {len(one.radii)} radii; expected p >= 1 and some radii")
    for name, radius in one.radii.items():
        if space[name].kind == "choice":
            raise InvalidInputError(f"{name} chooses among values, so a ball cannot limit it")
        if name not in one.center or not (math.isfinite(radius) and radius > 0):
            raise InvalidInputError(f"the ball needs a center and a positive radius for {name}; got {radius}")
    for name, value in one.center.items():
        if not math.isfinite(value) or (space[name].scale == "log" and value <= 0):
            above = " above 0" if space[name].scale == "log" else ""
            raise InvalidInputError(f"the center of the ball has {name} = {value}; expected a finite number{above}")


def _unit_ball(one: NormBall, space: Space) -> Region | None:
    """The ball over parameters that do not count, None without one; others get a radius far beyond their range."""
    center, radii = np.full(len(space.parameters), 0.5), np.full(len(space.parameters), 1e6)
    limited = [parameter for parameter in space.parameters if parameter.name in one.radii and parameter.kind == "real"]
    for parameter in limited:
        index = space.names.index(parameter.name)
        center[index] = parameter.place(float(one.center[parameter.name]))
        radii[index] = one.radii[parameter.name] / parameter.width
    return ball(center, radii, p=one.p) if limited else None


def _whole_in_ball(one: NormBall, parameter: Parameter) -> tuple[float, float]:
    """The ends of the intervals of the whole numbers of a ball."""
    center, radius = float(one.center[parameter.name]), one.radii[parameter.name] * (1.0 + ROUNDING)
    if parameter.scale == "linear":
        return math.ceil(center - radius) - 0.5, math.floor(center + radius) + 0.5
    middle = math.log10(center)
    first, last = 10.0 ** max(middle - radius, -300.0), 10.0 ** min(middle + radius, 300.0)
    return math.ceil(first) - 0.5, math.floor(last) + 0.5
