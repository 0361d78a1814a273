# SPDX-License-Identifier: GPL-3.0-or-later
"""Field and transfer table where the march reads them: Dr.Jit arrays of one back end.

``types`` is a Dr.Jit array module: ``drjit.llvm`` or ``drjit.cuda``, their ``.ad`` forms (Mitsuba's variants), or
``drjit.scalar``. All sizes are opaque variables, so a march is compiled once and serves every field.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.march.arithmetic import bounded, larger
from spectral_core.volume.march.tables import TransferTable

_PACKED_LIMIT = 1 << 28  # voxels; four bytes each
_PACKET = 8  # numbers per gather of a table record; packets are padded to powers of two


def is_scalar(types: Any) -> bool:
    """One ray at a time, in Python: Mitsuba's scalar variants."""
    return types.__name__ == "drjit.scalar"


class DeviceVolume:
    """The field's voxels, with ``value(p)``: trilinear data value at an index-space point, in stored units.

    Stored are uint8 data as they are (four neighbours packed in one word up to 2^28 voxels, which halves the time of
    a fetch; else one byte each) and all others as float32 of (f - low) / (high - low). ``unit`` and ``base`` take
    stored units to data values: f = base + unit·stored.
    """

    def __init__(self, types: Any, volume: ScalarVolume) -> None:
        self.types, self.volume = types, volume
        data = volume.data.transpose(2, 1, 0)  # x fastest
        self.is_byte = data.dtype == np.uint8
        low, high = (0.0, 255.0) if self.is_byte else volume.value_range
        self.base, self.unit = low, (high - low) or 1.0
        if self.is_byte:
            self.unit = 1.0
        self.packed = self.is_byte and data.size <= _PACKED_LIMIT and not is_scalar(types)
        self.sizes = opaque(types.UInt32, volume.shape)
        self.last = opaque(types.Float, [n - 1 for n in volume.shape])
        self.below = opaque(types.UInt32, [max(n - 2, 0) for n in volume.shape])
        strides = (1, volume.shape[0], volume.shape[0] * volume.shape[1])
        # A neighbour beyond a single slice is the slice itself.
        self.hops = opaque(types.UInt32, [s if n > 1 else 0 for s, n in zip(strides, volume.shape, strict=True)])
        self.store = self._upload(data)

    def _upload(self, data: NDArray[Any]) -> Any:
        types = self.types
        if is_scalar(types):
            import drjit as dr

            scaled = ((data.astype(np.float64) - self.base) / self.unit).astype(np.float32)
            return types.Texture3f(types.TensorXf(scaled[..., None]), wrap_mode=dr.WrapMode.Clamp)
        if self.packed:
            return types.UInt32(_packed(data).ravel())
        if self.is_byte:
            return types.UInt8(data.ravel())
        if data.dtype == np.float32 and self.base == 0.0 and self.unit == 1.0:
            return types.Float(data.ravel())
        return types.Float(((data.astype(np.float64) - self.base) / self.unit).astype(np.float32).ravel())

    def value(self, p: Any, active: Any) -> Any:
        """Trilinear value at ``p`` (index coordinates), in stored units."""
        import drjit as dr

        types = self.types
        if is_scalar(types):
            n = self.volume.shape
            return self.store.eval([(p[a] + 0.5) / n[a] for a in range(3)])[0]
        clamped = [bounded(p[a], 0.0, self.last[a]) for a in range(3)]
        cell = [dr.minimum(types.UInt32(clamped[a]), self.below[a]) for a in range(3)]
        x, y, z = (clamped[a] - types.Float(cell[a]) for a in range(3))
        first = dr.fma(dr.fma(cell[2], self.sizes[1], cell[1]), self.sizes[0], cell[0])
        hx, hy, hz = self.hops
        if self.packed:
            here = dr.gather(types.UInt32, self.store, first, active)
            beside = dr.gather(types.UInt32, self.store, first + hx, active)
            c00, c10, c01, c11 = (
                _mix(types.Float((here >> s) & 255), types.Float((beside >> s) & 255), x) for s in (0, 8, 16, 24)
            )
        else:
            stored = types.UInt8 if self.is_byte else types.Float

            def pair(offset: Any) -> Any:
                a = dr.gather(stored, self.store, first + offset, active)
                b = dr.gather(stored, self.store, first + offset + hx, active)
                return _mix(types.Float(a), types.Float(b), x)

            c00, c10, c01, c11 = pair(types.UInt32(0)), pair(hy), pair(hz), pair(hy + hz)
        return _mix(_mix(c00, c10, y), _mix(c01, c11, y), z)


