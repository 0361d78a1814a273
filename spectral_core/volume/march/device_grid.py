# SPDX-License-Identifier: GPL-3.0-or-later
"""A step grid on the device, and rays through it: what a turn of the march reads to know how far it may go."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from spectral_core.volume.march.arithmetic import bounded, smaller
from spectral_core.volume.march.device import is_scalar, opaque
from spectral_core.volume.march.rules import EMPTY, StepGrid

_PARALLEL = 1e-4  # of a unit direction: a ray as flat as this meets no face along that axis
_NEVER = 1e9
BEYOND = 1e-3  # voxels that a ray looks ahead, so that it stands in one brick and not between two


class DeviceGrid:
    """A step grid; ``low`` and ``high`` bound in index space what it shows."""

    def __init__(self, types: Any, grid: StepGrid, shape: tuple[int, int, int]) -> None:
        self.types, self.grid = types, grid
        counts = grid.words.shape[::-1]
        self.low, self.high = (opaque(types.Float, bound) for bound in grid.bounds(shape))
        self.edge = opaque(types.Float, [float(grid.edge)])[0]
        self.inverse_edge = opaque(types.Float, [1.0 / grid.edge])[0]
        self.shift = opaque(types.Float, [0.5 if grid.centred else 0.0])[0]
        self.last = opaque(types.Float, [n - 1 for n in counts])
        self.strides = opaque(types.UInt32, (counts[0], counts[0] * counts[1]))
        self.longest = opaque(types.Float, [min(grid.longest, 1e30)])[0]
        self.first = opaque(types.Float, [grid.first])[0]
        flat = np.ascontiguousarray(grid.words).ravel()
        self.words: Any = flat if is_scalar(types) else types.UInt32(flat)

    def relative_step(self, word: Any) -> Any:
        """Step in voxels at scale 1; not above zero where the word is a leap.

        What is packed into the lower half makes it up to 1/128 longer.
        """
        import drjit as dr

        if is_scalar(self.types):
            return float(np.uint32(word).view(np.float32)) if word < EMPTY else -1.0
        return dr.reinterpret_array(self.types.Float, word)

    def voxels_per_cell(self, word: Any) -> Any:
        """How far at least a ray goes in this brick while the data value moves by one cell of the transfer table."""
        import drjit as dr

        if is_scalar(self.types):
            return float(np.uint32((int(word) & 0xFFFF) << 16).view(np.float32))
        return dr.reinterpret_array(self.types.Float, word << 16)


@dataclass(frozen=True)
class BrickPlace:
    """Where a ray stands: the brick's ``word``, and brick and point in brick coordinates (three each)."""

    word: Any
    brick: list[Any]
    point: list[Any]


class BrickLine:
    """A ray through a grid, with all that stays the same along it made ready.

    ``origin``, unit ``direction`` and its ``inverse`` (large where it is zero) are lists of three in index space.
    """

    def __init__(self, grid: DeviceGrid, origin: list[Any], direction: list[Any], inverse: list[Any]) -> None:
        import drjit as dr

        types, self.grid = grid.types, grid
        self.origin = [(o + grid.shift) * grid.inverse_edge for o in origin]
        self.direction = [d * grid.inverse_edge for d in direction]
        self.reach, self.side, self.base = [], [], []
        self.octant = types.UInt32(0)
        for a, d in enumerate(direction):
            flat = dr.abs(d) < _PARALLEL
            up = flat | (d > 0)
            self.reach.append(dr.select(flat, 1e30, grid.edge * inverse[a]))
            self.side.append(dr.select(up, types.Float(1.0), types.Float(-1.0)))
            self.base.append(dr.select(flat, 1e6, dr.select(up, types.Float(0.0), types.Float(1.0))))
            self.octant = self.octant + dr.select(d < 0, types.UInt32(3 << a), types.UInt32(0))

    def look(self, distance: Any, active: Any = True) -> BrickPlace:
        """The brick ``distance`` index units along, and a little further."""
        import drjit as dr

        types, grid = self.grid.types, self.grid
        ahead = distance + BEYOND
        point = [dr.fma(self.direction[a], ahead, self.origin[a]) for a in range(3)]
        brick = [bounded(dr.floor(point[a]), 0.0, grid.last[a]) for a in range(3)]
        b = [types.UInt32(c) for c in brick]
        index = b[0] + b[1] * grid.strides[0] + b[2] * grid.strides[1]
        if is_scalar(types):
            return BrickPlace(int(grid.words[int(index)]), brick, point)
        return BrickPlace(dr.gather(types.UInt32, grid.words, index, active), brick, point)

    def leap(self, place: BrickPlace) -> Any:
        """Length from ``look``'s distance to just past the empty cube of bricks ahead; past this brick if it shows
        something. Never less than 0.002.
        """
        import drjit as dr

        types = self.grid.types
        level = types.Float(dr.select(place.word < int(EMPTY), types.UInt32(0), (place.word >> self.octant) & 7))
        distance = dr.fma(level * 0.5, level + 1.0, 1.0)
        length = types.Float(_NEVER)
        for a in range(3):
            face = dr.fma(self.side[a], distance, place.brick[a] + self.base[a])
            along = (face - place.point[a]) * self.reach[a]
            # Negative: in the outer half voxel and on the way out.
            length = smaller(dr.select(along >= 0, along, _NEVER), length)
        return length + 2.0 * BEYOND
