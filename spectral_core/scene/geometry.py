# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes, their placement, and sampled volumes."""

from __future__ import annotations

import weakref
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import (
    as_array,
    frozen_array,
    read_only_when_copied,
    require_declared,
    require_finite,
    require_kind,
    require_range,
)
from spectral_core.errors import InvalidInputError, counted
from spectral_core.scene.rays import Rays

VOLUME_BOX = "box of volumes"
"""Name of the mesh that borders volumes."""
BORDER_MARGIN = 0.1
"""Voxels between a grid and the box around its medium: volumes often stand on a floor, where faces would coincide."""


@dataclass(frozen=True, slots=True, eq=False)
class Attribute:
    """Values (v, 3) float32 per vertex, with the name for programs: ``"generated"``, ``"attribute:…"``."""

    name: str
    values: NDArray[np.float32]

    def __post_init__(self) -> None:
        values = as_array(f"attribute {self.name!r} has values of", self.values, np.float32)
        if values.ndim != 2 or values.shape[1] != 3:
            raise InvalidInputError(f"attribute {self.name!r} has values of shape {values.shape}; expected (n, 3)")
        require_finite(f"attribute {self.name!r}", values)
        object.__setattr__(self, "values", values)


@read_only_when_copied
@dataclass(frozen=True, slots=True, weakref_slot=True, eq=False)
class Mesh:
    """Triangles in object space.

    ``positions``: (v, 3) float32. ``triangles``: (t, 3) uint32. ``normals``: (v, 3) float32 unit shading normals or
    None for flat faces. ``uvs``: (v, 2) float32 or None. ``material_indices``: (t,) uint16, or None for all 0.
    ``attributes``: data per vertex for shading programs. ``is_strands``: tubes of hair, whose walls no ray meets from
    within. ``has_uv_map``: False if ``uvs`` stand for a missing map. Corners that differ are separate vertices.
    """

    name: str
    positions: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    normals: NDArray[np.float32] | None = None
    uvs: NDArray[np.float32] | None = None
    material_indices: NDArray[np.uint16] | None = None
    attributes: tuple[Attribute, ...] = ()
    is_strands: bool = False
    has_uv_map: bool = True

    def __post_init__(self) -> None:
        # asarray, not a copy: every frame passes a million triangles through here
        set_field = lambda name, value: object.__setattr__(self, name, value)  # noqa: E731
        require_declared(self)
        set_field("positions", _array(self, "positions", np.float32, 3))
        _require_whole_numbers(self, "triangles")
        set_field("triangles", _array(self, "triangles", np.uint32, 3))
        vertex_count = len(self.positions)
        for name, width in (("normals", 3), ("uvs", 2)):
            if getattr(self, name) is not None:
                set_field(name, _array(self, name, np.float32, width, vertex_count))
        for attribute in self.attributes:
            require_kind(f"an attribute of mesh {self.name!r}", attribute, Attribute)
            if len(attribute.values) != vertex_count:
                raise InvalidInputError(
                    f"mesh {self.name!r} has {vertex_count} vertices and its attribute {attribute.name!r} has "
                    f"{counted(len(attribute.values), 'value')}; give one per vertex"
                )
        if self.material_indices is not None:
            _require_whole_numbers(self, "material_indices", 65535)
            indices = np.ascontiguousarray(self.material_indices, dtype=np.uint16)
            if indices.shape != (len(self.triangles),):
                raise InvalidInputError(
                    f"mesh {self.name!r} has {len(self.triangles)} triangles and material_indices of shape "
                    f"{indices.shape}; give one index per triangle"
                )
            set_field("material_indices", indices)
        if self.triangles.size and int(self.triangles.max()) >= vertex_count:
            raise InvalidInputError(
                f"a triangle of mesh {self.name!r} refers to vertex {int(self.triangles.max())}; the mesh has "
                f"{vertex_count} vertices, counted from 0"
            )


_boxes: weakref.WeakKeyDictionary[Mesh, NDArray[np.float64]] = weakref.WeakKeyDictionary()
"""Computed boxes of meshes: a live view needs all of them after every edit."""
_CORNERS = np.array([(x, y, z) for y in (0, 1) for x in (0, 1) for z in (0, 1)])