class DeviceTable:
    """A transfer table; ``record(x)`` reads one cell, eight numbers at a time.

    A record holds the values of the columns, their rises, with ``integrals`` their running integrals, and with
    ``clearance`` how far away the next value is that shows something, and the rise of that.
    """

    def __init__(
        self, types: Any, table: TransferTable, volume: DeviceVolume, *, integrals: bool, clearance: bool
    ) -> None:
        self.types, self.table = types, table
        self.columns = table.columns.shape[1]
        blocks = [table.nodes_with_slopes]
        if integrals:
            blocks.append(np.vstack([table.integrals[:1], table.integrals]).astype(np.float32))
        self.clear_at = sum(block.shape[1] for block in blocks)
        flat = np.hstack([*blocks, table.clearance] if clearance else blocks)
        parts = [_padded(flat[:, start : start + _PACKET]) for start in range(0, flat.shape[1], _PACKET)]
        per_value = table.cells / (table.high - table.low)
        self.scale = opaque(types.Float, [volume.unit * per_value])[0]
        self.offset = opaque(types.Float, [(volume.base - table.low) * per_value])[0]
        self.cells = opaque(types.Float, [float(table.cells)])[0]
        self.close = opaque(types.Float, [max(1.0, table.cells / 2048)])[0]
        self.widths = [part.shape[1] for part in parts]
        self.stores: list[Any] = [part if is_scalar(types) else types.Float(_aligned(part.ravel())) for part in parts]

    def clear(self, part: Any, record: list[Any]) -> Any:
        """How far, in cells, a data value is from the next one that shows something; zero where it does itself."""
        import drjit as dr

        return dr.fma(part, record[self.clear_at + 1], record[self.clear_at])

    def position(self, stored: Any) -> Any:
        """Table coordinate, in cells from the first node, of a stored data value."""
        import drjit as dr

        return dr.fma(stored, self.scale, self.offset)

    def record(self, x: Any, active: Any) -> tuple[Any, list[Any]]:
        """(distance from the cell's node, its record: see the class)."""
        import drjit as dr

        types = self.types
        cell = types.UInt32(bounded(x + 1.0, 0.0, self.cells + 1.0))
        part = x - larger(types.Float(cell) - 1.0, 0.0)
        if is_scalar(types):
            return part, [float(v) for store in self.stores for v in store[int(cell)]]
        record = []
        for width, store in zip(self.widths, self.stores, strict=True):
            packet = dr.gather(types.ArrayXf, store, cell, active, shape=(width, dr.width(x)))
            record += [packet[i] for i in range(width)]
        return part, record


def _aligned(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """The same on a 64-byte boundary: elsewhere Dr.Jit falls back, unasked, to one gather per number of a packet."""
    room = np.empty(values.nbytes + 64, np.uint8)
    start = -room.ctypes.data % 64
    place: NDArray[np.float32] = room[start : start + values.nbytes].view(np.float32)
    place[:] = values
    return place


def _padded(columns: NDArray[np.float32]) -> NDArray[np.float32]:
    width = 1 << (columns.shape[1] - 1).bit_length()
    return np.pad(columns, ((0, 0), (0, width - columns.shape[1])))


def _packed(data: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """Per voxel its value, that of its +y, its +z and its +y+z neighbour, in one word; at a face the face again."""
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
    """Constants that a kernel reads from memory, so that other values do not make another kernel."""
    import drjit as dr

    return [dr.opaque(kind, v) for v in values]
