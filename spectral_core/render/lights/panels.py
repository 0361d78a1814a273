# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat lamps and suns as tables."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.render.lights.balls import Drawn, Falloffs
from spectral_core.render.lights.listing import Panel, Sun
from spectral_core.render.plugins.numbers import table


class Panels:
    """Rectangles and ellipses that emit radiance from their front, or within a spread.

    For a lamp with a spread, points are drawn only from the part that can illuminate the receiver, as in Cycles
    (light/area.h, area_light_spread_clamp_light).
    """

    def __init__(self, mitsuba: Any, panels: list[Panel]) -> None:
        mi = self._mi = mitsuba
        self.centers = table(mi.Float, [[*p.center, 1.0 if p.ellipse else 0.0] for p in panels])
        self.across, self.up = (table(mi.Float, [[*p.half_axes[:, k], 0.0] for p in panels]) for k in range(2))
        duals = [np.linalg.pinv(p.half_axes) for p in panels]
        self.duals = [table(mi.Float, [[*dual[k], np.linalg.norm(dual[k])] for dual in duals]) for k in range(2)]
        self.normals = table(mi.Float, [[*p.normal, p.area] for p in panels])
        self.falloffs = Falloffs(mi, [p.falloff for p in panels])
        self.have_spread = any(p.spread[0] > 0 for p in panels)
        self.have_ellipses = any(p.ellipse for p in panels)
        self.spreads = table(mi.Float, [p.spread for p in panels])

    def _row(self, rows: Any, slot: Any, active: Any) -> tuple[Any, Any]:
        import drjit as dr

        row = dr.gather(self._mi.Vector4f, rows, slot, active)
        return self._mi.Vector3f(row.x, row.y, row.z), row.w

    def draw(self, slot: Any, place: Any, uv: Any, active: Any) -> Drawn:
        """A point of the lamp, uniformly over the part that can illuminate the receiver."""
        import drjit as dr

        mi = self._mi
        center, is_ellipse = self._row(self.centers, slot, active)
        normal, _ = self._row(self.normals, slot, active)
        across, up = self._row(self.across, slot, active)[0], self._row(self.up, slot, active)[0]
        low, high, per_area, narrowed = self._part(slot, place, active)
        at = mi.Point2f(dr.lerp(low.x, high.x, uv.x), dr.lerp(low.y, high.y, uv.y))
        usable = mi.Bool(active)
        if self.have_ellipses:
            disk = mi.warp.square_to_uniform_disk_concentric(uv)
            at = dr.select((is_ellipse > 0.0) & ~narrowed, disk, at)
            usable &= (is_ellipse <= 0.0) | (dr.squared_norm(at) <= 1.0)
        point = mi.Point3f(center) + across * at.x + up * at.y
        away = point - place
        squared = dr.squared_norm(away)
        distance = dr.sqrt(squared)
        direction = away * dr.rcp(dr.maximum(distance, 1e-30))
        cosine = -dr.dot(direction, normal)
        pdf = per_area * squared / dr.maximum(cosine, 1e-7)
        amount = self.profile(slot, direction, active) * self.falloffs(slot, distance, active)
        lit = usable & (cosine > 1e-7) & (per_area > 0.0) & (squared > 0.0)
        factor = dr.select(lit, amount / dr.maximum(pdf, 1e-30), 0.0)
        return Drawn(direction, distance, factor, dr.select(lit, pdf, 0.0), mi.Bool(False), mi.Normal3f(normal), at)

    def _part(self, slot: Any, place: Any, active: Any) -> tuple[Any, Any, Any, Any]:
        """Corners of the part of the lamp, in units of its half axes, its density per area, and True if it is smaller
        than the lamp.
        """
        import drjit as dr

        mi = self._mi
        normal, area = self._row(self.normals, slot, active)
        whole = mi.Point2f(-1.0, -1.0), mi.Point2f(1.0, 1.0), dr.rcp(dr.maximum(area, 1e-30)), mi.Bool(False)
        if not self.have_spread:
            return whole
        center, is_ellipse = self._row(self.centers, slot, active)
        tangent = dr.gather(mi.Vector2f, self.spreads, slot, active).x
        toward = place - mi.Point3f(center)
        reach = dr.maximum(dr.dot(toward, normal), 0.0) * tangent
        (dual_x, per_x), (dual_y, per_y) = (self._row(rows, slot, active) for rows in self.duals)
        at = mi.Point2f(dr.dot(toward, dual_x), dr.dot(toward, dual_y))
        half = mi.Vector2f(reach * per_x, reach * per_y)
        low = dr.clip(at - half, -1.0, 1.0)
        high = dr.clip(at + half, -1.0, 1.0)
        share = (high.x - low.x) * (high.y - low.y) * 0.25
        narrowed = (tangent > 0.0) & (share < 1.0)
        # points of an ellipse are then drawn from its rectangle; those in the corners have no effect
        rectangle = dr.select(is_ellipse > 0.0, area * (4.0 / dr.pi), area)
        per_area = dr.select(share > 0.0, dr.rcp(dr.maximum(share * rectangle, 1e-30)), 0.0)
        return (
            dr.select(narrowed, low, whole[0]),
            dr.select(narrowed, high, whole[1]),
            dr.select(narrowed, per_area, whole[2]),
            narrowed,
        )

    def profile(self, slot: Any, direction: Any, active: Any) -> Any:
        """Relative radiance against a direction toward the lamp: a tent in the tangent to its normal, as in Cycles."""
        import drjit as dr

        normal, _ = self._row(self.normals, slot, active)
        cosine = -dr.dot(direction, normal)
        front = dr.select(cosine > 0.0, self._mi.Float(1.0), 0.0)
        if not self.have_spread:
            return front
        spread = dr.gather(self._mi.Vector2f, self.spreads, slot, active)
        tangent = dr.norm(dr.cross(direction, normal)) / dr.maximum(cosine, 1e-6)  # 1 - cos² is 0 in narrow beams
        tent = dr.maximum(0.0, 1.0 - tangent / dr.maximum(spread.x, 1e-6)) * spread.y
        return dr.select(spread.x > 0.0, front * tent, front)

    def pdf(self, slot: Any, place: Any, direction: Any, distance: Any, active: Any) -> Any:
        """Density per solid angle of ``draw`` at a point that is met."""
        import drjit as dr

        normal, _ = self._row(self.normals, slot, active)
        cosine = -dr.dot(direction, normal)
        per_area = self._part(slot, place, active)[2]
        lit = (cosine > 1e-7) & (self.profile(slot, direction, active) > 0.0)
        return dr.select(lit, per_area * distance * distance / dr.maximum(cosine, 1e-7), 0.0)

    def meet(self, slot: Any, ray: tuple[Any, Any, Any], active: Any) -> Any:
        """Distance along a ray (origin, direction, length) to a lamp's front; infinite if the ray misses it."""
        import drjit as dr

        mi = self._mi
        origin, direction, length = ray
        center, is_ellipse = self._row(self.centers, slot, active)
        normal, _ = self._row(self.normals, slot, active)
        cosine = -dr.dot(direction, normal)
        away = origin - mi.Point3f(center)
        distance = dr.dot(away, normal) / dr.maximum(cosine, 1e-12)
        point = away + direction * distance
        x, y = (dr.dot(point, self._row(rows, slot, active)[0]) for rows in self.duals)
        within = (dr.abs(x) <= 1.0) & (dr.abs(y) <= 1.0) & ((is_ellipse <= 0.0) | (x * x + y * y <= 1.0))
        meets = active & (cosine > 1e-7) & within & (distance > 0.0) & (distance < length)
        return dr.select(meets, distance, dr.inf)

    def normal(self, slot: Any, _point: Any, _direction: Any, active: Any) -> Any:
        """Normal of a lamp's front."""
        return self._mi.Normal3f(self._row(self.normals, slot, active)[0])

    def radiance(self, slot: Any, direction: Any, distance: Any, active: Any) -> Any:
        """Share of the radiance of a lamp that is emitted back along a ray's direction."""
        return self.profile(slot, direction, active) * self.falloffs(slot, distance, active)


