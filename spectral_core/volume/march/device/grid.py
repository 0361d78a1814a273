# SPDX-License-Identifier: GPL-3.0-or-later
"""A step grid on the device, and rays through it, from which each iteration of the march reads its skip and step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from spectral_core.volume.march.arithmetic import bounded, smaller
from spectral_core.volume.march.brick_word import BrickWord
from spectral_core.volume.march.device.voxels import opaque, opaque_vector
from spectral_core.volume.march.rules import StepGrid

_PARALLEL = 1e-4  # component of a unit direction below which the ray counts as parallel to that axis' faces
_NEVER = 1e9
BEYOND = 1e-3  # voxels by which a lookup is ahead of the ray, so that it never lies on a face between two bricks


class DeviceGrid:
    """A step grid; ``low`` and ``high`` bound its visible part in index space."""

    def __init__(self, types: Any, grid: StepGrid, shape: tuple[int, int, int]) -> None:
        self.types, self.grid = types, grid
        counts = grid.words.shape[::-1]
        self.low, self.high = (opaque_vector(types, bound) for bound in grid.bounds(shape))
        self.edge, self.inverse_edge, self.shift, self.longest, self.first = opaque(
            types.Float,
            [float(grid.edge), 1.0 / grid.edge, 0.5 * grid.centered, min(grid.longest, 1e30), grid.first],
        )
        self.last = opaque_vector(types, [n - 1 for n in counts])
        self.strides = opaque(types.UInt32, (counts[0], counts[0] * counts[1]))
        self.words = types.UInt32(np.ascontiguousarray(grid.words).ravel())


@dataclass(frozen=True)
class BrickLookup:
    """The brick of a ray's position: its ``word``, and ``brick`` and ``point`` in brick coordinates (Array3f)."""

    word: BrickWord
    brick: Any
    point: Any


class BrickLine:
    """A ray through a grid, with all quantities that are constant along it.

    ``origin``, unit ``direction`` and its ``inverse`` (large where it is zero) are Array3f in index space.
    """

    def __init__(self, grid: DeviceGrid, origin: Any, direction: Any, inverse: Any) -> None:
        import drjit as dr

        types, self.grid = grid.types, grid
        self.origin = (origin + grid.shift) * grid.inverse_edge
        self.direction = direction * grid.inverse_edge
        flat = dr.abs(direction) < _PARALLEL
        up = flat | (direction > 0)
        self.reach = dr.select(flat, 1e30, grid.edge * inverse)
        self.side = dr.select(up, types.Array3f(1.0), types.Array3f(-1.0))
        # An axis that the ray never crosses gets a face that is out of reach.
        self.base = dr.select(flat, 1e6, dr.select(up, types.Array3f(0.0), types.Array3f(1.0)))
        # Octants are numbered 1, 2, 4 by axis and their levels are 3 bits wide: shifts of 3, 6 and 12 add up to the
        # octant's place.
        bits = dr.select(direction < 0, types.Array3u(3, 6, 12), types.Array3u(0))
        self.octant_shift = bits.x + bits.y + bits.z

    def lookup(self, distance: Any, active: Any = True) -> BrickLookup:
        """Read the brick at ``distance`` voxels along the ray, plus ``BEYOND``."""
        import drjit as dr

        types, grid = self.grid.types, self.grid
        point = dr.fma(self.direction, distance + BEYOND, self.origin)
        brick = bounded(dr.floor(point), 0.0, grid.last)
        b = types.Array3u(brick)
        index = b.x + b.y * grid.strides[0] + b.z * grid.strides[1]
        return BrickLookup(BrickWord(dr.gather(types.UInt32, grid.words, index, active), types), brick, point)

    def skip(self, found: BrickLookup) -> Any:
        """Voxels from ``lookup``'s distance to just past the empty cube of bricks ahead; past this brick if it is
        visible. Never less than 0.002.
        """
        import drjit as dr

        face = dr.fma(self.side, found.word.reach(self.octant_shift), found.brick + self.base)
        along = (face - found.point) * self.reach
        # Negative along an axis: the point is in the outer half voxel and the ray leaves the grid there.
        ahead = dr.select(along >= 0, along, _NEVER)
        return smaller(smaller(ahead.x, ahead.y), smaller(ahead.z, _NEVER)) + 2.0 * BEYOND