@cache
def unit_box() -> Mesh:
    """The cube from 0 to 1 along each axis, for the borders of volumes."""
    corners = np.array([(bit >> 2 & 1, bit >> 1 & 1, bit & 1) for bit in range(8)], dtype=np.float32)
    # corners (bit 2: x, bit 1: y, bit 0: z) of each side, counterclockwise from outside
    sides = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    faces = [(a, b, c) for a, b, c, _ in sides] + [(a, c, d) for a, _, c, d in sides]
    return Mesh(VOLUME_BOX, corners, np.array(faces, dtype=np.uint32))


def index_box(shape: Sequence[int], margin: float = 0.0, start: ArrayLike | None = None) -> NDArray[np.float64]:
    """Matrix (4, 4) from the unit box to the voxels of a grid in index space, whose centers are whole numbers.

    ``margin``: number of voxels added on each side; ``start``: index (3,) at which the box begins, -0.5 - ``margin`` if
    None.
    """
    low = np.full(3, -0.5 - margin) if start is None else np.asarray(start, np.float64)
    made = np.diag([*(np.asarray(shape) - 0.5 + margin - low), 1.0])
    made[:3, 3] = low
    return made


def box_of(mesh: Mesh) -> NDArray[np.float64]:
    """(8, 3) corners of the box around a mesh, in object space; (0, 3) for one without vertices."""
    if not len(mesh.positions):
        return np.zeros((0, 3))
    found = _boxes.get(mesh)
    if found is None:
        found = corners_of(mesh.positions)
        found.flags.writeable = False
        _boxes[mesh] = found
    return found


