# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes of objects that are in one place: common faces, and phase functions that add up."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Color, Instance, Mesh, ScatteringMedium, Scene
from spectral_core.scene.geometry import placed_boxes

from .coincident import MOST_TRIANGLES, edges, has_twice, planes_of, triangles_of

Array = NDArray[np.float64]

MOST_VOLUMES = 200
"""Objects with volumes that are compared with each other."""
SAME_COLOR = 0.02
"""Largest difference of two scattering colors that count as one, relative to their largest channels."""


def volumes_in_one_place(scene: Scene, meshes: dict[str, Mesh]) -> Iterator[tuple[Instance, Instance, bool, bool]]:
    """Pairs of objects with volumes whose boxes overlap.

    With each: True if faces of both, without a surface, coincide and have one direction; and True if the phase
    functions and the scattering colors of their media differ.
    """
    materials = {material.name: material for material in scene.materials if material.medium is not None}
    placed = zip(scene.instances, placed_boxes(scene.meshes, scene.instances), strict=True)
    boxes = {item.name: box for item, box in placed}
    items = [item for item in scene.instances if materials.keys() & set(item.materials) and len(boxes[item.name])]
    for one, other in combinations(items[:MOST_VOLUMES], 2):
        low = np.maximum(boxes[one.name].min(axis=0), boxes[other.name].min(axis=0))
        high = np.minimum(boxes[one.name].max(axis=0), boxes[other.name].max(axis=0))
        if not np.all(low < high):
            continue
        pair = [next(materials[name] for name in item.materials if name in materials) for item in (one, other)]
        is_border = all(material.surface is None for material in pair)
        media = [material.medium for material in pair if material.medium is not None]
        yield one, other, is_border and _has_common_faces(one, other, meshes), _differ(media[0], media[1])


def _has_common_faces(one: Instance, other: Instance, meshes: dict[str, Mesh]) -> bool:
    """True if faces of both objects coincide and have one direction, as those of two equal boxes at one place."""
    if max(len(meshes[item.mesh].triangles) for item in (one, other)) > MOST_TRIANGLES:
        return False
    first, second = (triangles_of(meshes[item.mesh], item) for item in (one, other))
    if len(first) == len(second):
        points = np.concatenate([first, second]).reshape(-1, 3)
        if has_twice(points, np.arange(len(points)).reshape(-1, 3)):
            return True
    crosses = np.cross(*edges(second))
    for plane in planes_of(first):
        there = second[plane.has(second) & (crosses @ plane.normal > 0.0)]
        # faces that touch at an edge have boxes that share less than this
        if np.any((plane.shared(there) > 10.0 * plane.step).sum(axis=2) >= 2):
            return True
    return False


def _differ(one: ScatteringMedium, other: ScatteringMedium) -> bool:
    """True if two media have other phase functions and other scattering colors, and both scatter."""
    lobes = [medium.lobes or ((1.0, medium.anisotropy, 0.0),) for medium in (one, other)]
    colors = [_scattered(medium) for medium in (one, other)]
    if lobes[0] == lobes[1] or any(color is not None and color.max() <= 0 for color in colors):
        return False
    if colors[0] is None or colors[1] is None:
        return True
    return bool(np.abs(colors[0] / colors[0].max() - colors[1] / colors[1].max()).max() > SAME_COLOR)


def _scattered(medium: ScatteringMedium) -> Array | None:
    """Scattering coefficients as linear RGB; None if they are a spectrum or their color varies."""
    parts = [medium.color, *([] if medium.extinction is None else [medium.extinction])]
    varies = medium.grid is not None and medium.grid.scattering is not None and medium.grid.scattering.ndim == 4
    if varies or not all(isinstance(part, Color) for part in parts):
        return None
    made = np.full(3, float(medium.density))
    for part in parts:
        assert isinstance(part, Color)
        made = made * np.asarray(part.linear_rgb)
    return made
