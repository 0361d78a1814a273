# SPDX-License-Identifier: GPL-3.0-or-later
"""The view of a camera: its pixels per unit, and points that span the parts of boxes in view."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.lens.camera_rays import is_singular
from spectral_core.scene import Camera, Film

Array = NDArray[np.float64]

PANORAMA_DENSITY = 8.0
"""Pixels of a panorama per pixel of an even picture of one radian: its projection is denser in places."""
MARGIN = 1.1
"""Size of the view relative to the frame: the lens and the pixel filter reach beyond its border."""
JUST_BEYOND = 1 + 1e-6
"""Factor on the near clip distance, so that a point on the near plane counts as one in front of it."""
_EDGES = ((0, 2), (0, 4), (0, 1), (2, 6), (4, 6), (1, 3), (1, 5), (2, 3), (4, 5), (3, 7), (5, 7), (6, 7))
"""Pairs of corners, in the order of ``placed_boxes``."""


def pixels_per_unit(camera: Camera, film: Film) -> float:
    """Pixels per unit at distance 1 (perspective, panoramic), or per unit at any distance (orthographic).

    Of pixels that are not square it is the number along their shorter side.
    """
    if camera.panorama is not None:
        sides = film.width, film.height, film.height * film.pixel_aspect
        return PANORAMA_DENSITY * max(sides) / camera.panorama.least_side_rad
    return film.width / camera.window(film)[0] * max(1.0, 1 / film.pixel_aspect)


def points_in_view(camera: Camera, film: Film, boxes: Sequence[Array]) -> Array:
    """(n, 3) points of boxes, corners (8, 3) or none, in the world.

    A floor on which the camera stands has all corners far away or behind, and what the camera sees of it is near: of a
    box that reaches past the near plane these are the corners of the part in view. Of others they are all corners.
    """
    full = np.array([box for box in boxes if len(box)]).reshape(-1, 8, 3)
    if camera.kind == "panoramic":
        return np.concatenate([full.reshape(-1, 3), _nearest(camera, full)])
    view = camera.world_from_camera
    if is_singular(camera):
        return full.reshape(-1, 3)  # such a camera is refused where its rays are made
    axes = view[:3, :3] / np.linalg.norm(view[:3, :3], axis=0)
    local = (full - view[:3, 3]) @ np.linalg.inv(axes).T * (1, 1, -1)  # right, up, depth
    depths = local[..., 2]
    crossing = (depths.min(axis=1, initial=np.inf) <= camera.near) & (depths.max(axis=1, initial=0.0) > camera.near)
    parts = [full[~crossing].reshape(-1, 3)]
    if np.any(crossing):
        found = _visible(camera, film, local[crossing])
        parts.append((found * (1, 1, -1)) @ axes.T + view[:3, 3])
    return np.concatenate(parts)


def may_be_in_view(camera: Camera, film: Film, box: Array) -> bool:
    """False if a box, corners (8, 3) or none, lies beyond one side of the view as a whole."""
    if not len(box) or camera.kind == "panoramic" or is_singular(camera):
        return len(box) > 0
    view = camera.world_from_camera
    axes = view[:3, :3] / np.linalg.norm(view[:3, :3], axis=0)
    local = (box - view[:3, 3]) @ np.linalg.inv(axes).T * (1, 1, -1)
    walls = _walls(camera, film)
    return bool(np.all(np.any(local @ walls[:, :3].T + walls[:, 3] >= 0, axis=0)))


def _nearest(camera: Camera, boxes: Array) -> Array:
    """The point of each box that is nearest to the camera, or one at the near distance if the camera is inside."""
    eye = camera.world_from_camera[:3, 3]
    found = np.clip(eye, boxes.min(axis=1), boxes.max(axis=1))
    inside = np.linalg.norm(found - eye, axis=1) <= camera.near
    found[inside] = eye + np.array([camera.near * JUST_BEYOND, 0.0, 0.0])
    return np.asarray(found)


def _visible(camera: Camera, film: Film, boxes: Array) -> Array:
    """Corners (n, 3) of the parts of boxes in view: right, up and depth."""
    width, height, right, up, perspective = camera.window(film)
    center, half = np.array([right * width, up * height]), MARGIN * np.array([width, height]) / 2
    near, far = camera.near * JUST_BEYOND, float(boxes[..., 2].max())
    walls = _walls(camera, film)
    edges = boxes[:, np.array(_EDGES)]  # (k, 12, 2, 3)
    of_boxes = _clipped(edges, edges @ walls[:, :3].T + walls[:, 3])
    signs = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    ends = [np.concatenate([(center + half * signs) * (depth if perspective else 1.0), np.full((4, 1), depth)], axis=1)
            for depth in (near, far)]  # fmt: skip
    frame = np.concatenate([np.stack(ends, axis=1), np.stack([ends[0], np.roll(ends[0], 1, axis=0)], axis=1)])
    of_frame = [_clipped(frame, _inside(box, frame)) for box in boxes]
    return np.concatenate([of_boxes, *of_frame])


def _walls(camera: Camera, film: Film) -> Array:
    """(5, 4): the near plane and the sides of the view, distances inward: a·right + b·up + c·depth + d."""
    width, height, right, up, perspective = camera.window(film)
    center, half = np.array([right * width, up * height]), MARGIN * np.array([width, height]) / 2
    planes = [(0.0, 0.0, 1.0, -camera.near * JUST_BEYOND)]  # a, b, c, d of a·right + b·up + c·depth + d ≥ 0
    for axis in (0, 1):
        for sign in (1.0, -1.0):
            bound = half[axis] + sign * center[axis]
            flat = [-sign * (axis == 0), -sign * (axis == 1)]
            planes.append((*flat, bound, 0.0) if perspective else (*flat, 0.0, bound))
    return np.array(planes)


def _inside(box: Array, points: Array) -> Array:
    """Distances (..., 6) of points from the faces of a box, inward, relative to its size."""
    edges = [box[corner] - box[0] for corner in (2, 4, 1)]
    size = max(float(np.linalg.norm(edge)) for edge in edges) or 1.0
    distances = []
    for own, second, third in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        across = np.cross(edges[second], edges[third])
        if np.linalg.norm(across) <= 1e-9 * size**2:  # a flat box: the third edge is that of a thin one
            thick = next((edges[k] for k in (second, third) if np.linalg.norm(edges[k]) > 1e-9 * size), None)
            across = edges[own] if thick is None else edges[own] - thick * (edges[own] @ thick) / (thick @ thick)
        across = across / max(float(np.linalg.norm(across)), 1e-300)
        low, high = sorted((across @ box[0], across @ (box[0] + edges[own])))
        at = points @ across
        distances += [(at - low) / size + 1e-9, (high - at) / size + 1e-9]
    return np.stack(distances, axis=-1)


def _clipped(segments: Array, signed: Array) -> Array:
    """Ends (n, 3) of the parts of segments (..., 2, 3) where all distances (..., 2, m) are at least 0."""
    first, last = signed[..., 0, :], signed[..., 1, :]
    with np.errstate(divide="ignore", invalid="ignore"):
        crossed = first / (first - last)
    begin = np.where(first < 0, np.where(last < 0, np.inf, crossed), 0.0).max(axis=-1)
    end = np.where(last < 0, np.where(first < 0, -np.inf, crossed), 1.0).min(axis=-1)
    kept = begin <= end
    start, step = segments[..., 0, :][kept], (segments[..., 1, :] - segments[..., 0, :])[kept]
    return np.concatenate([start + step * begin[kept][:, None], start + step * end[kept][:, None]])