class Suns:
    """Disks at infinity that emit radiance; a disk of size 0 emits irradiance."""

    def __init__(self, mitsuba: Any, suns: list[Sun]) -> None:
        mi = self._mi = mitsuba
        self.count = len(suns)
        below_one = [2 * np.sin(sun.half_angle / 2) ** 2 for sun in suns]
        self.rows = table(mi.Float, [[*sun.direction, below] for sun, below in zip(suns, below_one, strict=True)])
        self.have_size = any(below > 0 for below in below_one)

    def _row(self, slot: Any, active: Any) -> tuple[Any, Any]:
        import drjit as dr

        row = dr.gather(self._mi.Vector4f, self.rows, slot, active)
        return self._mi.Vector3f(row.x, row.y, row.z), row.w

    def draw(self, slot: Any, place: Any, uv: Any, active: Any) -> Drawn:
        """A direction of the disk, uniformly per solid angle."""
        import drjit as dr

        mi = self._mi
        axis, below_one = self._row(slot, active)
        along = 1.0 - uv.x * below_one
        across = dr.sqrt(dr.clip(uv.x * below_one * (2.0 - uv.x * below_one), 0.0, 1.0))
        turn_sine, turn_cosine = dr.sincos(2.0 * dr.pi * uv.y)
        local = mi.Vector3f(across * turn_cosine, across * turn_sine, along)
        is_point = below_one <= 0.0
        direction = dr.select(is_point, axis, mi.Frame3f(axis).to_world(local))
        solid = 2.0 * dr.pi * below_one
        factor = dr.select(is_point, 1.0, solid)
        pdf = dr.select(is_point, 1.0, dr.rcp(dr.maximum(solid, 1e-30)))
        zero = mi.Point2f(0.0, 0.0)
        return Drawn(direction, mi.Float(dr.inf), factor, pdf, is_point, mi.Normal3f(-direction), zero)

    def meets(self, slot: Any, direction: Any, active: Any) -> tuple[Any, Any]:
        """True if a direction hits a sun's disk, and the density of ``draw`` there."""
        import drjit as dr

        axis, below_one = self._row(slot, active)
        # 1 - cos from the difference of the two unit vectors, which stays accurate at small angles
        away = 0.5 * dr.squared_norm(direction - axis)
        met = active & (below_one > 0.0) & (away <= below_one)
        return met, dr.select(met, dr.rcp(2.0 * dr.pi * dr.maximum(below_one, 1e-30)), 0.0)
