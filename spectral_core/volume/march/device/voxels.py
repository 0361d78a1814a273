# SPDX-License-Identifier: GPL-3.0-or-later
"""A field's voxels for the march: Dr.Jit arrays of one back end.

``types`` is a Dr.Jit array module: ``drjit.llvm`` or ``drjit.cuda``, or their ``.ad`` forms (Mitsuba's variants). All
sizes are opaque variables, so that one compiled march serves every field.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.march.arithmetic import bounded

_PACKED_LIMIT = 1 << 28  # voxels; four bytes each
_MOST_VOXELS = (1 << 32) - 1  # Dr.Jit numbers the entries of an array in 32 bits
_ROUNDING = 2.0**-24  # largest relative error of a number that is rounded to single precision
_LEAST = 2.0**-126  # the least number that has this precision
_GREATEST = 1e300  # the difference of larger values may be no double


class DeviceVolume:
    """The field's voxels, with ``value(p)``: trilinear data value at an index-space point, in stored units.

    Stored are uint8 data unchanged (four neighbors packed in one word up to 2^28 voxels, which halves the time of a
    fetch; else one byte each) and all others as float32 of (f - ``base``) / ``unit``. The base is 0, where float32 is
    finest, unless all data are far from it on one side; the unit is a power of two, so it causes no rounding.

    Raises InvalidInputError for a field of 2^32 voxels or more, and for values above 1e300 in size.
    """

    def __init__(self, types: Any, volume: ScalarVolume) -> None:
        self.types, self.volume = types, volume
        if volume.data.size > _MOST_VOXELS:
            shape = "×".join(map(str, volume.shape))
            raise InvalidInputError(
                f"volume {volume.name!r} has {shape} = {volume.data.size:,} voxels; fewer than 2^32 = "
                f"{_MOST_VOXELS + 1:,} can be rendered. Crop it, or take every second voxel along each axis"
            )
        low, high = volume.value_range
        if max(-low, high) > _GREATEST:
            raise InvalidInputError(
                f"volume {volume.name!r} has values from {low:g} to {high:g}; values to {_GREATEST:g} in size can be "
                "rendered. Divide the data by a constant, or replace the value that marks missing data"
            )
        data = volume.data.transpose(2, 1, 0)  # x fastest
        self.is_byte = data.dtype == np.uint8
        self.base, self.unit = (0.0, 1.0) if self.is_byte else _stored_units(*volume.value_range)
        self.packed = self.is_byte and data.size <= _PACKED_LIMIT
        self.sizes = opaque(types.UInt32, volume.shape)
        self.last = opaque_vector(types, [n - 1 for n in volume.shape])
        self.edge = types.Array3u(*opaque(types.UInt32, [n - 1 for n in volume.shape]))
        self.hops = opaque(types.UInt32, [1, volume.shape[0], volume.shape[0] * volume.shape[1]])
        self.rounding = 0.0
        """Largest difference of a stored value from its voxel, in data units."""
        self.store = self._upload(data)

    def _upload(self, data: NDArray[Any]) -> Any:
        types = self.types
        if self.packed:
            return types.UInt32(_packed(data).ravel())
        if self.is_byte:
            return types.UInt8(data.ravel())
        if data.dtype == np.float32 and self.base == 0.0 and self.unit == 1.0:
            return types.Float(data.ravel())
        stored = np.empty(data.shape, np.float32)
        for plane, into in zip(data, stored, strict=True):
            exact = (plane.astype(np.float64) - self.base) / self.unit
            into[:] = exact
            self.rounding = max(self.rounding, self.unit * float(np.abs(into - exact).max()))
        return types.Float(stored.ravel())

    def rounding_at(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Largest rounding error, in data units, of places of the field that have the data ``values`` (n,).

        Voxels are rounded in proportion to their distance from ``base``, and so is a mean of voxels on one side of it.
        A mean of voxels on both sides may be smaller than all of them; then the nearer end of the data counts.
        """
        ends = [end - self.base for end in self.volume.value_range]
        across = max(min(-ends[0], ends[1]), 0.0)
        return np.minimum(self.rounding, _ROUNDING * (np.abs(values - self.base) + 2 * across) + _LEAST * self.unit)

    def value(self, p: Any, active: Any = True) -> Any:
        """Trilinear value at ``p`` (Array3f, index coordinates), in stored units."""
        edges, (x, y, z) = self.cell(p, active)
        c00, c10, c01, c11 = (_mix(a, b, x) for a, b in edges)
        return _mix(_mix(c00, c10, y), _mix(c01, c11, y), z)

    def cell(self, p: Any, active: Any = True) -> tuple[list[tuple[Any, Any]], Any]:
        """The cell of ``p``, and the share of ``p`` in it along each axis.

        The cell is given by the stored values at the ends of its four edges along x: at the low y and z, at the high y,
        at the high z, and at both high.
        """
        import drjit as dr

        types = self.types
        clamped = bounded(p, 0.0, self.last)
        cell = types.Array3u(clamped)
        first = dr.fma(dr.fma(cell.z, self.sizes[1], cell.y), self.sizes[0], cell.x)
        # A neighbor beyond the last voxel is that voxel itself. As the end of the cell before it, with a weight of 1,
        # it would have the rounding error of its neighbor, which may be many decades larger, in half a voxel.
        hx, hy, hz = (
            dr.select(place < edge, types.UInt32(hop), types.UInt32(0))
            for place, edge, hop in zip(cell, self.edge, self.hops, strict=True)
        )
        if self.packed:
            # Two gathers instead of eight: each word holds its voxel's neighbors across y and z.
            here = dr.gather(types.UInt32, self.store, first, active)
            beside = dr.gather(types.UInt32, self.store, first + hx, active)
            edges = [(types.Float((here >> s) & 255), types.Float((beside >> s) & 255)) for s in (0, 8, 16, 24)]
        else:
            stored = types.UInt8 if self.is_byte else types.Float

            def pair(offset: Any) -> tuple[Any, Any]:
                a = dr.gather(stored, self.store, first + offset, active)
                b = dr.gather(stored, self.store, first + offset + hx, active)
                return types.Float(a), types.Float(b)

            edges = [pair(types.UInt32(0)), pair(hy), pair(hz), pair(hy + hz)]
        return edges, clamped - types.Array3f(cell)


