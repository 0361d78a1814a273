# SPDX-License-Identifier: GPL-3.0-or-later
"""What a march reads: rays in index space, and a field with the tables of one rule and transfer function."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from spectral_core.volume.march.arithmetic import larger, smaller
from spectral_core.volume.march.device import DeviceTable, DeviceVolume
from spectral_core.volume.march.device_grid import BrickLine, DeviceGrid

Quadrature = Literal["midpoint", "preintegrated"]
QUADRATURES: tuple[Quadrature, ...] = ("midpoint", "preintegrated")


@dataclass(frozen=True)
class Limits:
    """Where a march gives up exactness for time.

    A ray ends at ``least_transmittance``. Through values that show nothing it goes up to ``boldest`` times as far as
    is certain before looking whether it has missed anything; 1 misses nothing, to a thousandth of a voxel.
    """

    least_transmittance: float = 1e-5
    boldest: float = 2.0


USUAL = Limits()
REFERENCE = Limits(1e-7, 1.0)


@dataclass(frozen=True)
class Rays:
    """Rays in a field's index space: they start at ``origin``, run along the unit ``direction`` for ``length``.

    ``world`` is the world length of one index unit along the ray; ``line`` is the ray among the bricks of its grid.
    """

    origin: list[Any]
    direction: list[Any]
    length: Any
    world: Any
    line: BrickLine

    def at(self, distance: Any) -> list[Any]:
        import drjit as dr

        return [dr.fma(self.direction[a], distance, self.origin[a]) for a in range(3)]


@dataclass(frozen=True)
class MarchInput:
    """A field on the device with the tables of one rule and transfer function; ``scale`` multiplies its steps."""

    volume: DeviceVolume
    grid: DeviceGrid
    table: DeviceTable
    scale: Any
    quadrature: Quadrature = "midpoint"
    least_transmittance: Any = USUAL.least_transmittance
    boldest: Any = USUAL.boldest
    gradient: DeviceVolume | None = None
    """Gradient magnitudes and, in ``weights``, the materials' weights over them: a two-dimensional function."""
    weights: DeviceTable | None = None

    @property
    def materials(self) -> int:
        return self.table.table.materials

    def optics_at(self, point: list[Any], active: Any) -> tuple[list[Any], Any]:
        """(source per material, extinction) at an index-space point, both per world unit."""
        import drjit as dr

        part, record = self.table.record(self.table.position(self.volume.value(point, active)), active)
        columns = [dr.fma(part, record[c + self.table.columns], record[c]) for c in range(self.table.columns)]
        return self.optics(columns, point, active)

    def optics(self, columns: list[Any], point: list[Any], active: Any) -> tuple[list[Any], Any]:
        """(source per material, extinction) from table columns; the gradient at ``point`` weighs them if need be."""
        import drjit as dr

        k = self.materials
        if self.gradient is None or self.weights is None:
            return columns[:k], columns[k] if len(columns) > k else sum(columns[1:], columns[0])
        part, record = self.weights.record(self.weights.position(self.gradient.value(point, active)), active)
        weights = [dr.fma(part, record[c + k], record[c]) for c in range(k)]
        taken = [columns[c] * weights[c] for c in range(k)]
        return [dr.fma(columns[c + k], weights[c], taken[c]) for c in range(k)], sum(taken[1:], taken[0])


def clip_to_box(grid: DeviceGrid, point: list[Any], along: list[Any], world: Any, begin: Any) -> Rays:
    """The part of rays where ``grid`` shows anything: from the later of ``begin`` (index units along) and the entry.

    ``point`` and ``along`` (unit) are lists of three; ``world`` as in Rays.
    """
    import drjit as dr

    near, far = begin, grid.types.Float(1e30)
    inverse = [1.0 / dr.select(dr.abs(d) < 1e-9, dr.select(d < 0, -1e-9, 1e-9), d) for d in along]
    for a in range(3):
        low, high = (grid.low[a] - point[a]) * inverse[a], (grid.high[a] - point[a]) * inverse[a]
        near, far = larger(near, smaller(low, high)), smaller(far, larger(low, high))
    length = larger(far - near, 0.0)
    near = dr.select(length > 0, near, 0.0)
    start = [dr.fma(along[a], near, point[a]) for a in range(3)]
    return Rays(start, along, length, world, BrickLine(grid, start, along, inverse))
