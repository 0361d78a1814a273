# SPDX-License-Identifier: GPL-3.0-or-later
"""Points drawn on emissive surfaces, where Mitsuba's sampling is unsuitable: narrow beams, and smooth-shaded meshes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.plugins.numbers import opaque_number, table


def _vector(values: NDArray[np.float64]) -> list[Any]:
    import drjit
    import mitsuba

    return [opaque_number(mitsuba, drjit, float(value)) for value in values]


def _direction_sample(it: Any, point: Any, normal: Any) -> Any:
    """Direction from a receiver to a point of a surface, without its density."""
    import drjit as dr
    import mitsuba as mi

    ds = dr.zeros(mi.DirectionSample3f)
    ds.p, ds.n, ds.time, ds.delta = point, normal, it.time, mi.Bool(False)
    ds.d = ds.p - it.p
    squared = dr.squared_norm(ds.d)
    ds.dist = dr.sqrt(squared)
    ds.d = dr.select(squared > 0.0, ds.d * dr.rcp(ds.dist), ds.d)
    return ds


def _per_solid_angle(ds: Any, per_area: Any) -> Any:
    """A density per area as one per solid angle: times d² / |cos|."""
    import drjit as dr

    cosine = dr.abs(dr.dot(ds.d, ds.n))
    return dr.select(cosine > 1e-7, per_area * ds.dist * ds.dist / dr.maximum(cosine, 1e-7), 0.0)


class Triangles:
    """Points of a mesh, uniform over its area, with the normals of its geometry.

    Mitsuba's mesh gives such a point the interpolated normal, whose cosine is not the one that its area is seen under:
    a smooth-shaded torus would light its floor 5 % too brightly.
    """

    def __init__(
        self, positions: NDArray[np.float32], triangles: NDArray[np.uint32], uvs: NDArray[np.float32] | None
    ) -> None:
        import mitsuba as mi

        first, second, third = (positions[triangles[:, k]].astype(np.float64) for k in range(3))
        normals = np.cross(second - first, third - first)
        doubled = np.linalg.norm(normals, axis=1)
        self.total = float(doubled.sum() / 2)
        self.choice = mi.DiscreteDistribution(table(mi.Float, doubled))
        self.corners = [table(mi.Float, corner) for corner in (first, second, third)]
        self.normals = table(mi.Float, normals / np.maximum(doubled, 1e-300)[:, None])
        self.uvs = None if uvs is None else [table(mi.Float, uvs[triangles[:, k]]) for k in range(3)]

    def sample_direction(self, it: Any, sample: Any, active: Any) -> Any:
        import drjit as dr
        import mitsuba as mi

        index, reused = self.choice.sample_reuse(sample.y, active)
        b = mi.warp.square_to_uniform_triangle(mi.Point2f(sample.x, reused))
        weights = (1.0 - b.x - b.y, b.x, b.y)
        corners = [dr.gather(mi.Point3f, corner, index, active) for corner in self.corners]
        point = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
        normal = mi.Normal3f(dr.gather(mi.Vector3f, self.normals, index, active))
        ds = _direction_sample(it, point, normal)
        if self.uvs is not None:
            uvs = [dr.gather(mi.Point2f, corner, index, active) for corner in self.uvs]
            ds.uv = uvs[0] * weights[0] + uvs[1] * weights[1] + uvs[2] * weights[2]
        ds.pdf = _per_solid_angle(ds, 1.0 / self.total)
        return ds

    def pdf_direction(self, it: Any, ds: Any, active: Any) -> Any:
        return _per_solid_angle(ds, 1.0 / self.total)


class NarrowPanel:
    """Points of a flat rectangle or ellipse whose light can reach a receiver within a narrow spread.

    As in Cycles (light/area.h, area_light_spread_clamp_light), points are drawn only from the part of the panel within
    the distance times the tangent of the spread.
    """

    def __init__(self, center: NDArray[np.float64], half_axes: NDArray[np.float64], tangent: float, *, ellipse: bool):
        lengths = np.linalg.norm(half_axes, axis=0)
        axes = half_axes / lengths
        normal = np.cross(axes[:, 0], axes[:, 1])
        self.center, self.across, self.up, self.normal = (_vector(v) for v in (center, *axes.T, normal))
        (self.half_width, self.half_height), (self.tangent,) = _vector(lengths), _vector(np.array([tangent]))
        self.ellipse = ellipse

    def _part(self, it: Any) -> Any:
        """Lower and upper corner of the part of the panel whose light reaches a receiver."""
        import drjit as dr
        import mitsuba as mi

        toward = it.p - mi.Point3f(*self.center)
        place = mi.Point2f(dr.dot(toward, mi.Vector3f(*self.across)), dr.dot(toward, mi.Vector3f(*self.up)))
        reach = dr.maximum(dr.dot(toward, mi.Vector3f(*self.normal)), 0.0) * self.tangent
        half = mi.Vector2f(self.half_width, self.half_height)
        low, high = dr.maximum(place - reach, -half), dr.minimum(place + reach, half)
        return low, high, dr.maximum(high.x - low.x, 0.0) * dr.maximum(high.y - low.y, 0.0)

    def sample_direction(self, it: Any, sample: Any, active: Any) -> Any:
        import drjit as dr
        import mitsuba as mi

        low, high, area = self._part(it)
        place = mi.Point2f(dr.lerp(low.x, high.x, sample.x), dr.lerp(low.y, high.y, sample.y))
        point = mi.Point3f(*self.center) + mi.Vector3f(*self.across) * place.x + mi.Vector3f(*self.up) * place.y
        ds = _direction_sample(it, point, mi.Normal3f(*self.normal))
        inside = area > 0.0
        if self.ellipse:
            inside &= dr.square(place.x / self.half_width) + dr.square(place.y / self.half_height) <= 1.0
        ds.pdf = dr.select(inside, _per_solid_angle(ds, dr.rcp(dr.maximum(area, 1e-30))), 0.0)
        return ds

    def pdf_direction(self, it: Any, ds: Any, active: Any) -> Any:
        import drjit as dr

        area = self._part(it)[2]
        return dr.select(area > 0.0, _per_solid_angle(ds, dr.rcp(dr.maximum(area, 1e-30))), 0.0)
