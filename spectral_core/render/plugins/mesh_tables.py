# SPDX-License-Identifier: GPL-3.0-or-later
"""The triangles of a scene as one table, from which kernels read the data of a hit.

Mitsuba calls the shape that was hit: each instance is then a function of its own in the kernel, and an object with a
hundred instances takes seconds to compile. Read from tables, any number of shapes is the same code.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.plugins.numbers import aligned, own_copy
from spectral_core.render.plugins.paints.tables import SceneTables, attribute_name

REGISTRY_STEP = 16
NONE = 0xFFFFFFFF
"""Value in place of an index for missing data."""
COLUMNS = 4
"""Per shape: first triangle, first vertex, first normal, first UV coordinate; for a ball its number in the second
column and ``NONE`` in the first; for an instance the first of its parts in the second and ``NONE`` in the first.
"""


@dataclass
class _Triangles:
    positions: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    normals: NDArray[np.float32] | None
    uvs: NDArray[np.float32] | None
    attributes: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)


def barycentric(dr: Any, corners: list[Any], place: Any) -> tuple[Any, Any, Any]:
    """Shares of a triangle's corners at a point of its plane; those of the first corner if it has no area."""
    whole = dr.cross(corners[1] - corners[0], corners[2] - corners[0])
    size = dr.maximum(dr.squared_norm(whole), 1e-36)
    second = dr.dot(dr.cross(place - corners[0], corners[2] - corners[0]), whole) / size
    third = dr.dot(dr.cross(corners[1] - corners[0], place - corners[0]), whole) / size
    return 1.0 - second - third, second, third