def placed(points: NDArray[Any], world_from_object: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (n, 3) in the world; of k objects, (k, 4, 4), that share the points or have their own: (k, n, 3)."""
    turned = points @ np.swapaxes(world_from_object[..., :3, :3], -1, -2)
    return np.asarray(turned + world_from_object[..., None, :3, 3])


def placed_by_mesh(instances: Iterable[Instance]) -> dict[str, tuple[list[int], NDArray[np.float64]]]:
    """The instances of each mesh: their indices, and their matrices (k, 4, 4)."""
    found: dict[str, list[tuple[int, NDArray[np.float64]]]] = {}
    for number, instance in enumerate(instances):
        found.setdefault(instance.mesh, []).append((number, instance.world_from_object))
    return {mesh: ([n for n, _ in items], np.array([m for _, m in items])) for mesh, items in found.items()}


def placed_boxes(meshes: Iterable[Mesh], instances: Sequence[Instance]) -> list[NDArray[np.float64]]:
    """Corners (8, 3) of the box around each instance in the world; (0, 3) for a mesh without vertices."""
    boxes = {mesh.name: box_of(mesh) for mesh in meshes}
    found = [boxes[each.mesh] for each in instances]
    full = [number for number, box in enumerate(found) if len(box)]
    if full:  # in one product: a call for each of thousands of objects takes longer than an edit may
        matrices = np.array([instances[number].world_from_object for number in full])
        corners = placed(np.array([found[number] for number in full]), matrices)
        for number, box in zip(full, corners, strict=True):
            found[number] = box
    return found


def corners_of(points: NDArray[Any]) -> NDArray[np.float64]:
    """(8, 3) corners of the box around points (n, 3)."""
    ends = np.array([points.min(axis=0), points.max(axis=0)], dtype=np.float64)
    return ends[_CORNERS, np.arange(3)]


def _require_whole_numbers(mesh: Mesh, name: str, most: int = 0xFFFFFFFF) -> None:
    """Raise InvalidInputError for numbers that are not whole, or that another type of integers would change."""
    given = getattr(mesh, name)
    array = given if isinstance(given, np.ndarray) else as_array(f"mesh {mesh.name!r} has {name} of", given, None)
    if array.dtype in (np.dtype(np.uint16), np.dtype(np.uint32)) and np.iinfo(array.dtype).max <= most:
        return  # every frame passes a million triangles through here
    if array.size and array.dtype.kind not in "iu":
        raise InvalidInputError(f"mesh {mesh.name!r} has {name} of type {array.dtype}; expected whole numbers")
    if array.size and (array.min() < 0 or array.max() > most):
        found = array.min() if array.min() < 0 else array.max()
        raise InvalidInputError(f"mesh {mesh.name!r} has {found} among its {name}; expected numbers from 0 to {most}")


def _array(mesh: Mesh, name: str, dtype: Any, width: int, length: int | None = None) -> NDArray[Any]:
    array = as_array(f"mesh {mesh.name!r} has {name} of", getattr(mesh, name), dtype)
    if array.ndim != 2 or array.shape[1] != width or (length is not None and len(array) != length):
        expected = f"({'any' if length is None else length}, {width})"
        raise InvalidInputError(f"mesh {mesh.name!r} has {name} of shape {array.shape}; expected {expected}")
    require_finite(f"mesh {mesh.name!r} {name}", array)
    return array


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class Instance:
    """One placement of a mesh. ``world_from_object``: (4, 4). ``materials``: names, one per material slot of the mesh.

    ``group``: light group of its emission, "" for none. ``hidden_from``: types of rays that pass through it.
    ``is_holdout``: True if it cuts a hole into the camera's view. ``unlit_by``: names of lights that do not illuminate
    it; ``clear_for``: names of lights for which it casts no shadow. ``color`` (r, g, b, alpha), ``index`` and
    ``random`` in [0, 1]: outputs of the Object Info node. ``attributes``: further values for programs, each a name with
    three or four numbers. ``shown_as``, ``asset``: names in cryptomattes, if they differ from ``name``.
    ``is_shadow_catcher``: True if the picture contains only its shadows. ``terminator_cosine``: cosine between light
    and a smooth-shaded triangle below which light starts from the rounded surface, 0 for never.
    ``terminator_shift``: in [0, 2), twice the share of the angles, from the horizon on, at which it reflects no light.
    """

    name: str
    mesh: str
    world_from_object: NDArray[np.float64]
    materials: tuple[str, ...] = ()
    group: str = ""
    hidden_from: Rays = Rays.NONE
    is_holdout: bool = False
    unlit_by: tuple[str, ...] = ()
    clear_for: tuple[str, ...] = ()
    color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    index: int = 0
    random: float = 0.0
    attributes: tuple[tuple[str, tuple[float, ...]], ...] = ()
    shown_as: str = ""
    asset: str = ""
    is_shadow_catcher: bool = False
    terminator_cosine: float = 0.0
    terminator_shift: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "world_from_object", affine(f"instance {self.name!r}", self.world_from_object))
        require_range(f"instance {self.name!r}: terminator_cosine", self.terminator_cosine, 0.0, 1.0)
        require_range(f"instance {self.name!r}: terminator_shift", self.terminator_shift, 0.0, 1.99)


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class VolumeObject:
    """A sampled scalar volume with a transfer function.

    ``data``: (nx, ny, nz), any integer or float type. ``world_from_index``: (4, 4), voxel centers to world space.
    ``transfer``: a ``spectral_core.volume`` transfer function (not typed here, because ``scene`` does not import
    ``volume``). ``rule`` and ``quality`` (SNR of the picture in dB, 10 to 90): as ``spectral_core.volume`` defines
    them. ``lighting``: one of ``spectral_core.render.volumes.LIGHTING``. ``hidden_from``: rays that pass it.
    Without shadows, rays that matt surfaces scatter and those to lamps pass it, too.
    """

    name: str
    data: NDArray[Any]
    world_from_index: NDArray[np.float64]
    transfer: Any
    rule: str = "auto"
    quality: float = 50.0
    lighting: str = "scene"
    hidden_from: Rays = Rays.NONE

    def __post_init__(self) -> None:
        if not isinstance(self.data, np.ndarray):
            object.__setattr__(self, "data", as_array(f"volume {self.name!r} has data of", self.data, None))
        if self.data.ndim != 3:
            raise InvalidInputError(f"volume {self.name!r} has data of shape {self.data.shape}; expected (nx, ny, nz)")
        object.__setattr__(self, "world_from_index", affine(f"volume {self.name!r}", self.world_from_index))
        require_range(f"the quality of volume {self.name!r}", self.quality, 10.0, 90.0, " dB")


def affine(name: str, matrix: Any) -> NDArray[np.float64]:
    """A finite (4, 4) matrix with last row 0, 0, 0, 1, read-only; else InvalidInputError naming ``name``."""
    array = frozen_array(f"{name}: its matrix", matrix, (4, 4))
    if np.abs(array[3] - (0, 0, 0, 1)).max() > 1e-5:
        last = array[3].tolist()
        raise InvalidInputError(f"{name}: its matrix has last row {last}; expected an affine map, (0, 0, 0, 1)")
    return array
