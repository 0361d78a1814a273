# SPDX-License-Identifier: GPL-3.0-or-later
"""Data that shading programs read beside the hit point: numbers, images, tables and matrices of objects, as buffers."""

from __future__ import annotations

import weakref
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from spectral_core.render.plugins.numbers import own_copy
from spectral_core.render.plugins.numbers import table as device_table
from spectral_core.render.plugins.placing import cofactors, is_regular
from spectral_core.scene.shading import Instruction

ROW = 33
"""Numbers per placed object: 12 of object from world, 12 of world from object, color (4), index, random, its own, and
the cosine and the frequency of its shadow terminator.
"""


def attribute_name(name: str) -> str:
    """Mitsuba's name of the vertex attribute that a program calls ``name``."""
    return "vertex_" + name.encode().hex()


def data_number(data: Any) -> int:
    """Number of the pixels of an image, or of a table."""
    return id(getattr(data, "pixels", data))


def _inverse(matrix: np.ndarray) -> np.ndarray:
    """Inverse of an affine (4, 4) matrix; the pseudoinverse of a singular one."""
    if not is_regular(matrix[:3, :3]) and np.linalg.matrix_rank(matrix) < 4:
        return np.linalg.pinv(matrix)
    turning, determinant = cofactors(matrix[:3, :3])
    result = np.eye(4)
    result[:3, :3] = turning.T / determinant
    result[:3, 3] = -(result[:3, :3] @ matrix[:3, 3])
    return result


