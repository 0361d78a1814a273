# SPDX-License-Identifier: GPL-3.0-or-later
"""Where media are: those at the camera, and objects whose media overlap."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.lens.camera_rays import camera_frame, rays
from spectral_core.render.trace.media.table import HIDDEN, ONLY_BORDER
from spectral_core.scene import Camera, Film, Instance, Rays, Scene
from spectral_core.scene.geometry import box_of, placed

Array = NDArray[np.float64]

MOST_SURFACES = 256
_MOST_COMPARED = 2000
"""Most objects whose boxes are compared with each other; of more it is assumed that some overlap."""


def media_at(mitsuba: Any, scene: Any, filled: list[tuple[Any, int]], point: Array, around: int) -> tuple[int, int]:
    """Numbers of the two innermost media at ``point`` (3,) that rays of the camera see: those whose borders a ray from
    there leaves and did not enter.

    ``filled``: shapes with media, as in ``RayRules.inside``; ``around``: the medium of the world.
    """
    import drjit as dr

    filled = [(shape, bits) for shape, bits in filled if not bits >> HIDDEN & Rays.CAMERA]
    boxes = [shape.bbox() for shape, _ in filled]
    if not any(np.all(point >= np.array(box.min)) and np.all(point <= np.array(box.max)) for box in boxes):
        return around, around
    numbers_of = lambda shape: dr.reinterpret_array(mitsuba.UInt32, mitsuba.ShapePtr(shape))  # noqa: E731
    inside = {int(numbers_of(shape)[0]): bits & ~ONLY_BORDER for shape, bits in filled}
    # read from memory, so that another point needs no new kernel
    position = mitsuba.Point3f(*(dr.opaque(mitsuba.Float, float(value)) for value in point))
    direction = dr.normalize(mitsuba.Vector3f(0.3, 0.9, -0.33))  # any direction, but along no edge of a box
    ray = mitsuba.Ray3f(position, direction)
    entered: list[int] = []
    found: list[int] = []
    for _ in range(MOST_SURFACES):
        hit = scene.ray_intersect(ray)
        is_hit, shape = hit.is_valid(), numbers_of(hit.shape)
        enters, ray = dr.dot(hit.n, direction) < 0, hit.spawn_ray(direction)
        # one kernel for all surfaces: otherwise each would trace the ray from its origin again, by a kernel of its own
        dr.eval(is_hit, shape, enters, ray)
        if not np.any(is_hit):
            break
        number = int(np.array(shape)[0])
        if number in inside:
            if np.all(enters):
                entered.append(number)
            elif number in entered:
                entered.remove(number)
            else:
                found.append(inside[number])
    inner, outer, *_ = (*found, around, around)
    return inner, outer


def ray_starts(camera: Camera, film: Film) -> tuple[Array, Array, Array]:
    """Where the ray through the middle of the picture begins (3,), and the lowest and highest corners of a box around
    the starts of all rays. Of a panorama, whose rays begin on a sphere, the middle of that.
    """
    frame = camera_frame(camera, film)
    if camera.panorama is not None:
        away = camera.near + camera.aperture_radius
        return frame.origin, frame.origin - away, frame.origin + away
    places = np.array([[0.5, 0, 1, 0, 1], [0.5, 0, 0, 1, 1]])
    stacked = lambda *parts: np.stack(np.broadcast_arrays(*parts))  # noqa: E731
    begins, _, _ = rays(frame, (places[0], places[1]), (np.zeros(5), np.zeros(5)), stacked)
    away = camera.aperture_radius
    return begins[:, 0], begins.min(axis=1) - away, begins.max(axis=1) + away


def meets_some(filled: list[tuple[Any, int]], low: Array, high: Array) -> bool:
    """True if the box of a shape with a medium that the camera sees meets the box from ``low`` to ``high``; ``filled``:
    as in ``media_at``.
    """
    boxes = [shape.bbox() for shape, bits in filled if not bits >> HIDDEN & Rays.CAMERA]
    return any(np.all(low <= np.array(box.max)) and np.all(high >= np.array(box.min)) for box in boxes)


def overlapping_media(scene: Scene) -> tuple[bool, tuple[str, ...]]:
    """True if the boxes of some objects with media overlap, and the names of objects where more than two do."""
    filled = {material.name for material in scene.materials if material.medium is not None}
    shown = {mesh.name for mesh in scene.meshes if len(mesh.positions)}
    items = [item for item in scene.instances if item.mesh in shown and filled.intersection(item.materials)]
    if len(items) < 2:
        return False, ()
    if len(items) > _MOST_COMPARED:
        return True, ()
    low, high = _boxes(scene, items)
    # boxes that only touch, as of cells side by side, do not overlap
    slack = 1e-4 * np.minimum((high - low)[:, None], (high - low)[None])
    meet = np.all((low[:, None] + slack < high[None]) & (low[None] + slack < high[:, None]), axis=2)
    np.fill_diagonal(meet, False)
    some = np.flatnonzero(meet.any(axis=1))
    # boxes of which each two have common points have one common to all
    pairs = meet[np.ix_(some, some)].astype(np.float32)
    crowded = np.any((pairs @ pairs) * pairs > 0, axis=1) if len(some) else np.zeros(0, bool)
    return bool(len(some)), tuple(items[k].shown_as or items[k].name for k in some[crowded])


def _boxes(scene: Scene, items: list[Instance]) -> tuple[Array, Array]:
    """Lowest and highest corners (n, 3) of objects in the world."""
    boxes = {mesh.name: box_of(mesh) for mesh in scene.meshes}
    corners = np.array([placed(boxes[item.mesh], item.world_from_object) for item in items])
    return corners.min(axis=1), corners.max(axis=1)
