# SPDX-License-Identifier: GPL-3.0-or-later
"""Point lights, balls and spots as tables: drawn directions, their densities, and the light from them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from spectral_core.render.lights.listing import Ball
from spectral_core.render.plugins.lamps.shaping import every_degree
from spectral_core.render.plugins.numbers import table

DEGREES = 181


@dataclass
class Drawn:
    """A direction from a receiver to an item. ``factor``: multiplier of the emitted light, already divided by the
    density ``pdf`` per solid angle; ``delta``: True if no other method could have drawn it. ``uv`` is known for
    triangles only.
    """

    direction: Any
    distance: Any
    factor: Any
    pdf: Any
    delta: Any
    normal: Any
    uv: Any


class Falloffs:
    """Falloff with distance beside the inverse square, by lamp: dᵖ · d² / (s + d²); None if no lamp has one."""

    def __init__(self, mi: Any, falloffs: list[tuple[int, float]]) -> None:
        self._mi = mi
        self.are_plain = all(power == 0 and smooth == 0 for power, smooth in falloffs)
        if not self.are_plain:
            self._powers = table(mi.UInt32, [power for power, _ in falloffs])
            self._smooth = table(mi.Float, [smooth for _, smooth in falloffs])

    def __call__(self, slot: Any, distance: Any, active: Any) -> Any:
        import drjit as dr

        mi = self._mi
        if self.are_plain:
            return mi.Float(1.0)
        power = dr.gather(mi.UInt32, self._powers, slot, active)
        smooth = dr.gather(mi.Float, self._smooth, slot, active)
        squared = distance * distance
        amount = dr.select(power == 0, 1.0, dr.select(power == 1, distance, squared))
        return amount * dr.select(smooth > 0.0, squared / (smooth + squared), 1.0)


class Balls:
    """Lamps of every radius. The source emits radiant intensity, so that radius 0 needs no special case."""

    def __init__(self, mitsuba: Any, balls: list[Ball]) -> None:
        mi = self._mi = mitsuba
        self.places = table(mi.Float, [[*ball.center, ball.radius] for ball in balls])
        self.softenings = table(mi.Float, [ball.softening for ball in balls])
        self.falloffs = Falloffs(mi, [ball.falloff for ball in balls])
        self.have_size = any(ball.radius > 0 for ball in balls)
        self.have_points = any(ball.radius <= 0 for ball in balls)
        self.are_even = all(ball.beam.is_even for ball in balls)
        if not self.are_even:
            self._load_beams(balls)

    def _load_beams(self, balls: list[Ball]) -> None:
        mi = self._mi
        self.beams = [table(mi.Float, [ball.beam.axes[k] for ball in balls]) for k in range(3)]
        self.edges = table(mi.Float, [[ball.beam.cosine, ball.beam.softness] for ball in balls])
        measured: dict[int, int] = {}
        rows: list[Any] = [np.ones((361, DEGREES))]
        which = np.zeros(len(balls), np.uint32)
        for number, ball in enumerate(balls):
            if ball.beam.photometry is None:
                continue
            key = id(ball.beam.photometry)
            if key not in measured:
                degrees = every_degree(ball.beam.photometry)
                measured[key] = len(rows)
                rows.append(np.broadcast_to(degrees, (361, DEGREES)) if len(degrees) == 1 else degrees)
            which[number] = measured[key]
        self.has_photometry = bool(measured)
        if self.has_photometry:
            self.photometry_axes = [table(mi.Float, [ball.beam.photometry_axes[k] for ball in balls]) for k in range(3)]
            self.which, self.photometry = table(mi.UInt32, which), table(mi.Float, np.stack(rows))

    def place(self, slot: Any, active: Any) -> tuple[Any, Any]:
        """Center and radius."""
        import drjit as dr

        mi = self._mi
        row = dr.gather(mi.Vector4f, self.places, slot, active)
        return mi.Point3f(row.x, row.y, row.z), row.w

    def draw(self, slot: Any, place: Any, uv: Any, active: Any) -> Drawn:
        """A direction drawn uniformly in the cone that a ball subtends; exactly the direction of a point."""
        import drjit as dr

        mi = self._mi
        center, radius = self.place(slot, active)
        away = center - place
        squared = dr.squared_norm(away)
        distance = dr.sqrt(squared)
        axis = away * dr.rcp(dr.maximum(distance, 1e-30))
        if not self.have_size:
            factor = self.strength(slot, (place, axis, distance), active) / dr.maximum(squared, 1e-30)
            zero = mi.Float(0.0)
            return Drawn(
                axis, distance, factor, mi.Float(1.0), mi.Bool(True), mi.Normal3f(-axis), mi.Point2f(zero, zero)
            )
        below_one = self.cone(squared, radius)
        along = 1.0 - uv.x * below_one
        # 1 - cos² would cancel for a small cone
        sine_squared = dr.clip(uv.x * below_one * (2.0 - uv.x * below_one), 0.0, 1.0)
        turn_sine, turn_cosine = dr.sincos(2.0 * dr.pi * uv.y)
        across = dr.sqrt(sine_squared)
        local = mi.Vector3f(across * turn_cosine, across * turn_sine, along)
        is_point = radius <= 0.0
        direction = dr.select(is_point, axis, mi.Frame3f(axis).to_world(local))
        near = distance * along - dr.safe_sqrt(radius * radius - squared * sine_squared)
        near = dr.select(is_point, distance, dr.maximum(near, 0.0))
        outside = squared > radius * radius
        # intensity / (π r²) is radiance, times the cone's solid angle 2 π (1 - cos)
        per = dr.select(is_point, dr.rcp(dr.maximum(squared, 1e-30)), 2.0 * below_one / dr.square(radius))
        strength = self.strength(slot, (place, direction, near), active)
        factor = dr.select(outside, per * strength, 0.0)
        pdf = dr.select(is_point, 1.0, dr.rcp(2.0 * dr.pi * dr.maximum(below_one, 1e-30)))
        normal = mi.Normal3f(place + direction * near - center) * dr.rcp(dr.maximum(radius, 1e-30))
        return Drawn(direction, near, factor, pdf, is_point, dr.select(is_point, -axis, normal), mi.Point2f(0.0, 0.0))

    def cone(self, squared: Any, radius: Any) -> Any:
        """1 - cos of the half angle of the cone that a ball subtends, from the square of a distance."""
        import drjit as dr

        sine_squared = dr.minimum(radius * radius / dr.maximum(squared, 1e-30), 1.0)
        return sine_squared / (1.0 + dr.safe_sqrt(1.0 - sine_squared))

    def pdf(self, slot: Any, place: Any, active: Any) -> Any:
        """Density per solid angle of ``draw`` in a direction that meets the ball."""
        import drjit as dr

        center, radius = self.place(slot, active)
        below_one = self.cone(dr.squared_norm(center - place), radius)
        return dr.select(below_one > 0.0, dr.rcp(2.0 * dr.pi * dr.maximum(below_one, 1e-30)), 0.0)

    def meet(self, slot: Any, ray: tuple[Any, Any, Any], active: Any) -> Any:
        """Distance along a ray (origin, direction, length) to a ball's near side; infinite if the ray misses it."""
        import drjit as dr

        origin, direction, length = ray
        center, radius = self.place(slot, active)
        away = center - origin
        along = dr.dot(away, direction)
        # from the foot of the perpendicular: the difference of large squares would cancel
        missed = dr.squared_norm(away - direction * along)
        inside = radius * radius - missed
        distance = along - dr.safe_sqrt(inside)
        meets = active & (inside > 0.0) & (distance > 0.0) & (distance < length)
        return dr.select(meets, distance, dr.inf)

    def radiance(self, slot: Any, place: Any, direction: Any, distance: Any, active: Any) -> Any:
        """Radiance per intensity from a ball that is hit to a receiver."""
        import drjit as dr

        _, radius = self.place(slot, active)
        size = dr.pi * dr.maximum(radius * radius, 1e-30)
        return self.strength(slot, (place, direction, distance), active) / size

    def strength(self, slot: Any, ray: tuple[Any, Any, Any], active: Any) -> Any:
        """Soft falloff, beam, luminaire and falloff with distance, along a ray from the receiver."""
        import drjit as dr

        mi = self._mi
        place, direction, distance = ray
        amount = self.falloffs(slot, distance, active)
        if self.have_size:
            softening = dr.gather(mi.Float, self.softenings, slot, active)
            squared = dr.squared_norm(self.place(slot, active)[0] - place)
            amount *= dr.select(softening > 0.0, squared / (squared + softening * softening), 1.0)
        if self.are_even:
            return amount
        local = self._local(self.beams, slot, -direction, active)
        edge = dr.gather(mi.Vector2f, self.edges, slot, active)
        step = dr.clip((local.z - edge.x) / edge.y, 0.0, 1.0)
        amount *= dr.select(edge.x < -1.0, 1.0, step * step * (3.0 - 2.0 * step))
        return amount * self._measured(slot, -direction, active) if self.has_photometry else amount

    def _local(self, axes: list[Any], slot: Any, direction: Any, active: Any) -> Any:
        import drjit as dr

        mi = self._mi
        rows = [dr.gather(mi.Vector3f, row, slot, active) for row in axes]
        return dr.normalize(mi.Vector3f(*(dr.dot(direction, row) for row in rows)))

    def _measured(self, slot: Any, toward_receiver: Any, active: Any) -> Any:
        """A luminaire's table, linear between whole degrees; the first table is 1 everywhere."""
        import drjit as dr

        mi = self._mi
        local = self._local(self.photometry_axes, slot, toward_receiver, active)
        start = dr.gather(mi.UInt32, self.which, slot, active) * (361 * DEGREES)
        vertical = dr.safe_acos(local.z) * (180.0 / dr.pi)
        # Cycles counts the angle about the light from its -Y; the beam's axes here are turned about X
        horizontal = (dr.atan2(local.x, -local.y) + dr.pi) * (180.0 / dr.pi)
        row, column = dr.minimum(mi.UInt32(horizontal), 359), dr.minimum(mi.UInt32(vertical), DEGREES - 2)

        def along(of: Any) -> Any:
            at = start + of * DEGREES + column
            low, high = (dr.gather(mi.Float, self.photometry, at + k, active) for k in range(2))
            return dr.lerp(low, high, vertical - mi.Float(column))

        return dr.lerp(along(row), along(row + 1), horizontal - mi.Float(row))
