# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of lamps with a radius, drawn and met as in Cycles (kernel/light/point.h): of a ball, or of the disk through
its center that faces the receiver, which Blender's soft falloff puts in its place.

Both illuminate receivers within their radius: the ball shines inward, and the disk faces any place.
"""

from __future__ import annotations

from typing import Any

LEAST_COSINE = 1e-7


def _axis(place: Any, center: Any) -> tuple[Any, Any, Any]:
    """Unit direction from a place to a center, the distance, and its square."""
    import drjit as dr

    away = center - place
    squared = dr.squared_norm(away)
    distance = dr.sqrt(squared)
    return away * dr.rcp(dr.maximum(distance, 1e-30)), distance, squared


def below_one(squared: Any, radius: Any) -> Any:
    """1 - cos of the half angle of the cone that a ball subtends, from the square of a distance."""
    import drjit as dr

    sine_squared = dr.minimum(radius * radius / dr.maximum(squared, 1e-30), 1.0)
    return sine_squared / (1.0 + dr.safe_sqrt(1.0 - sine_squared))


def draw_on_disk(place: Any, center: Any, radius: Any, uv: Any) -> tuple[Any, Any, Any]:
    """Direction, distance and density per solid angle of a point drawn uniformly over the disk."""
    import drjit as dr
    import mitsuba as mi

    axis, distance, _ = _axis(place, center)
    at = mi.warp.square_to_uniform_disk_concentric(uv) * radius
    toward = axis * distance + mi.Frame3f(axis).to_world(mi.Vector3f(at.x, at.y, 0.0))
    squared = dr.squared_norm(toward)
    length = dr.sqrt(squared)
    direction = toward * dr.rcp(dr.maximum(length, 1e-30))
    cosine = dr.maximum(dr.dot(direction, axis), LEAST_COSINE)
    return direction, length, squared / (cosine * dr.pi * dr.maximum(radius * radius, 1e-30))


def disk_density(place: Any, center: Any, radius: Any, direction: Any) -> Any:
    """Density of ``draw_on_disk`` in a direction that meets the disk."""
    import drjit as dr

    axis, _, squared = _axis(place, center)
    cosine = dr.maximum(dr.dot(direction, axis), LEAST_COSINE)
    return squared / (cosine * cosine * cosine * dr.pi * dr.maximum(radius * radius, 1e-30))


def meet_disk(ray: tuple[Any, Any], place: Any, center: Any, radius: Any) -> Any:
    """Distance along a ray (origin, direction) from a receiver at ``place`` to its disk; infinite if it misses."""
    import drjit as dr

    origin, direction = ray
    axis, _, _ = _axis(place, center)
    cosine = dr.dot(direction, axis)
    distance = dr.dot(center - origin, axis) * dr.rcp(dr.maximum(cosine, LEAST_COSINE))
    meets = (cosine > LEAST_COSINE) & (dr.squared_norm(origin + direction * distance - center) < radius * radius)
    return dr.select(meets, distance, dr.inf)


def draw_in_ball(place: Any, center: Any, radius: Any, uv: Any) -> tuple[Any, Any, Any]:
    """Direction, distance and density per solid angle of a direction drawn uniformly in the cone that a ball
    subtends; from within the ball, in all directions.
    """
    import drjit as dr
    import mitsuba as mi

    axis, distance, squared = _axis(place, center)
    inside = squared <= radius * radius
    below = dr.select(inside, 2.0, below_one(squared, radius))
    # 1 - cos² would cancel for a small cone
    along, sine_squared = 1.0 - uv.x * below, dr.clip(uv.x * below * (2.0 - uv.x * below), 0.0, 1.0)
    turn_sine, turn_cosine = dr.sincos(2.0 * dr.pi * uv.y)
    across = dr.sqrt(sine_squared)
    direction = mi.Frame3f(axis).to_world(mi.Vector3f(across * turn_cosine, across * turn_sine, along))
    half_chord = dr.safe_sqrt(radius * radius - squared * sine_squared)
    length = distance * along + dr.select(inside, half_chord, -half_chord)
    return direction, dr.maximum(length, 0.0), dr.rcp(2.0 * dr.pi * dr.maximum(below, 1e-30))


def ball_density(place: Any, center: Any, radius: Any) -> Any:
    """Density of ``draw_in_ball`` in a direction that meets the ball."""
    import drjit as dr

    squared = dr.squared_norm(center - place)
    below = dr.select(squared <= radius * radius, 2.0, below_one(squared, radius))
    return dr.select(below > 0.0, dr.rcp(2.0 * dr.pi * dr.maximum(below, 1e-30)), 0.0)


def meet_ball(ray: tuple[Any, Any], center: Any, radius: Any) -> Any:
    """Distance along a ray (origin, direction) to a ball's near side, from within to its far side; infinite if it
    misses.
    """
    import drjit as dr

    origin, direction = ray
    away = center - origin
    along = dr.dot(away, direction)
    # from the foot of the perpendicular: the difference of large squares would cancel
    rest = radius * radius - dr.squared_norm(away - direction * along)
    half_chord = dr.safe_sqrt(rest)
    inside = dr.squared_norm(away) <= radius * radius
    distance = along + dr.select(inside, half_chord, -half_chord)
    return dr.select((rest > 0.0) & (distance > 0.0), distance, dr.inf)
