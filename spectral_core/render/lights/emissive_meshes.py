# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles of emissive meshes as tables: each is drawn by a bound of its illumination."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.lights.balls import Drawn
from spectral_core.render.lights.listing import EmissiveMesh
from spectral_core.render.plugins.numbers import Rows, table


class EmissiveMeshes:
    """Triangles with their geometric normals: a smooth-shaded mesh emits from its true faces.

    ``first_item``: number of the first triangle among all items.
    """

    def __init__(self, mitsuba: Any, meshes: list[EmissiveMesh], first_item: int) -> None:
        import drjit as dr

        mi = self._mi = mitsuba
        corners = np.concatenate([mesh.corners for mesh in meshes])
        self.corners = [table(mi.Float, corners[:, k]) for k in range(3)]
        normals, areas = geometry(corners)
        self.normals = table(mi.Float, np.concatenate([normals, areas[:, None]], axis=1))
        # for a mesh without UVs, Mitsuba uses the barycentric coordinates of each triangle
        plain = np.array([[0.0, 0], [1, 0], [0, 1]])
        uvs = np.concatenate([
            np.broadcast_to(plain, (len(g.corners), 3, 2)) if g.uvs is None else g.uvs for g in meshes
        ])  # fmt: skip
        self.uvs = [table(mi.Float, uvs[:, k]) for k in range(3)]
        numbers = [int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(mesh.shape))[0]) for mesh in meshes]
        items, sources = np.zeros((2, max(numbers) + 1), np.uint32)
        first = first_item
        for number, mesh in zip(numbers, meshes, strict=True):
            items[number], sources[number] = first, mesh.source + 1
            first += len(mesh.corners)
        self._items, self._sources = table(mi.UInt32, items), Rows.of(table(mi.UInt32, sources))

    def draw(self, slot: Any, place: Any, uv: Any, active: Any) -> Drawn:
        """A point of a triangle, uniformly over its area."""
        import drjit as dr

        mi = self._mi
        first, second, third = (dr.gather(mi.Point3f, corner, slot, active) for corner in self.corners)
        b = mi.warp.square_to_uniform_triangle(uv)
        point = first + (second - first) * b.x + (third - first) * b.y
        away = point - place
        squared = dr.squared_norm(away)
        distance = dr.sqrt(squared)
        direction = away * dr.rcp(dr.maximum(distance, 1e-30))
        normal, density = self._facing(slot, direction, squared, active)
        lit = active & (density > 0.0)
        first, second, third = (dr.gather(mi.Point2f, corner, slot, active) for corner in self.uvs)
        at = first + (second - first) * b.x + (third - first) * b.y
        factor = dr.select(lit, dr.rcp(dr.maximum(density, 1e-30)), 0.0)
        return Drawn(direction, distance, factor, dr.select(lit, density, 0.0), mi.Bool(False), normal, at)

    def _facing(self, slot: Any, direction: Any, squared: Any, active: Any) -> tuple[Any, Any]:
        """Normal of a triangle, and the density of its points per solid angle."""
        import drjit as dr

        row = dr.gather(self._mi.Vector4f, self.normals, slot, active)
        normal = self._mi.Normal3f(row.x, row.y, row.z)
        cosine = dr.abs(dr.dot(direction, normal))
        usable = (cosine > 1e-7) & (row.w > 0.0)
        return normal, dr.select(usable, squared / dr.maximum(cosine * row.w, 1e-30), 0.0)

    def pdf(self, slot: Any, direction: Any, distance: Any, active: Any) -> Any:
        """Density per solid angle of ``draw`` at a point that is hit."""
        return self._facing(slot, direction, distance * distance, active)[1]

    def met(self, tables: Any, si: Any, active: Any) -> tuple[Any, Any]:
        """Item and source (plus 1, 0 for none) of a hit."""
        import drjit as dr

        mi = self._mi
        number = tables.number(si.shape)
        source = self._sources.look_up(number, active=active)
        return dr.gather(mi.UInt32, self._items, number, source != 0) + si.prim_index, source


def geometry(corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Unit normals (t, 3) and areas (t,) of triangles (t, 3, 3)."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(normals, axis=1)
    return normals / np.maximum(doubled, 1e-300)[:, None], doubled / 2
