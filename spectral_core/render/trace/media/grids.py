# SPDX-License-Identifier: GPL-3.0-or-later
"""Media that vary on a grid: their factors at a point, and bounds of their coefficients in blocks of voxels.

A block's bound holds for its voxels and their neighbors, so linear interpolation within the block does not exceed it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.plugins.numbers import table

Array = NDArray[Any]

BLOCKS = 16
"""Most blocks along an axis."""
NOTHING, FACTOR, OWN, COLOR = 0, 1, 2, 3
"""Entries of a slot in a voxel: none (it does not vary), a factor, one for each of its own spectra, linear RGB."""
_SLOTS = 3
_BLOCKS_AT, _EDGE_AT, _SLOTS_AT = 6, 7, 8
_OF_SLOT = 3
_HEADER = _SLOTS_AT + _OF_SLOT * _SLOTS
"""Entries of a medium: voxels, blocks, the first bound, voxels along a block; kind, first number and number of the set
of own spectra of each slot.
"""


@dataclass(frozen=True, slots=True, eq=False)
class GridRow:
    """A medium's grid: ``slots``, its scattering, absorption and emission as (nx, ny, nz), (nx, ny, nz, n) or None.

    ``index_from_world``: (4, 4), to voxel centers at whole numbers. ``bounds``: (nx, ny, nz), at least the
    extinction of any wavelength at each voxel. ``tints``: textures of red, green and blue; None if no slot is a color.
    ``own``: textures of the n entries of each slot in place of these, None without any.
    """

    slots: tuple[Array | None, Array | None, Array | None]
    index_from_world: NDArray[np.float64]
    bounds: Array
    tints: tuple[Any, Any, Any] | None
    own: tuple[tuple[Any, ...], ...] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Tints:
    """Values at wavelengths of red, green and blue, and of the sets of own spectra of each slot."""

    rgb: tuple[Any, ...]
    own: tuple[list[tuple[Any, ...]], ...]


@dataclass(slots=True, eq=False)
class Way:
    """A ray in the blocks of its medium's grid: per unit of length it moves by ``direction``. ``first`` and ``last``:
    distances at which it enters and leaves the grid; ``medium``: its number; ``tints``: ``Tints``, None if no grid has
    colors.
    """

    medium: Any
    origin: Any
    direction: Any
    first: Any
    last: Any
    tints: Any = None


class MediumGrids:
    """The grids of all media in one table; ``rows``: by the medium's number from 1, None for a homogeneous one."""

    def __init__(self, mitsuba: Any, rows: list[GridRow | None]) -> None:
        self._mi = mitsuba
        # row 0 is empty space and entry 0 a number that nothing means: lookups of inactive lanes need no case
        headers, matrices = [[0] * _HEADER], [np.zeros(12)]
        values: list[Array] = [np.zeros(1, np.float32)]
        self._end = 1
        self._colors = tuple(any(_kind(row, slot) == COLOR for row in rows) for slot in range(_SLOTS))
        self._used = tuple(any(_kind(row, slot) != NOTHING for row in rows) for slot in range(_SLOTS))
        rgb = next((row.tints for row in rows if row is not None and row.tints is not None), ())
        self._textures = Tints(rgb, ([], [], []))
        for row in rows:
            header, matrix = ([0] * _HEADER, np.zeros(12)) if row is None else self._entered(row, values)
            headers.append(header)
            matrices.append(matrix)
        self._headers = table(mitsuba.UInt32, np.array(headers, np.uint32))
        self._matrices = table(mitsuba.Float, np.array(matrices, np.float32))
        self._values = table(mitsuba.Float, np.concatenate(values))

    def _entered(self, row: GridRow, values: list[Array]) -> tuple[list[int], Array]:
        """Header and matrix of a row; its numbers are appended."""
        shape = row.bounds.shape
        # cubes of voxels: small ones follow thin smoke, large ones are crossed in fewer steps
        edge = max(-(-max(shape) // BLOCKS), 1)
        starts: dict[int, int] = {}
        slots = []
        for slot, array in enumerate(row.slots):
            # density alone varies in most media: scattering and absorption then share one array
            if array is not None and id(array) not in starts:
                starts[id(array)] = self._append(array, values)
            sets = self._textures.own[slot]
            if row.own is not None:
                sets.append(row.own[slot])
            slots += [_kind(row, slot), 0 if array is None else starts[id(array)], len(sets)]
        blocks = blockwise_maxima(row.bounds, edge)
        header = [*shape, *blocks.shape, self._append(blocks, values), edge, *slots]
        return header, _block_matrix(row, edge).ravel()

    def _append(self, array: Array, values: list[Array]) -> int:
        start = self._end
        values.append(np.ascontiguousarray(array, np.float32).ravel())
        self._end += values[-1].size
        return start

    def tints(self, value: Callable[[Any], Any]) -> Tints | None:
        """The colors of all grids, by a function of their textures; None if no grid has colors."""
        textures = self._textures
        if not textures.rgb and not any(textures.own):
            return None
        of_set = lambda each: tuple(value(texture) for texture in each)  # noqa: E731
        return Tints(of_set(textures.rgb), tuple([of_set(each) for each in sets] for sets in textures.own))

    def has(self, medium: Any, active: Any) -> Any:
        """True if a medium varies."""
        return self._header(medium, 0, active) > 0

    def _header(self, medium: Any, entry: int, active: Any) -> Any:
        import drjit as dr

        return dr.gather(self._mi.UInt32, self._headers, medium * _HEADER + entry, active)

    def way(self, medium: Any, ray: Any, active: Any) -> Way:
        """The way of a ray through the grid of a medium."""
        import drjit as dr

        mi = self._mi
        entries = [dr.gather(mi.Float, self._matrices, medium * 12 + k, active) for k in range(12)]
        lines = [mi.Vector3f(*entries[4 * k : 4 * k + 3]) for k in range(3)]
        origin = mi.Point3f(*(dr.dot(line, mi.Vector3f(ray.o)) + entries[4 * k + 3] for k, line in enumerate(lines)))
        direction = mi.Vector3f(*(dr.dot(line, ray.d) for line in lines))
        first, last = mi.Float(0.0), mi.Float(dr.inf)
        rate = dr.rcp(dr.maximum(mi.Float(self._header(medium, _EDGE_AT, active)), 1.0))
        for axis in range(3):
            # the end of the voxels: the last block may reach beyond them, and the border of an object as well
            high = mi.Float(self._header(medium, axis, active)) * rate
            # a ray along a border of the grid has no crossing; a tiny slope keeps the division defined
            slope = dr.select(dr.abs(direction[axis]) > 1e-20, direction[axis], 1e-20)
            one, two = -origin[axis] / slope, (high - origin[axis]) / slope
            first, last = dr.maximum(first, dr.minimum(one, two)), dr.minimum(last, dr.maximum(one, two))
        return Way(medium, origin, direction, first, last)

    def block(self, way: Way, along: Any, active: Any) -> tuple[Any, Any]:
        """Bound of the extinction in the block at a distance along a way, and the length to the end of the block."""
        import drjit as dr

        mi = self._mi
        place = way.origin + way.direction * along
        cell = dr.floor(place)
        # the nearest of the three planes ahead ends the block
        length = mi.Float(dr.inf)
        for axis in range(3):
            slope = way.direction[axis]
            border = cell[axis] + dr.select(slope > 0.0, 1.0, 0.0)
            ahead = (border - place[axis]) / dr.select(slope != 0.0, slope, 1.0)
            length = dr.minimum(length, dr.select(slope != 0.0, ahead, dr.inf))
        # A little beyond the border, or rounding would return to the same block; bounds overlap by a voxel.
        fastest = dr.max(dr.abs(way.direction))
        length = dr.maximum(length, 0.0) + 1e-4 / dr.maximum(fastest, 1e-20)
        counts = [self._header(way.medium, 3 + axis, active) for axis in range(3)]
        index = [mi.UInt32(dr.clip(cell[k], 0.0, mi.Float(counts[k]) - 1.0)) for k in range(3)]
        at = self._header(way.medium, _BLOCKS_AT, active) + (index[0] * counts[1] + index[1]) * counts[2] + index[2]
        return dr.gather(mi.Float, self._values, at, active), length

    def factors(self, way: Way, along: Any, active: Any) -> tuple[Any, Any, Any]:
        """Factors on scattering, absorption and emission at a distance along a way, per wavelength."""
        import drjit as dr

        mi = self._mi
        shape = [self._header(way.medium, axis, active) for axis in range(3)]
        place = (way.origin + way.direction * along) * mi.Float(self._header(way.medium, _EDGE_AT, active)) - 0.5
        low, share = [], []
        for axis in range(3):
            # the outermost half voxel has the value of its center
            held = dr.clip(place[axis], 0.0, mi.Float(shape[axis]) - 1.0)
            # the last voxel is reached with a share of 1, so that its neighbor exists
            below = dr.minimum(dr.floor(held), dr.maximum(mi.Float(shape[axis]) - 2.0, 0.0))
            low.append(mi.UInt32(below))
            share.append(held - below)
        corners = list(_corners(dr, mi, shape, low, share))

        def read(start: Any, stride: int, channel: int, wanted: Any) -> Any:
            total = mi.Float(0.0)
            for index, weight in corners:
                total += weight * dr.gather(mi.Float, self._values, start + index * stride + channel, wanted)
            return total

        return tuple(self._slot(slot, way, read, active) for slot in range(_SLOTS))

    def _slot(self, slot: int, way: Way, read: Callable[..., Any], active: Any) -> Any:
        import drjit as dr

        mi = self._mi
        if not self._used[slot]:
            return mi.Spectrum(1.0)
        first = _SLOTS_AT + _OF_SLOT * slot
        kind, start, own = (self._header(way.medium, first + k, active) for k in range(_OF_SLOT))
        is_factor = active & (kind == FACTOR)
        found = dr.select(is_factor, mi.Spectrum(read(start, 1, 0, is_factor)), 1.0)
        if self._colors[slot]:
            is_color = active & (kind == COLOR)
            rgb = [read(start, 3, channel, is_color) for channel in range(3)]
            # the gray part stays flat over wavelengths, so that gray smoke is gray at any depth
            gray = dr.minimum(dr.minimum(rgb[0], rgb[1]), rgb[2])
            color = mi.Spectrum(gray)
            for value, tint in zip(rgb, way.tints.rgb, strict=True):
                color += (value - gray) * tint
            found = dr.select(is_color, color, found)
        for number, tints in enumerate(way.tints.own[slot] if way.tints is not None else (), 1):
            mine = active & (kind == OWN) & (own == number)
            color = mi.Spectrum(0.0)
            for channel, tint in enumerate(tints):
                color += read(start, len(tints), channel, mine) * tint
            found = dr.select(mine, color, found)
        return found


def _corners(dr: Any, mi: Any, shape: list[Any], low: list[Any], share: list[Any]) -> Any:
    """Index and weight of the eight voxels around a point."""
    for corner in range(8):
        steps = [(corner >> axis) & 1 for axis in range(3)]
        index = [dr.minimum(low[k] + steps[k], shape[k] - 1) for k in range(3)]
        weight = mi.Float(1.0)
        for k in range(3):
            weight *= share[k] if steps[k] else 1.0 - share[k]
        yield (index[0] * shape[1] + index[1]) * shape[2] + index[2], weight


def _kind(row: GridRow | None, slot: int) -> int:
    array = None if row is None else row.slots[slot]
    if row is None or array is None:
        return NOTHING
    return FACTOR if array.ndim == 3 else (COLOR if row.own is None else OWN)


def _block_matrix(row: GridRow, edge: int) -> Array:
    """(3, 4) from world space to blocks, the first of which begins at 0."""
    matrix = row.index_from_world[:3].copy()
    # voxel centers are at whole numbers, their borders half a voxel before
    matrix[:, 3] += 0.5
    return np.asarray(matrix / edge)


def blockwise_maxima(values: Array, edge: int) -> Array:
    """Largest value of each block of ``edge`` voxels along every axis, and of the voxels around it."""
    from scipy.ndimage import maximum_filter

    spread = maximum_filter(values, size=3, mode="nearest")
    counts = [-(-n // edge) for n in values.shape]
    padded = np.pad(spread, [(0, count * edge - n) for count, n in zip(counts, values.shape, strict=True)], mode="edge")
    shape = [part for count in counts for part in (count, edge)]
    return np.asarray(padded.reshape(shape).max(axis=(1, 3, 5)))