class MeshTables:
    """All meshes by their number in Mitsuba's registry; ``scene`` contains the matrices of instances."""

    def __init__(self, scene: SceneTables, *, movable: bool) -> None:
        self.scene, self.mi, self.dr, self.movable = scene, scene.mi, scene.dr, movable
        self._meshes: dict[int, _Triangles] = {}
        self._balls: dict[int, tuple[float, ...]] = {}
        self._parts: dict[int, list[int]] = {}
        self.faces = self.positions = self.normals = self.uvs = self.rows = self.parts = self.balls = None
        self.attributes: dict[str, list[Any]] = {}
        """By the name of an attribute: for each shape the first of its values, and all values."""

    def add(self, shape: Any) -> None:
        """Add a mesh or a sphere of Mitsuba, or replace the vertices of one that was added before."""
        number, parameters = self._number(shape), self.mi.traverse(shape)
        if "faces" not in parameters:
            matrix = np.array(parameters["to_world"].matrix, dtype=np.float64).reshape(4, 4)
            self._balls[number] = (*matrix[:3, 3].tolist(), float(np.linalg.norm(matrix[:3, 0])))
            return
        names = ("vertex_positions", "faces", "vertex_normals", "vertex_texcoords")
        positions, faces, normals, uvs = (np.array(parameters[name]) for name in names)
        known = self._meshes[number].attributes if number in self._meshes else ()
        self._meshes[number] = _Triangles(
            positions.reshape(-1, 3),
            faces.reshape(-1, 3),
            normals.reshape(-1, 3) if normals.size else None,
            uvs.reshape(-1, 2) if uvs.size else None,
            {name: np.array(parameters[attribute_name(name)]).reshape(-1, 3) for name in known},
        )

    def add_mesh(self, shape: Any, part: Any) -> None:
        """Add a mesh of Mitsuba by the part that it was made of: reading it back takes as long as making it."""
        values = {item.name: item.values for item in part.attributes}
        self._meshes[self._number(shape)] = _Triangles(part.positions, part.triangles, part.normals, part.uvs, values)

    def add_instance(self, placed: Any, shapes: list[Any]) -> None:
        """Add an instance of a group of meshes, in the order of the group."""
        self._parts[self._number(placed)] = [self._number(shape) for shape in shapes]

    @property
    def last(self) -> int:
        """Highest number of a shape of the scene."""
        return max((*self._meshes, *self._balls, *self._parts), default=0)

    def spare_shapes(self) -> list[Any]:
        """Meshes beside the scene that fill Mitsuba's registry up to a multiple of ``REGISTRY_STEP``.

        Keep them as long as the scene. Kernels contain the size of tables with a row for each registered shape. Filled
        up, a few more objects do not change it, and no kernel is compiled for them.
        """
        spare, number = [], 0
        while number <= self.last or number % REGISTRY_STEP:
            spare.append(self.mi.Mesh("spare", vertex_count=3, face_count=1))
            number = self._number(spare[-1])
        return spare

    def _number(self, shape: Any) -> int:
        return int(self.dr.reinterpret_array(self.mi.UInt32, self.mi.ShapePtr(shape))[0])

    def seal(self) -> None:
        """Write everything to the device."""
        mi, meshes = self.mi, self._meshes
        rows = np.full((self.last + 1, COLUMNS), NONE, np.uint32)
        starts = np.zeros(COLUMNS, np.uint32)
        for number, mesh in meshes.items():
            has = [True, True, mesh.normals is not None, mesh.uvs is not None]
            rows[number] = np.where(has, starts, NONE)
            starts += np.array([len(mesh.triangles), *(len(mesh.positions) * each for each in has[1:])], np.uint32)
        for count, number in enumerate(self._balls):
            rows[number, 1] = count
        first = 0
        for number, parts in self._parts.items():
            rows[number, 1] = first
            first += len(parts)
        self.rows = self._array(mi.UInt32, rows)
        self.parts = self._array(mi.UInt32, np.array([k for of in self._parts.values() for k in of] or [0, 0]))
        for name in dict.fromkeys(name for mesh in meshes.values() for name in mesh.attributes):
            first, places = 0, np.full(self.last + 1, NONE, np.uint32)
            for number, mesh in meshes.items():
                if name in mesh.attributes:
                    places[number] = first
                    first += len(mesh.attributes[name])
            self.attributes[name] = [self._array(mi.UInt32, places), None]
        self.write_vertices(faces=True)

    def write_vertices(self, *, faces: bool = False) -> None:
        """Write positions, normals, UV maps, attributes and balls again; ``faces``: the corners of triangles, too."""
        mi, meshes = self.mi, list(self._meshes.values())
        self.balls = self._array(mi.Float, np.array(list(self._balls.values()) or [(0.0, 0.0)]))
        if faces:
            self.faces = self._joined(mi.UInt32, [mesh.triangles for mesh in meshes])
        self.positions = self._joined(mi.Float, [mesh.positions for mesh in meshes])
        self.normals = self._joined(mi.Float, [mesh.normals for mesh in meshes if mesh.normals is not None])
        self.uvs = self._joined(mi.Float, [mesh.uvs for mesh in meshes if mesh.uvs is not None])
        for name, kept in self.attributes.items():
            kept[1] = self._joined(mi.Float, [mesh.attributes[name] for mesh in meshes if name in mesh.attributes])

    def _joined(self, kind: Any, arrays: list[Any]) -> Any:
        return self._array(kind, np.concatenate([np.ravel(array) for array in arrays] or [np.zeros(2)]))

    def _array(self, kind: Any, values: Any) -> Any:
        flat = np.ravel(values).astype(np.uint32 if kind is self.mi.UInt32 else np.float32)
        return own_copy(kind, flat) if self.movable else kind(aligned(flat))

    def intersect(self, scene: Any, ray: Any, coherent: Any, active: Any) -> Any:
        """The nearest hit of a ray, equal to Mitsuba's ``ray_intersect`` except for the derivatives of normals."""
        mi, dr = self.mi, self.dr
        found = scene.ray_intersect_preliminary(ray, coherent=coherent, active=active)
        valid = mi.Bool(active) & found.is_valid()
        own = dr.reinterpret_array(mi.UInt32, found.shape)
        si = dr.zeros(mi.SurfaceInteraction3f)
        if self._parts:
            placed = dr.reinterpret_array(mi.UInt32, found.instance)
            is_placed = valid & (placed != 0)
            first = dr.gather(mi.UInt32, self.rows, placed * COLUMNS + 1, is_placed)
            part = dr.gather(mi.UInt32, self.parts, first + found.shape_index, is_placed)
            own = dr.select(is_placed, part, own)
            si.instance = dr.reinterpret_array(mi.ShapePtr, dr.select(is_placed, placed, 0))
        own = dr.select(valid, own, 0)
        si.shape = dr.reinterpret_array(mi.ShapePtr, own)
        si.t, si.prim_index = dr.select(valid, found.t, dr.inf), found.prim_index
        si.time, si.wavelengths = ray.time, ray.wavelengths
        self.triangle(si, own, found.prim_uv, valid)
        if self._balls:
            self._ball(si, own, ray, valid)
        if self._parts:
            self._to_world(si, is_placed)
        along = si.dp_du - si.sh_frame.n * dr.dot(si.sh_frame.n, si.dp_du)
        si.sh_frame.s = dr.normalize(along)
        si.sh_frame.t = dr.cross(si.sh_frame.n, si.sh_frame.s)
        si.wi = dr.select(valid, si.to_local(-ray.d), -ray.d)
        return si

    def attribute(self, name: str, si: Any, place: Any, active: Any) -> Any:
        """An attribute (vector) at a point of the plane of a triangle, in the space of its mesh; without it 0, but the
        alpha of the node Attribute is 1.
        """
        mi, dr = self.mi, self.dr
        missing = mi.Vector3f(1.0 if name.startswith("attribute_alpha:") else 0.0)
        if name not in self.attributes:
            return missing
        starts, values = self.attributes[name]
        places, corners, known = self.own_corners(si, active)
        first = dr.gather(mi.UInt32, starts, dr.reinterpret_array(mi.UInt32, si.shape), known)
        known &= first != NONE
        shares = barycentric(dr, corners, place)
        at = [dr.gather(mi.Vector3f, values, first + places[k], known) for k in range(3)]
        return dr.select(known, at[0] * shares[0] + at[1] * shares[1] + at[2] * shares[2], missing)

    @property
    def has_parts(self) -> bool:
        """True if any mesh is shared by instances."""
        return bool(self._parts)

    def own_corners(self, si: Any, active: Any) -> tuple[Any, list[Any], Any]:
        """Indices and positions of the corners of the triangle of a hit, in the mesh's space, and whether it is one."""
        mi, dr = self.mi, self.dr
        number = dr.reinterpret_array(mi.UInt32, si.shape)
        known = active & si.is_valid()
        face, vertex = (dr.gather(mi.UInt32, self.rows, number * COLUMNS + k, known) for k in range(2))
        known &= face != NONE
        places = dr.gather(mi.Vector3u, self.faces, face + si.prim_index, known)
        return places, [dr.gather(mi.Point3f, self.positions, vertex + places[k], known) for k in range(3)], known

    def corners(self, si: Any, active: Any) -> tuple[list[Any], Any]:
        """Corners, in the world, of the triangle of a hit, and whether it is one."""
        mi, dr = self.mi, self.dr
        _, corners, known = self.own_corners(si, active)
        if self._parts:
            placed = dr.reinterpret_array(mi.UInt32, si.instance)
            moved = known & (placed != 0)
            out = self.scene.placement(placed, moved)[12:]
            rows = [out[4 * i : 4 * i + 4] for i in range(3)]
            corners = [
                dr.select(moved, mi.Point3f(*(a * p.x + b * p.y + c * p.z + d for a, b, c, d in rows)), p)
                for p in corners
            ]
        return corners, known

    def triangle(self, si: Any, number: Any, place: Any, valid: Any) -> None:
        """Position, normals, UV coordinates and tangents at a point of a triangle, in the mesh's space."""
        mi, dr = self.mi, self.dr
        face, vertex, normal, uv = (dr.gather(mi.UInt32, self.rows, number * COLUMNS + k, valid) for k in range(4))
        valid = valid & (face != NONE)
        corners = dr.gather(mi.Vector3u, self.faces, face + si.prim_index, valid)
        b1, b2 = place.x, place.y
        b0 = 1.0 - b1 - b2

        def mean(values: Any) -> Any:
            return dr.fma(values[0], b0, dr.fma(values[1], b1, values[2] * b2))

        p = [dr.gather(mi.Point3f, self.positions, vertex + corners[k], valid) for k in range(3)]
        si.p = mean(p)
        first, second = mi.Vector3f(p[1] - p[0]), mi.Vector3f(p[2] - p[0])
        si.n = mi.Normal3f(dr.normalize(dr.cross(first, second)))
        smooth = valid & (normal != NONE)
        n = mean([dr.gather(mi.Normal3f, self.normals, normal + corners[k], smooth) for k in range(3)])
        si.sh_frame.n = dr.select(smooth, n * dr.rsqrt(dr.squared_norm(n)), si.n)

        mapped = valid & (uv != NONE)
        places = [dr.gather(mi.Point2f, self.uvs, uv + corners[k], mapped) for k in range(3)]
        si.uv = dr.select(mapped, mean(places), mi.Point2f(b1, b2))
        d1, d2 = places[1] - places[0], places[2] - places[0]
        determinant = dr.fma(d1.x, d2.y, -(d1.y * d2.x))
        inverse = dr.rcp(determinant)
        along = (d2.y * first - d1.y * second) * inverse, (d1.x * second - d2.x * first) * inverse
        across = mi.coordinate_system(si.n)  # for a UV map without area

        def tangent(k: int) -> Any:
            return dr.select(mapped, dr.select(determinant != 0.0, along[k], across[k]), (first, second)[k])

        si.dp_du, si.dp_dv = tangent(0), tangent(1)

    def _ball(self, si: Any, number: Any, ray: Any, valid: Any) -> None:
        """Position and normal on a sphere."""
        mi, dr = self.mi, self.dr
        face, ball = (dr.gather(mi.UInt32, self.rows, number * COLUMNS + k, valid) for k in range(2))
        mine = valid & (face == NONE)
        center = mi.Point3f(*(dr.gather(mi.Float, self.balls, ball * 4 + k, mine) for k in range(3)))
        normal = dr.normalize(ray(si.t) - center)
        si.n = dr.select(mine, mi.Normal3f(normal), si.n)
        si.sh_frame.n = dr.select(mine, mi.Normal3f(normal), si.sh_frame.n)
        si.p = dr.select(mine, center + normal * dr.gather(mi.Float, self.balls, ball * 4 + 3, mine), si.p)
        across, up = mi.coordinate_system(si.n)
        si.dp_du, si.dp_dv = dr.select(mine, across, si.dp_du), dr.select(mine, up, si.dp_dv)

    def _to_world(self, si: Any, placed: Any) -> None:
        """From the space of an instance's meshes to the world."""
        mi, dr = self.mi, self.dr
        numbers = self.scene.placement(dr.reinterpret_array(mi.UInt32, si.instance), placed)
        back, out = numbers[:12], numbers[12:]

        def moved(v: Any, origin: float) -> list[Any]:
            rows = (out[4 * i : 4 * i + 4] for i in range(3))
            return [a * v.x + b * v.y + c * v.z + d * origin for a, b, c, d in rows]

        def turned(v: Any) -> Any:
            normal = mi.Normal3f(*(back[i] * v.x + back[4 + i] * v.y + back[8 + i] * v.z for i in range(3)))
            return dr.normalize(normal)

        si.p = dr.select(placed, mi.Point3f(*moved(si.p, 1.0)), si.p)
        si.n = dr.select(placed, turned(si.n), si.n)
        si.sh_frame.n = dr.select(placed, turned(si.sh_frame.n), si.sh_frame.n)
        si.dp_du = dr.select(placed, mi.Vector3f(*moved(si.dp_du, 0.0)), si.dp_du)
        si.dp_dv = dr.select(placed, mi.Vector3f(*moved(si.dp_dv, 0.0)), si.dp_dv)
