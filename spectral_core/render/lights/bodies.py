# SPDX-License-Identifier: GPL-3.0-or-later
"""The bodies of lamps in a scene of their own: they cast no shadow, so shadow rays need not pass through them.

A few triangles enclose each ball and panel; for a ray that hits them, the exact formula of the lamp decides.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.lights.listing import LightList
from spectral_core.render.plugins.numbers import table

Array = NDArray[np.float64]
MOST_BODIES = 4096
"""Lamps that one ray may pass through."""
NO_FACE = 0xFFFFFFFF
"""Number of no triangle."""


class Bodies:
    """``mesh``: one mesh of all proxies. ``longest``: distance to move a ray back so that it starts outside every
    proxy.
    """

    def __init__(self, mitsuba: Any, lights: LightList) -> None:
        mi = self._mi = mitsuba
        positions, triangles, items, longest = _proxies(lights)
        mesh = mi.Mesh("lamps", vertex_count=len(positions), face_count=len(triangles), props=_clear(mi))
        parameters = mi.traverse(mesh)
        for name, values in (("vertex_positions", positions), ("faces", triangles)):
            parameters[name] = type(parameters[name])(values.ravel())
        parameters.update()
        self.scene = mi.load_dict({"type": "scene", "lamps": mesh}, parallel=False, optimize=False)
        self._items = table(mi.UInt32, items)
        corners = positions[triangles].astype(float)
        normals = np.cross(*(corners[:, k] - corners[:, 0] for k in (1, 2)))
        farthest = np.abs(corners).max(axis=(1, 2))
        self._faces = table(mi.Float, np.column_stack([normals, farthest]))
        import drjit

        self._back = drjit.opaque(mi.Float, float(longest))
        self._most = drjit.opaque(mi.UInt32, MOST_BODIES)

    def each(self, ray: Any, length: Any, active: Any, visit: Any) -> Any:
        """The sum of ``visit(item, active)`` over the proxies that a ray enters before ``length``."""
        import drjit as dr

        mi = self._mi

        def body(origin: Any, left: Any, total: Any, last: Any, count: Any, going: Any) -> Any:
            probe = mi.Ray3f(ray)
            probe.o, probe.maxt = origin, left
            met = self.scene.ray_intersect_preliminary(probe, coherent=False, active=going)
            found = going & met.is_valid()
            x, y, z, farthest = dr.gather(mi.Vector4f, self._faces, met.prim_index, found)
            item = dr.gather(mi.UInt32, self._items, met.prim_index, found)
            is_entered = dr.dot(mi.Vector3f(x, y, z), ray.d) < 0.0
            total += visit(item, found & is_entered & (met.prim_index != last))
            # beyond the triangle by the rounding error of its position, which grows with its corners' coordinates; at
            # grazing angles it is larger, and the ray meets the same triangle once more
            step = met.t + (dr.max(dr.abs(origin)) + met.t + farthest) * 4e-7
            origin = dr.select(found, origin + ray.d * step, origin)
            left = dr.select(found, left - step, left)
            last = dr.select(found, met.prim_index, last)
            return origin, left, total, last, count + 1, found & (left > 0.0) & (count < self._most)

        begin = ray.o - ray.d * self._back, length + self._back
        start = (*begin, mi.Spectrum(0.0), mi.UInt32(NO_FACE), mi.UInt32(0), mi.Bool(active))
        return dr.while_loop(start, lambda *state: state[5], body, labels=("o", "l", "t", "f", "n", "g"))[2]


def _clear(mi: Any) -> Any:
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict({"type": "null"})
    properties["face_normals"] = True
    return properties


def _proxies(lights: LightList) -> tuple[NDArray[np.float32], NDArray[np.uint32], NDArray[np.intp], float]:
    """Positions, triangles, the item of each triangle, and the largest extent of one proxy that has an inside."""
    corners, faces = _icosahedron()
    positions, triangles, items, count, longest = [], [], [], 0, 0.0
    for item, ball in enumerate(lights.balls):
        if ball.radius > 0:
            positions.append(ball.center + corners * ball.radius)
            triangles.append(faces + count)
            items.append(np.full(len(faces), item))
            count += len(corners)
            longest = max(longest, 2.1 * float(np.abs(corners).max()) * ball.radius)
    for number, panel in enumerate(lights.panels):
        signs = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]]) * 1.001
        square = panel.center + signs @ panel.half_axes.T
        across, up = panel.half_axes.T
        if np.dot(np.cross(across, up), panel.normal) < 0:
            square = square[::-1]
        positions.append(square)
        triangles.append(np.array([[0, 1, 2], [0, 2, 3]]) + count)
        items.append(np.full(2, len(lights.balls) + number))
        count += 4
    return (
        np.concatenate(positions).astype(np.float32),
        np.concatenate(triangles).astype(np.uint32),
        np.concatenate(items),
        longest,
    )


@cache
def _icosahedron() -> tuple[Array, NDArray[np.intp]]:
    """Corners and outward faces of an icosahedron whose faces lie just outside of the unit sphere."""
    golden = (1 + 5**0.5) / 2
    corners = np.array([
        c for a in (-1, 1) for b in (-golden, golden) for c in ((0, a, b), (a, b, 0), (b, 0, a))
    ])  # fmt: skip
    distances = np.linalg.norm(corners[:, None] - corners[None], axis=2)
    near = np.isclose(distances, 2.0)
    faces = []
    for a in range(12):
        for b in range(a + 1, 12):
            for c in range(b + 1, 12):
                if near[a, b] and near[b, c] and near[a, c]:
                    outward = np.dot(np.cross(corners[b] - corners[a], corners[c] - corners[a]), corners[a]) > 0
                    faces.append((a, b, c) if outward else (a, c, b))
    inscribed = golden**2 / 3**0.5
    return corners / inscribed * 1.002, np.array(faces)
