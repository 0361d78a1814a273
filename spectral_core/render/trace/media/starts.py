# SPDX-License-Identifier: GPL-3.0-or-later
"""Media in which camera rays begin: at the near clip or at the plane of an orthographic camera, each ray elsewhere."""

from __future__ import annotations

from typing import Any

from spectral_core.scene import Rays


def at_start(tables: Any, scene: Any, ray: Any, active: Any) -> tuple[Any, Any]:
    """Numbers of the two innermost media where a camera ray begins; ``tables``: ``Tables`` of the ``scene``.

    They are those at the camera, changed by each border on the way from there to the ray's origin. Where no border can
    be, or without ``scene``, they are those at the camera.
    """
    import drjit as dr
    import mitsuba as mi

    media = tables.media
    if media is None:
        return mi.UInt32(0), mi.UInt32(0)
    first = mi.UInt32(media.camera[0]), mi.UInt32(media.camera[1])
    if media.eye is None or scene is None:
        return first
    eye, end = mi.Point3f(media.eye), mi.Point3f(ray.o)
    away = end - eye
    length = dr.norm(away)
    toward = away * dr.rcp(dr.maximum(length, 1e-30))
    way = mi.Ray3f(eye, toward, length, mi.Float(0.0), ray.wavelengths)

    def cross(way: Any, inner: Any, outer: Any, walking: Any) -> tuple[Any, ...]:
        si = tables.intersect(scene, way, walking)
        met = walking & si.is_valid()
        shape = tables.shape_number(si)
        seen = met & ~tables.passes(shape, mi.UInt32(int(Rays.CAMERA)))
        inner, outer = media.crossed((inner, outer), shape, si, (toward, toward), seen)
        rest = si.spawn_ray(toward)
        rest.maxt = dr.dot(end - rest.o, toward)
        return dr.select(met, rest, way), inner, outer, met & (rest.maxt > 0.0)

    start = (way, *first, mi.Bool(active) & (length > 0.0))
    _, inner, outer, _ = dr.while_loop(
        start, lambda *state: state[3], cross, labels=("way", "inner", "outer", "walking")
    )
    return inner, outer
