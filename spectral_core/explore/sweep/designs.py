# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampling designs: lattice, Sobol, Latin hypercube or a list; exactly as many different points as asked.

The lattice is the default: it keeps points apart in any convex region, every prefix of its order is an even coarser
sample, and a larger budget or another region adds points without moving one. Sobol points estimate means better, and
spread better on single axes; a Latin hypercube is for one small sample and cannot be refined (docs/explore.md).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_choices
from spectral_core.errors import InvalidInputError, counted
from spectral_core.explore.sweep.batches.drawn import sobol_batches
from spectral_core.explore.sweep.batches.latin import latin_batches
from spectral_core.explore.sweep.parameters import Space, Value
from spectral_core.explore.sweep.region import RegionOfInterest
from spectral_core.lattice import (
    Frame,
    Region,
    level_for,
    make_lattice,
    progressive_fill,
    progressive_points,
    unit_cube,
)

DesignKind = Literal["lattice", "sobol", "latin_hypercube", "list"]
DESIGNS: tuple[DesignKind, ...] = ("lattice", "sobol", "latin_hypercube", "list")
MAX_LATTICE_DIMENSIONS = 10
MAX_BUDGET = 1_000_000
MOST_LISTED = 4096
"""Combinations of whole numbers and choices that are counted one by one, with the constraints; up to the budget, if
that is larger."""
FEW = 16
"""A region with less than this part of the budget at the lattice's first level is sampled from a finer one on."""
MOST_TRIED = 50_000
"""Candidates that are tested, beyond 200 per point, before a region is reported to hold too few points."""
Point = dict[str, Value]


@dataclass(frozen=True, slots=True)
class Design:
    """Sampling of a region. ``frame`` and ``shifts`` place the lattice; None until the first points are made."""

    kind: DesignKind = "lattice"
    budget: int = 64
    seed: int = 0
    rate: int = 2
    points: tuple[Mapping[str, Value], ...] = ()
    frame: Frame | None = None
    shifts: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        require_choices(self)
        if isinstance(self.budget, bool) or not isinstance(self.budget, int) or not 1 <= self.budget <= MAX_BUDGET:
            raise InvalidInputError(
                f"the budget is {self.budget!r} points; expected a whole number from 1 to {MAX_BUDGET}"
            )
        if isinstance(self.seed, bool) or not isinstance(self.seed, int) or not 0 <= self.seed < 2**32:
            raise InvalidInputError(f"the seed is {self.seed!r}; expected a whole number from 0 to 2^32 - 1")
        if isinstance(self.rate, bool) or not isinstance(self.rate, int) or self.rate < 2:
            raise InvalidInputError(f"the lattice's rate is {self.rate!r}; expected a whole number from 2")

    def to_dict(self) -> dict[str, Any]:
        """Plain entries for the project file."""
        plain: dict[str, Any] = {"kind": self.kind, "budget": self.budget, "seed": self.seed, "rate": self.rate}
        if self.frame is not None:
            plain |= {"frame": self.frame.to_dict(), "shifts": list(self.shifts)}
        if self.points:
            plain["points"] = [dict(point) for point in self.points]
        return plain

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Design:
        """The design of a document or project file."""
        strange = sorted(set(plain) - {"kind", "budget", "seed", "rate", "points", "frame", "shifts"})
        if strange:
            raise InvalidInputError(
                f"the design has the entry {strange[0]!r}; expected kind, budget, seed, rate, points"
            )
        listed = plain.get("points", ())
        if not isinstance(listed, list | tuple) or not all(isinstance(point, Mapping) for point in listed):
            raise InvalidInputError("the points of a design must be a list of tables: points = [{a = 1.0, b = 2.0}, …]")
        points = tuple(dict(point) for point in listed)
        frame = None if plain.get("frame") is None else Frame.from_dict(plain["frame"])
        return cls(
            plain.get("kind", "list" if points else "lattice"),
            plain.get("budget", len(points) or 64),
            plain.get("seed", 0),
            plain.get("rate", 2),
            points,
            frame,
            tuple(plain.get("shifts", ())),
        )

    def placed(self, space: Space) -> Design:
        """The design with its lattice placed over the whole unit cube; later regions share its points."""
        if self.kind != "lattice" or self.frame is not None:
            return self
        if len(space.parameters) > MAX_LATTICE_DIMENSIONS:
            raise InvalidInputError(
                f"the sweep has {len(space.parameters)} parameters; a lattice has at most {MAX_LATTICE_DIMENSIONS}. "
                "Choose the design Sobol (kind = 'sobol'), or sweep fewer parameters"
            )
        lattice = make_lattice(len(space.parameters), self.rate, criterion="packing")
        fill = progressive_fill(unit_cube(len(space.parameters)), self.budget, lattice=lattice, seed=self.seed)
        return replace(self, frame=fill.frame, shifts=fill.shifts)


