# SPDX-License-Identifier: GPL-3.0-or-later
"""Point lights, balls and spots as tables: drawn directions, their densities, and the light from them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from spectral_core.render.lights.listing import Ball
from spectral_core.render.plugins.lamps.ball_points import (
    ball_density,
    disk_density,
    draw_in_ball,
    draw_on_disk,
    meet_ball,
    meet_disk,
)
from spectral_core.render.plugins.lamps.shaping import degrees_of
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
        self.falloffs = Falloffs(mi, [ball.falloff for ball in balls])
        round_ones = [ball for ball in balls if ball.radius > 0]
        self.have_size = bool(round_ones)
        self.have_disks = any(ball.faces_receiver for ball in round_ones)
        self.have_balls = any(not ball.faces_receiver for ball in round_ones)
        self.faces = table(mi.UInt32, [int(ball.faces_receiver) for ball in balls])
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
                degrees = degrees_of(ball.beam.photometry)
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
        """A direction to a point of a lamp with a radius; exactly the direction of a point."""
        import drjit as dr

        mi = self._mi
        center, radius = self.place(slot, active)
        away = center - place
        squared = dr.squared_norm(away)
        distance = dr.sqrt(squared)
        axis = away * dr.rcp(dr.maximum(distance, 1e-30))
        zero, flat = mi.Float(0.0), mi.Point2f(0.0, 0.0)
        if not self.have_size:
            factor = self.strength(slot, (place, axis, distance), active) / dr.maximum(squared, 1e-30)
            return Drawn(axis, distance, factor, mi.Float(1.0), mi.Bool(True), mi.Normal3f(-axis), flat)
        is_point = radius <= 0.0
        direction, length, pdf, normal = axis, distance, zero + 1.0, mi.Normal3f(-axis)
        faces = self._faces(slot, active)
        if self.have_disks:
            found = draw_on_disk(place, center, radius, uv)
            flat_one = faces & ~is_point
            direction, length, pdf = (
                dr.select(flat_one, new, old) for new, old in zip(found, (direction, length, pdf), strict=True)
            )
            normal = mi.Normal3f(-direction)
        if self.have_balls:
            found = draw_in_ball(place, center, radius, uv)
            ball = ~faces & ~is_point
            direction, length, pdf = (
                dr.select(ball, new, old) for new, old in zip(found, (direction, length, pdf), strict=True)
            )
            outward = mi.Normal3f(place + direction * length - center) * dr.rcp(dr.maximum(radius, 1e-30))
            normal = dr.select(ball, outward, normal)
        # intensity / (π r²) is radiance
        per = dr.rcp(dr.maximum(dr.select(is_point, squared, dr.pi * radius * radius * pdf), 1e-30))
        factor = per * self.strength(slot, (place, direction, length), active)
        return Drawn(direction, length, factor, dr.select(is_point, 1.0, pdf), is_point, normal, flat)

    def _faces(self, slot: Any, active: Any) -> Any:
        """True for lamps whose disk faces the receiver."""
        import drjit as dr

        return dr.gather(self._mi.UInt32, self.faces, slot, active) != 0

    def pdf(self, slot: Any, place: Any, direction: Any, active: Any) -> Any:
        """Density per solid angle of ``draw`` in a direction that meets the lamp."""
        import drjit as dr

        center, radius = self.place(slot, active)
        if not self.have_balls:
            return disk_density(place, center, radius, direction)
        density = ball_density(place, center, radius)
        if not self.have_disks:
            return density
        return dr.select(self._faces(slot, active), disk_density(place, center, radius, direction), density)

    def meet(self, slot: Any, ray: tuple[Any, Any, Any], place: Any, active: Any) -> Any:
        """Distance along a ray (origin, direction, length) from a receiver at ``place`` to a lamp; infinite if the
        ray misses it.
        """
        import drjit as dr

        origin, direction, length = ray
        center, radius = self.place(slot, active)
        distance = self._mi.Float(dr.inf)
        if self.have_balls:
            distance = meet_ball((origin, direction), center, radius)
        if self.have_disks:
            flat = meet_disk((origin, direction), place, center, radius)
            distance = dr.select(self._faces(slot, active), flat, distance) if self.have_balls else flat
        meets = active & (radius > 0.0) & (distance > 0.0) & (distance < length)
        return dr.select(meets, distance, dr.inf)

    def normal(self, slot: Any, point: Any, direction: Any, active: Any) -> Any:
        """Normal of a lamp at a point of it that a ray hits along ``direction``."""
        import drjit as dr

        facing = self._mi.Normal3f(-direction)
        if not self.have_balls:
            return facing
        center, radius = self.place(slot, active)
        outward = self._mi.Normal3f(point - center) * dr.rcp(dr.maximum(radius, 1e-30))
        return dr.select(self._faces(slot, active), facing, outward)

    def radiance(self, slot: Any, place: Any, direction: Any, distance: Any, active: Any) -> Any:
        """Radiance per intensity from a lamp that is hit to a receiver."""
        import drjit as dr

        _, radius = self.place(slot, active)
        size = dr.pi * dr.maximum(radius * radius, 1e-30)
        return self.strength(slot, (place, direction, distance), active) / size

    def strength(self, slot: Any, ray: tuple[Any, Any, Any], active: Any) -> Any:
        """Beam, luminaire and falloff with distance, along a ray from the receiver."""
        import drjit as dr

        mi = self._mi
        place, direction, distance = ray
        amount = self.falloffs(slot, distance, active)
        if self.are_even:
            return amount
        local = self._local(self.beams, slot, -direction, active)
        edge = dr.gather(mi.Vector2f, self.edges, slot, active)
        step = dr.clip((local.z - edge.x) / edge.y, 0.0, 1.0)
        shares = step * step * (3.0 - 2.0 * step)
        if self.have_balls:
            # for receivers within the ball the cone has no edge, as in Cycles, whose rays miss the half of the ball
            # that is turned away from them; sampling lights finds that half, and its share is a half on matte surfaces
            center, radius = self.place(slot, active)
            away = place - center
            within = (dr.squared_norm(away) <= radius * radius) & ~self._faces(slot, active)
            shares = dr.select(within, dr.select(dr.dot(direction, away) >= 0.0, 0.5, 1.0), shares)
        amount *= dr.select(edge.x < -1.0, 1.0, shares)
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
