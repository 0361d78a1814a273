# SPDX-License-Identifier: GPL-3.0-or-later
"""Points ordered so that every prefix fills the region evenly; refined, extended or cut without moving a point.

The digits of a point give its coset in each level (finest first); sorting by them lists the coarsest level first and
completes one level after the other, as the radical inverse does on the line. The coarser levels may start at any of
``rate`` cosets, and the fullest is taken each time. Level j of m points then holds at least m / rateʲ of them, so a
prefix never has less than ρ · rate^(-1/n) separation, ρ the packing radius of the lattice (up to the rounding of m).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import require_kind, require_whole
from spectral_core.errors import InvalidInputError, SolveError
from spectral_core.lattice.catalogue import sampling_lattice
from spectral_core.lattice.construction import Lattice
from spectral_core.lattice.fill.filling import fill_exactly, require_count, seeded
from spectral_core.lattice.fill.frame import MAX_LEVEL, CosetDigits, Frame, random_rotation
from spectral_core.lattice.fill.regions import Region
from spectral_core.lattice.measure.measures import worst_gap

Matrix = NDArray[np.float64]
Integers = NDArray[np.int64]
Scalar = TypeVar("Scalar", bound=np.generic)

ROTATIONS = 16
"""Rotations tried in a box of 2 to 4 dimensions, up to ``MAX_ROTATION_POINTS`` points."""
MAX_TURN_DIMENSIONS = 4
MAX_ROTATION_POINTS = 20_000
MAX_DIGITS = 200
"""Levels above the base that the order distinguishes; with rate 2 that is 2^200 points."""


@dataclass(frozen=True, eq=False)
class ProgressivePoints:
    """Points of a framed lattice in a region, coarse levels first; every prefix is usable on its own."""

    frame: Frame
    region: Region
    level: int
    """Refinements so far; level 0 is the requested fill."""
    points: Matrix
    """(m, n), read-only."""
    coefficients: Integers
    """Integer coordinates of the points at ``level``, (m, n), read-only."""
    shifts: tuple[int, ...]
    """Coset taken as the start at each coarser level, nearest level first."""

    def __len__(self) -> int:
        return len(self.points)

    def refine(self) -> ProgressivePoints:
        """The same points in the same order, then those of the next level (about rate - 1 times as many)."""
        if self.level == MAX_LEVEL:
            raise InvalidInputError(f"the points are at level {MAX_LEVEL}, the finest; take a smaller region to go on")
        positions, coefficients = self.frame.points_in(self.region, self.level + 1)
        digits = CosetDigits.of(self.frame.lattice)
        # Digit 0 is the coarser lattice, whose points are already in the list.
        fresh = digits.digits(coefficients) != 0
        positions, coefficients = positions[fresh], coefficients[fresh]
        order = progressive_order(self.frame.lattice, coefficients, self.level + 1, self.shifts)
        # A coarse point has coordinates K k on the next level; its position and bits stay.
        old = self.coefficients @ self.frame.lattice.dilation.T
        return ProgressivePoints(
            self.frame,
            self.region,
            self.level + 1,
            _frozen(np.concatenate([self.points, positions[order]])),
            _frozen(np.concatenate([old, coefficients[order]])),
            self.shifts,
        )

    def within(self, region: Region) -> ProgressivePoints:
        """The points of the same frame and level in another region, larger, smaller or elsewhere.

        Points that lie in both regions have the same bits; ``shared`` pairs them.
        """
        return progressive_points(self.frame, region, level=self.level, shifts=self.shifts)

    def shared(self, other: ProgressivePoints) -> tuple[Integers, Integers]:
        """Indices in this and in the other set of the points in both, (K,) each; both sets must have the same frame."""
        require_kind("the other set", other, ProgressivePoints, "progressive_fill, or refine and within of one")
        if not other.frame.same_as(self.frame):
            raise InvalidInputError(
                "the two sets of points come from different frames, so no point is shared by design"
            )
        mine, theirs = (self._addresses(), other._addresses())
        # Compare integer coordinates, not positions: equal integers mean equal points.
        index = {address: i for i, address in enumerate(theirs)}
        pairs = [(i, index[address]) for i, address in enumerate(mine) if address in index]
        array = np.array(pairs, dtype=np.int64).reshape(-1, 2)
        return array[:, 0], array[:, 1]

    def _addresses(self) -> list[bytes]:
        coefficients, levels = self.frame.addresses(self.coefficients, self.level)
        return [row.tobytes() for row in np.column_stack([levels, coefficients])]


def progressive_fill(
    region: Region,
    count: int,
    *,
    rate: int = 2,
    lattice: Lattice | None = None,
    seed: int = 0,
    rotation: ArrayLike | None = None,
) -> ProgressivePoints:
    """Exactly ``count`` points in a region, in progressive order.

    ``lattice``: by default that of the largest packing radius for the region's dimension and ``rate``, because this
    radius bounds the separation of prefixes. ``seed`` draws rotation and offset; in a box of 2 to 4 dimensions the
    best of ``ROTATIONS`` rotations is taken, that with the least gaps on the axes. Errors as for ``fill_exactly``.
    """
    if not isinstance(region, Region):
        raise InvalidInputError(
            f"the region is of type {type(region).__name__}; expected a Region, such as lattice.box([0, 0], [1, 1])"
        )
    require_count(count)
    chosen = sampling_lattice(region.dimensions, rate) if lattice is None else lattice
    require_kind("the lattice", chosen, Lattice, "make_lattice")
    if rotation is None and region.box_limits is not None and 1 < len(chosen.generator) <= MAX_TURN_DIMENSIONS:
        frame, coefficients = _filled_at_best_turn(chosen, region, count, seed)
    else:
        frame, coefficients = fill_exactly(chosen, region, count, seed=seed, rotation=rotation)
    shifts = fullest_cosets(chosen, coefficients)
    order = progressive_order(chosen, coefficients, 0, shifts)
    coefficients = coefficients[order]
    return ProgressivePoints(frame, region, 0, _frozen(frame.positions(coefficients)), _frozen(coefficients), shifts)


def _filled_at_best_turn(lattice: Lattice, box: Region, count: int, seed: int) -> tuple[Frame, Integers]:
    """Exact fill of a box at the rotation, of those tried, whose points leave the least gap on any axis.

    In few dimensions a rotation may bring planes of the lattice close to an axis; from 5 on they hardly differ.
    """
    assert box.box_limits is not None
    low, high = box.box_limits
    rng = seeded(seed)
    best: tuple[float, Frame, Integers] | None = None
    for _ in range(ROTATIONS if 2 <= count <= MAX_ROTATION_POINTS else 0):
        try:
            rotation = random_rotation(lattice.dimensions, rng)
            frame, coefficients = fill_exactly(lattice, box, count, seed=seed, rotation=rotation)
        except SolveError:  # the lattice is aligned with a face, so the rotation is not a good one either
            continue
        gap = worst_gap((frame.positions(coefficients) - low) / (high - low))
        if best is None or gap < best[0]:
            best = gap, frame, coefficients
    return fill_exactly(lattice, box, count, seed=seed) if best is None else best[1:]


def progressive_points(
    frame: Frame, region: Region, *, level: int = 0, shifts: tuple[int, ...] = ()
) -> ProgressivePoints:
    """All points of a frame's level in a region, in progressive order: for continuing a stored sweep.

    ``frame``, ``level`` and ``shifts`` are those of the ``ProgressivePoints`` to continue.
    """
    require_kind("the frame", frame, Frame, "of the ProgressivePoints to continue")
    shifts = _checked_shifts(shifts, frame.lattice.rate)
    positions, coefficients = frame.points_in(region, level)
    order = progressive_order(frame.lattice, coefficients, level, shifts)
    return ProgressivePoints(frame, region, level, _frozen(positions[order]), _frozen(coefficients[order]), shifts)


def _checked_shifts(shifts: tuple[int, ...], rate: int) -> tuple[int, ...]:
    """Stored shifts as integers. Raises InvalidInputError for others, which would change the order of the points."""
    if not isinstance(shifts, tuple | list):
        raise InvalidInputError(f"shifts is {shifts!r}; expected those of the ProgressivePoints to continue, or ()")
    return tuple(require_whole(f"shifts[{place}]", shift, 0, rate - 1) for place, shift in enumerate(shifts))


def fullest_cosets(lattice: Lattice, coefficients: Integers) -> tuple[int, ...]:
    """One level after the other, the coset that holds most of the points left (at least 1 / rate of them)."""
    digits = CosetDigits.of(lattice)
    left = coefficients
    shifts: list[int] = []
    while len(left) > 1 and len(shifts) < MAX_DIGITS:
        # The fullest of rate cosets holds at least 1 / rate of the points, so the next level is never empty.
        cosets = digits.digits(left)
        fullest = int(np.bincount(cosets, minlength=lattice.rate).argmax())
        left = digits.divide(left[cosets == fullest], fullest)
        shifts.append(fullest)
    return tuple(shifts)


def progressive_order(lattice: Lattice, coefficients: Integers, level: int, shifts: tuple[int, ...]) -> Integers:
    """Order of points of a level, (N,): by digits, the finest level's first; ``shifts`` rename the coarser cosets.

    Exact integers; stops when all points differ.
    """
    digits = CosetDigits.of(lattice)
    left = coefficients
    columns: list[Integers] = []
    packed: list[Integers] = []
    per_word = int(62 / np.log2(lattice.rate))
    groups = np.zeros(len(coefficients), dtype=np.int64)
    for place in range(MAX_DIGITS):
        if len(columns) == per_word or place == MAX_DIGITS - 1:
            packed.append(_packed(columns, lattice.rate))
            columns = []
        coarser = place - level
        # Levels finer than the fill keep their own digits; below it the fullest coset is renamed 0.
        shift = shifts[coarser] if 0 <= coarser < len(shifts) else 0
        cosets = digits.digits(left)
        named = (cosets - shift) % lattice.rate
        columns.append(named)
        # The coset that is named 0 must divide to K⁻¹ (k - shift·step); the others keep their distance from it.
        left = digits.divide(left - shift * digits.step, named)
        # Points with equal digits so far form a group; once each is alone, further digits cannot change the order.
        groups = np.unique(groups * lattice.rate + named, return_inverse=True)[1].reshape(-1)
        if len(groups) == 0 or groups.max() + 1 == len(groups):
            break
    packed.append(_packed(columns, lattice.rate))
    return np.lexsort(packed[::-1])


def _packed(columns: list[Integers], rate: int) -> Integers:
    """Digits of one word as an integer, most significant first."""
    # As many digits as 62 bits hold, so that sorting compares few integers.
    word = np.zeros(len(columns[0]) if columns else 0, dtype=np.int64)
    for column in columns:
        word = word * rate + column
    return word


def _frozen(array: NDArray[Scalar]) -> NDArray[Scalar]:
    array = np.ascontiguousarray(array)
    array.setflags(write=False)
    return array