@dataclass
class SceneTables:
    """Data on objects and the camera for programs; filled while a scene is loaded.

    ``rows``: by the number of a shape or instance in Mitsuba's registry, ``ROW`` numbers each.
    """

    mi: Any
    dr: Any
    camera_from_world: Any = None
    window: tuple[float, ...] = (1.0, 1.0, 0.0, 0.0, 1.0)
    rows: dict[int, np.ndarray] = field(default_factory=dict)
    has_instances: bool = False
    has_bodies: bool = False
    """True if lamps have bodies in the scene, which the rays of programs must pass."""
    reads_lengths: bool = False
    """True if a program reads the length of the ray from the last bounce."""
    attributes: dict[str, int] = field(default_factory=dict)
    """Column of each named attribute; all are known before the first program is traced."""
    first_target: Any = None
    """A 0 that kernels read from memory: the index of the first of several targets."""
    meshes: Any = None
    """``MeshTables`` of the scene, for programs that send rays."""
    _home: Any = None
    _owners: dict[str, int] = field(default_factory=dict)
    _buffer: Any = None
    _last: Any = None
    _camera: Any = None
    _images: dict[int, tuple[Any, Any]] = field(default_factory=dict)
    """By the number of an image's pixels or of a table: these, which keep their number so, and what is on the device.
    """

    def __post_init__(self) -> None:
        self.first_target = self.dr.opaque(self.mi.UInt32, 0)

    def place(self, shape: Any, instance: Any, *, is_instance: bool = False) -> None:
        """Store the matrix of a shape, or of an instance of shapes."""
        number = int(self.dr.reinterpret_array(self.mi.UInt32, self.mi.ShapePtr(shape))[0])
        matrix = np.asarray(instance.world_from_object, dtype=np.float64)
        parts = (_inverse(matrix)[:3].ravel(), matrix[:3].ravel(), instance.color, (instance.index, instance.random))
        row = np.zeros(ROW + 3 * len(instance.attributes))
        row[:30] = np.concatenate([np.ravel(part) for part in parts])
        row[30] = self._owners.setdefault(instance.name, len(self._owners) + 1)
        row[31:33] = instance.terminator_cosine, 1.0 / (1.0 - 0.5 * instance.terminator_shift)
        for name, value in instance.attributes:
            column = self.attributes.setdefault(name, ROW + 3 * len(self.attributes))
            row.resize(max(row.size, column + 3), refcheck=False)
            row[column : column + 3] = value[:3]
        self.rows[number] = row
        self._buffer = None  # a light may have read it before all shapes were placed
        self.has_instances |= is_instance  # no reference: it would never be freed

    @property
    def row_size(self) -> int:
        """Numbers in a row."""
        return ROW + 3 * len(self.attributes)

    def buffer(self) -> Any:
        """All rows on the device; objects without a matrix have the identity."""
        if self._buffer is None:
            plain = np.zeros(self.row_size)
            plain[:24] = np.tile(np.eye(4)[:3].ravel(), 2)
            plain[24:28] = plain[32] = 1
            table = np.tile(plain, (max(self.rows, default=0) + 1, 1))
            for number, row in self.rows.items():
                table[number, : row.size] = row
            self._buffer = device_table(self.mi.Float, table)
            self._last = self.dr.opaque(self.mi.UInt32, len(table) - 1)
        return self._buffer

    def placement(self, number: Any, active: Any) -> list[Any]:
        """The 24 numbers of object from world and of world from object, of a shape or instance by its number."""
        at = number * self.row_size
        return [self.dr.gather(self.mi.Float, self.buffer(), at + k, active) for k in range(24)]

    def is_reversed(self, si: Any, active: Any) -> Any:
        """True where the corners of a triangle have the opposite order: a mesh without instance is stored in the world,
        and that of a mirrored object is reversed (``mitsuba_scene.geometry.transformed``).
        """
        mi, dr = self.mi, self.dr
        at = self.row_of(dr.reinterpret_array(mi.UInt32, si.shape)) + 12
        numbers = [dr.gather(mi.Float, self.buffer(), at + 4 * i + j, active) for i in range(3) for j in range(3)]
        return (dr.reinterpret_array(mi.UInt32, si.instance) == 0) & (dr.det(mi.Matrix3f(*numbers)) < 0.0)

    def owner(self, number: Any, active: Any) -> Any:
        """Number of the object to which a shape or instance belongs, whatever its material."""
        return self.dr.gather(self.mi.Float, self.buffer(), self.row_of(number) + 30, active)

    def row_of(self, number: Any) -> Any:
        """Place in the buffer of the row of a shape or instance; the first row for one without."""
        self.buffer()
        return self.dr.select(number <= self._last, number, 0) * self.row_size

    def terminator(self, number: Any, active: Any) -> Any:
        """Cosine below which light starts from the rounded surface of a shape or instance."""
        return self.dr.gather(self.mi.Float, self.buffer(), self.row_of(number) + 31, active)

    @property
    def shifts(self) -> bool:
        """True if the shadow terminator of some object is moved toward the light."""
        return any(row[32] > 1.0 for row in self.rows.values())

    def frequency(self, number: Any, active: Any) -> Any:
        """Factor on the angles to the normal at which a shape or instance reflects light; 1 where nothing is moved."""
        return self.dr.gather(self.mi.Float, self.buffer(), self.row_of(number) + 32, active)

    def live_in(self, home: Any) -> None:
        """Let programs that send rays find the scene, as ``home.scene``.

        The reference is weak: Mitsuba's shapes know these tables, and a scene that they knew would never end.
        """
        self._home = weakref.ref(home)

    @property
    def is_live(self) -> bool:
        """True if the scene is loaded."""
        return self._home is not None

    def scene(self) -> Any:
        """Mitsuba's scene, once it is loaded."""
        return self._home().scene

    def rebuild(self) -> None:
        """Write all rows again, after one was placed anew."""
        self._buffer = None
        self.buffer()

    def look_from(self, camera_from_world: np.ndarray, window: tuple[float, ...], pixel: float) -> None:
        """Set the camera: programs read its numbers from one array, so that a moved camera needs no new kernel.

        ``pixel``: width of a pixel, in the unit of the window's width.
        """
        self.camera_from_world, self.window = camera_from_world, window
        there = np.asarray(camera_from_world, dtype=np.float64)
        rows = [there[:3].ravel(), np.linalg.pinv(there)[:3].ravel(), np.array([*window, pixel])]
        numbers = device_table(self.mi.Float, np.concatenate(rows))
        if self._camera is None:
            self._camera = numbers
        else:
            self._camera[:] = numbers  # recorded launches know this object

    def camera_matrix(self, inverse: bool) -> list[list[Any]]:
        """Rows (3 of 4 numbers) of camera from world, or of world from camera."""
        start = 12 if inverse else 0
        return [[self._camera_number(start + 4 * i + j) for j in range(4)] for i in range(3)]

    def camera_window(self) -> tuple[Any, ...]:
        """Width and height of the frame at distance 1, its shift, and 1 for a perspective camera."""
        return tuple(self._camera_number(24 + k) for k in range(5))

    def pixel_width(self) -> tuple[Any, Any]:
        """Width of a pixel at distance 1, or everywhere; 1 for a perspective camera, 0 for an orthographic one."""
        return self._camera_number(29), self._camera_number(28)

    def _camera_number(self, place: int) -> Any:
        return self.dr.gather(self.mi.Float, self._camera, self.mi.UInt32(place))

    def number(self, value: float) -> Any:
        """A number that kernels read from memory."""
        return self.dr.opaque(self.mi.Float, float(value))

    def image(self, texture: Any) -> tuple[Any, Any, Any, bool]:
        """Pixels of an image on the device (four bytes to a word), its width, its height, and True if they are
        bytes.
        """
        pixels = texture.pixels
        if id(pixels) not in self._images:
            height, width, channels = pixels.shape
            full = np.empty((height, width, 4), pixels.dtype)
            full[..., :3] = pixels[..., :3]
            full[..., 3] = pixels[..., 3] if channels == 4 else (255 if pixels.dtype == np.uint8 else 1)
            is_bytes = pixels.dtype == np.uint8
            stored = (
                own_copy(self.mi.UInt32, full.view(np.uint32))
                if is_bytes
                else own_copy(self.mi.Float, full.astype(np.float32, copy=False))
            )
            self._images[id(pixels)] = pixels, (stored, self.number(width), self.number(height), is_bytes)
        return self._images[id(pixels)][1]

    def content(self, data: Any) -> Any:
        """An image, a ramp or a curve on the device."""
        return self.table(data) if isinstance(data, np.ndarray) else self.image(data)

    def contents_of(self, instructions: Iterable[Instruction]) -> dict[int, Any]:
        """What a program reads of images, ramps and curves, by the number of their data: references of its own.

        Programs that read one image may read two after an edit. Dr.Jit tells by the references of each program which
        of them read the same array, and does not replay a launch that was recorded when others did.
        """
        data = [item.data for item in instructions if item.data is not None]
        return {
            data_number(each): tuple(
                type(part)(part) if self.dr.is_array_v(part) else part for part in self.content(each)
            )
            for each in data
        }

    def replace(self, old: Any, new: Any) -> None:
        """Replace the contents of an image or table by another of the same size; equal contents are not copied."""
        before, after = (getattr(item, "pixels", item) for item in (old, new))
        if id(before) not in self._images or before is after:
            return
        place, is_equal = list(self._images).index(id(before)), np.array_equal(before, after)
        _, kept = self._images.pop(id(before))
        if is_equal:
            self._images[id(after)] = after, kept
        else:
            self.content(new)
        # the same index in the order by which recorded launches identify their arrays
        entries = [(key, value) for key, value in self._images.items() if key != id(after)]
        entries.insert(place, (id(after), self._images[id(after)]))
        self._images = dict(entries)

    def table(self, table: np.ndarray) -> Any:
        """A ramp or curve on the device."""
        if id(table) not in self._images:
            self._images[id(table)] = table, (device_table(self.mi.Float, table), self.number(len(table) - 1))
        return self._images[id(table)][1]