def _stored_units(low: float, high: float) -> tuple[float, float]:
    """(base, unit) so that (f - base) / unit is at most 1 and loses as little as possible in float32."""
    # Data whose range is smaller than their distance from 0 would lose their differences in float32, so they are stored
    # relative to the least value.
    is_far = low * high > 0 and min(abs(low), abs(high)) > high - low
    base = low if is_far else 0.0
    greatest = max(abs(low - base), abs(high - base))
    return base, 2.0 ** math.ceil(math.log2(greatest)) if greatest > 0 else 1.0


def aligned(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """The same on a 64-byte boundary: elsewhere Dr.Jit silently uses one gather per number of a packet."""
    room = np.empty(values.nbytes + 64, np.uint8)
    start = -room.ctypes.data % 64
    there: NDArray[np.float32] = room[start : start + values.nbytes].view(np.float32)
    there[:] = values
    return there


def _packed(data: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """Per voxel its value, that of its +y, its +z and its +y+z neighbor, in one word; at a face the face again."""
    packed = data.astype(np.uint32)
    y = np.minimum(np.arange(data.shape[1]) + 1, data.shape[1] - 1)
    z = np.minimum(np.arange(data.shape[0]) + 1, data.shape[0] - 1)
    packed |= data[:, y].astype(np.uint32) << np.uint32(8)
    packed |= data[z].astype(np.uint32) << np.uint32(16)
    packed |= data[z][:, y].astype(np.uint32) << np.uint32(24)
    return packed


def _mix(a: Any, b: Any, t: Any) -> Any:
    import drjit as dr

    return dr.fma(b - a, t, a)


def opaque(kind: Any, values: Any) -> list[Any]:
    """Constants that a kernel reads from memory, so that other values need no new kernel."""
    import drjit as dr

    return [dr.opaque(kind, v.item() if hasattr(v, "item") else v) for v in values]


def opaque_doubles(types: Any, values: Any) -> Any:
    """Three opaque numbers as an Array3f64."""
    return types.Array3f64(*opaque(types.Float64, [float(v) for v in values]))


def opaque_vector(types: Any, values: Any) -> Any:
    """Three opaque numbers as an Array3f."""
    return types.Array3f(*opaque(types.Float, [float(v) for v in values]))
