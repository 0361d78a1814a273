# SPDX-License-Identifier: GPL-3.0-or-later
"""Where media are: those at the camera, and objects whose media overlap."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.trace.media.table import HIDDEN, ONLY_BORDER
from spectral_core.scene import Instance, Rays, Scene
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