def design_points(
    space: Space, region: RegionOfInterest, design: Design, *, known: Sequence[Point] = ()
) -> tuple[list[Point], list[str]]:
    """The points of a region, and notes for the plan.

    Parameters
    ----------
    space : the parameters; its ranges span the unit cube that the design was placed in.
    region : where to sample.
    design : how, and how many: exactly ``budget`` different points, unless fewer exist or more are known already.
    known : points that are computed already. Those inside the region come first and count.

    Raises
    ------
    InvalidInputError : where the region is empty, or the list of points does not fit the parameters.
    """
    region.checked(space)
    if design.kind == "list":
        return _listed_points(space, region, design)
    notes: list[str] = []
    contains = region.membership(space)
    chosen = {_address(space, point): dict(point) for point in known if contains(point)}
    budget = design.budget
    limit = _combinations(space, region)
    if limit is not None and limit <= max(MOST_LISTED, budget):
        every = [point for point in _all_points(space, region) if contains(point)]
        if len(every) <= budget:
            if len(every) < budget:
                notes.append(
                    f"the region holds {counted(len(every), 'different point')}, fewer than the budget of {budget}: "
                    "all are taken"
                )
            with suppress(InvalidInputError):  # a flat region has whole numbers, but no room for a lattice
                # in the order of the design as far as it goes, because a run may end early
                _add_drawn(chosen, len(every), space, region, design, 8 * len(every))
            for point in every:
                chosen.setdefault(_address(space, point), point)
            return list(chosen.values()), notes
    _add_drawn(chosen, budget, space, region, design, MOST_TRIED + 200 * budget)
    if len(chosen) < budget:
        raise InvalidInputError(
            f"only {len(chosen)} of {budget} different points were found in the region; its constraints leave almost "
            "no room, or its parameters take few values. Widen it, ask for fewer points"
            + ("" if design.kind == "lattice" else ", or choose the design lattice, which fills narrow regions")
        )
    return list(chosen.values()), notes


def _listed_points(space: Space, region: RegionOfInterest, design: Design) -> tuple[list[Point], list[str]]:
    """The different points of a list that are in the region, and a note if some are not."""
    chosen: dict[tuple[Value, ...], Point] = {}
    contains = region.membership(space)
    for point in design.points:
        _check_listed(space, point)
        if contains(point):
            one = {p.name: p.counted(point[p.name]) for p in space.parameters}
            chosen.setdefault(_address(space, one), one)
    left_out = len(design.points) - len(chosen)
    note = (
        f"{counted(left_out, 'listed point is', 'listed points are')} left out: outside of the region, or listed twice"
    )
    return list(chosen.values()), [note] if left_out else []


def _add_drawn(
    chosen: dict[tuple[Value, ...], Point],
    budget: int,
    space: Space,
    region: RegionOfInterest,
    design: Design,
    most: int,
) -> None:
    """Add points of the design to ``chosen`` until it has ``budget`` of them, or ``most`` candidates were tried."""
    if len(chosen) >= budget:
        return
    contains = region.membership(space)
    tried = 0
    for batch in _batches(space, region, design):
        tried += len(batch)
        for unit_point in batch[:most]:
            point = space.values(unit_point)
            if contains(point):
                chosen.setdefault(_address(space, point), point)
                if len(chosen) >= budget:
                    return
        if tried > most:
            return


def _batches(space: Space, region: RegionOfInterest, design: Design) -> Iterator[NDArray[np.float64]]:
    """Batches of unit points in the region, coarse ones first, until it seems to hold no more."""
    unit_region = region.in_unit_cube(space)
    if design.kind == "lattice":
        yield from _lattice_batches(unit_region, design.placed(space), _fine_enough(design))
        return
    drawn = sobol_batches if design.kind == "sobol" else latin_batches
    for batch in drawn(unit_region, design.budget, design.seed):
        yield region.onto_choices(space, batch)  # else only a part of them would count, unevenly


def _fine_enough(design: Design) -> int:
    return 8 * design.budget + 64


def _lattice_batches(region: Region, design: Design, most: int) -> Iterator[NDArray[np.float64]]:
    assert design.frame is not None
    points = progressive_points(design.frame, region, shifts=design.shifts)
    if FEW * len(points) < design.budget:  # the order is that of refining level by level, which would take long
        level = _first_level(design.frame, region, design.budget)
        points = progressive_points(design.frame, region, level=level, shifts=design.shifts)
    done = 0
    while True:
        yield points.points[done:]
        done = len(points)
        if done > most * 64:
            return  # whole numbers and choices are exhausted long before that
        points = points.refine()


def _first_level(frame: Frame, region: Region, budget: int) -> int:
    """The level of a lattice at which a small region has about ``budget`` points."""
    try:
        return level_for(frame, region, budget)
    except InvalidInputError as error:
        raise InvalidInputError(
            f"the region is so small a part of the ranges that the lattice over them has fewer than {budget} points in "
            "it at its finest level. Widen the region, or choose the design Sobol (kind = 'sobol')"
        ) from error


def _combinations(space: Space, region: RegionOfInterest) -> int | None:
    """Number of different points in a region's ranges; None if a parameter is real."""
    counts = []
    for parameter in space.parameters:
        if parameter.kind == "real":
            return None
        low, high = (0, len(parameter.choices) - 1) if parameter.kind == "choice" else region.ends(parameter)
        counts.append(int(high) - int(low) + 1)
    return math.prod(counts)


def _all_points(space: Space, region: RegionOfInterest) -> Iterator[Point]:
    """Every combination of whole numbers and choices in a region's ranges."""
    axes: list[Sequence[Value]] = []
    for parameter in space.parameters:
        low, high = region.ends(parameter)
        axes.append(parameter.choices if parameter.kind == "choice" else range(int(low), int(high) + 1))
    for values in product(*axes):
        yield dict(zip(space.names, values, strict=True))


def _address(space: Space, point: Mapping[str, Value]) -> tuple[Value, ...]:
    return tuple(point[name] for name in space.names)


def _check_listed(space: Space, point: Mapping[str, Value]) -> None:
    strange = sorted(set(point) - set(space.names))
    if strange:
        raise InvalidInputError(f"a listed point has {strange[0]!r}; the parameters are {', '.join(space.names)}")
    space.coordinates(point)
    for parameter in space.parameters:
        if parameter.kind == "choice" and point[parameter.name] not in parameter.choices:
            raise InvalidInputError(f"a listed point has {parameter.name} = {point[parameter.name]!r}, no choice of it")
