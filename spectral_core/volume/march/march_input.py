# SPDX-License-Identifier: GPL-3.0-or-later
"""Input of a march: rays in index space, and a field with the tables of one rule and transfer function."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from spectral_core.errors import InvalidInputError
from spectral_core.volume.march.arithmetic import larger, smaller
from spectral_core.volume.march.device.grid import BrickLine, DeviceGrid
from spectral_core.volume.march.device.table import DeviceTable
from spectral_core.volume.march.device.voxels import DeviceVolume

Quadrature = Literal["midpoint", "preintegrated"]
QUADRATURES: tuple[Quadrature, ...] = ("midpoint", "preintegrated")


def quadratures_of(two_dimensional: bool) -> tuple[Quadrature, ...]:
    """The quadratures of a transfer function, the most accurate last; those in 2D have no running integrals."""
    return ("midpoint",) if two_dimensional else QUADRATURES


def no_integrals() -> InvalidInputError:
    """The error of a quadrature that is not one of ``quadratures_of``."""
    return InvalidInputError("a two-dimensional transfer function has no pre-integrated table; use midpoint")


@dataclass(frozen=True)
class Limits:
    """Limits at which a march trades exactness for time.

    A ray ends at ``least_transmittance``. A step through invisible values may be ``most_stretch`` times longer than is
    certain to miss nothing, and is then checked for missed values; at 1 nothing is missed, to a thousandth of a voxel.
    No step is shorter than ``shortest_step`` voxels, by default the thesis' "hundred times the frequency of the data
    grid". ``ends_at_faces``: steps end where the ray crosses from one cell between voxel centers into the next. The
    field has a kink there, so that the tip of an object that a ray grazes lies on such a face, between the ends of two
    steps however short they are. ``approaches``: where the rule knows the distance to the nearest visible value, a step
    from an invisible one is no longer than that, and at least twice ``shortest_step``. So a ray finds an object that it
    grazes for a few hundredths of a voxel inside a cell: where extinction is high, so short a way is opaque.
    Only pre-integrated marches of adaptive rules do so; midpoint and uniform steps ignore it. ``ends_at_turns``:
    pre-integrated steps also end where the field along the ray turns from rising to falling inside a cell, and shrink
    toward such places: the tip of an object that a ray grazes is at one of them.
    """

    least_transmittance: float = 1e-5
    most_stretch: float = 2.0
    shortest_step: float = 0.01
    ends_at_faces: bool = False
    approaches: bool = False
    ends_at_turns: bool = False


USUAL = Limits()
REFERENCE = Limits(1e-7, 1.0, 1.0 / 512.0, ends_at_faces=True, approaches=True, ends_at_turns=True)
AT_FACE = 1e-4  # voxels before a face within which a position counts as on it


@dataclass(frozen=True)
class Rays:
    """Rays in a field's index space: from ``origin`` along the unit ``direction`` (Array3f) for ``length`` voxels.

    ``world`` is the world length of one voxel along the ray; ``line`` is the ray among the bricks of its grid.
    """

    origin: Any
    direction: Any
    length: Any
    world: Any
    line: BrickLine

    def at(self, distance: Any) -> Any:
        """Index-space point ``distance`` voxels along."""
        import drjit as dr

        return dr.fma(self.direction, distance, self.origin)

    def until_face(self, distance: Any) -> Any:
        """Voxels from ``distance`` to the next face between two cells; at least ``AT_FACE``."""
        import drjit as dr

        ahead = dr.abs(self.direction)
        along = dr.select(self.direction < 0, -self.at(distance), self.at(distance))
        left = (dr.floor(along + AT_FACE) + 1.0 - along) / larger(ahead, 1e-9)
        return larger(smaller(smaller(left.x, left.y), left.z), AT_FACE)


def on_face(point: Any) -> Any:
    """A point of index space, moved onto each face that it counts as on.

    Rounding leaves the end of a step beside its face by some millionths of a voxel. A peak at the very value of the
    voxels there may be narrower than the difference of the field over that distance, and would be missed on both sides.
    """
    import drjit as dr

    nearest = dr.round(point)
    return dr.select(dr.abs(point - nearest) < AT_FACE, nearest, point)


@dataclass(frozen=True)
class MarchInput:
    """A field on the device with the tables of one rule and transfer function; ``scale`` multiplies its steps."""

    volume: DeviceVolume
    grid: DeviceGrid
    table: DeviceTable
    scale: Any
    quadrature: Quadrature = "midpoint"
    least_transmittance: Any = USUAL.least_transmittance
    most_stretch: Any = USUAL.most_stretch
    shortest_step: Any = USUAL.shortest_step
    ends_at_faces: bool = False
    approaches: bool = False
    ends_at_turns: bool = False
    gradient: DeviceVolume | None = None
    """Gradient magnitudes and, in ``weights``, the materials' weights over them, for a two-dimensional function."""
    weights: DeviceTable | None = None

    @property
    def materials(self) -> int:
        """Number of materials."""
        return self.table.table.materials

    @property
    def adapts(self) -> bool:
        """True if steps grow as transmittance falls, and skip invisible values."""
        return self.grid.grid.adapts

    def optics(self, columns: list[Any], point: Any) -> tuple[list[Any], Any]:
        """(source per material, extinction) from table columns; a two-dimensional function weights by gradient."""
        import drjit as dr

        k = self.materials
        if self.gradient is None or self.weights is None:
            return columns[:k], columns[k] if len(columns) > k else sum(columns[1:], columns[0])
        # A second lookup, by the gradient's magnitude, only for two-dimensional functions.
        segment = self.weights.find(self.gradient.value(point))
        weights = self.weights.column_values(segment, segment.part)
        extinction = [columns[c] * weights[c] for c in range(k)]
        source = [dr.fma(columns[c + k], weights[c], extinction[c]) for c in range(k)]
        return source, sum(extinction[1:], extinction[0])


def clip_to_box(grid: DeviceGrid, point: Any, along: Any, world: Any, begin: Any) -> Rays:
    """The part of rays in the visible box of ``grid``: from the later of ``begin`` (voxels along) and the entry.

    ``point`` and ``along`` (unit) are Array3f in index space; ``world`` as in Rays.
    """
    import drjit as dr

    # A ray parallel to a face would divide by 0; at this slope it stays within a voxel over any field.
    inverse = 1.0 / dr.select(dr.abs(along) < 1e-9, dr.select(along < 0, -1e-9, 1e-9), along)
    low, high = (grid.low - point) * inverse, (grid.high - point) * inverse
    enter, leave = smaller(low, high), larger(low, high)
    near = larger(larger(begin, enter.x), larger(enter.y, enter.z))
    far = smaller(smaller(leave.x, leave.y), leave.z)
    length = larger(far - near, 0.0)
    # A ray that misses the box has its entry far away; its start must stay finite for the lookups that follow.
    near = dr.select(length > 0, near, 0.0)
    start = dr.fma(along, near, point)
    return Rays(start, along, length, world, BrickLine(grid, start, along, inverse))
