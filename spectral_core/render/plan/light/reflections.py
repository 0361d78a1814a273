# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounds on light that surfaces reflect again and again, from a scene's data."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.plan import bounds
from spectral_core.render.plan.decision import MOST_BOUNCES, MOST_ERROR
from spectral_core.render.plan.levels import Level
from spectral_core.render.plan.light.sizes import MOST_REFLECTANCE, largest_share
from spectral_core.render.plan.light.sources import (
    distances_to_boxes,
    lamps_of,
    least_distances,
    radiances,
)
from spectral_core.scene import (
    Color,
    Diffuse,
    Emission,
    Fluorescent,
    Material,
    Mesh,
    Principled,
    Scene,
    Toon,
    Translucent,
    Transparent,
    World,
    largest_sum,
    leaves,
)
from spectral_core.scene.geometry import placed, placed_boxes

Array = NDArray[np.float64]

DIFFUSE_BOUNCES = (MOST_BOUNCES, 768, 512, 384, 256, 192, 128, 96, 80, 64, 56, 48, 40, *range(32, 1, -1))
"""Candidate numbers of bounces of diffuse scenes."""
SLOW_BOUNCES = 32
"""Bounces after which few paths are left: ending those saves no time that counts."""
NO_ERROR = 1e-3
"""ΔE2000 that nobody can measure in a picture: no candidate has more bounces than the first with a smaller error."""
MOST_DIRECT = 1e4
"""Largest radiance of a surface under its lamps, over white: a lamp that touches a surface lights a point of it."""
USUAL_DIRECT = 10.0
"""The same where a plan serves lights of any strength: pictures are exposed for surfaces in direct light."""
MOST_LAMPS, MOST_TRIANGLES = 64, 4096
"""Lamps whose distance from each surface is computed, the strongest; and triangles of a mesh whose own distances are,
of one with more those of its vertices.
"""


def ways_of_light(materials: Iterable[Material]) -> float:
    """Mean number of straight ways of a path from a lamp to the camera, at most: two and, of surfaces that keep a share
    ρ of the light, ρ / (1 - ρ) between surfaces.
    """
    kept = min(max((largest_sum(each.surface, largest_share) for each in materials), default=0.0), MOST_REFLECTANCE)
    return 2.0 + kept / (1.0 - kept)


def is_linear(materials: Iterable[Material]) -> bool:
    """True if light that is reflected once is proportional to the color of a surface: not where it passes a colored
    coat, or where facets or what lies below a surface reflect it several times.
    """
    return all(_is_linear(leaf) for material in materials for leaf in leaves(material.surface))


def _is_linear(leaf: Any) -> bool:
    if isinstance(leaf, Principled):
        inner = (leaf.metallic, leaf.transmission, leaf.subsurface_weight, leaf.diffuse_roughness)
        layers = [leaf.specular_tint]
        layers += [leaf.coat_tint] if leaf.coat_weight != 0 else []
        layers += [leaf.sheen_tint] if leaf.sheen_weight != 0 else []
        return not any(inner) and all(map(_is_gray, layers))
    if isinstance(leaf, Diffuse):
        return leaf.roughness == 0
    return isinstance(leaf, (Emission, Fluorescent, Toon, Translucent, Transparent))


def _is_gray(paint: Any) -> bool:
    return isinstance(paint, Color) and float(np.ptp(paint.linear_rgb)) < 1e-6


def diffuse_levels(direct: float, reflectance: float) -> tuple[Level, ...]:
    """Numbers of bounces of a diffuse scene, each with its error; ``direct``: ``direct_radiance`` of the scene."""
    errors = {count: diffuse_error(direct, reflectance, count) for count in DIFFUSE_BOUNCES}
    most = min(count for count in errors if count == MOST_BOUNCES or errors[count] < NO_ERROR)
    saves = {count: 0.5 * max(0.0, 1 - count / SLOW_BOUNCES) for count in errors}
    return tuple(Level(str(count), errors[count], saves[count]) for count in DIFFUSE_BOUNCES if count <= most)


def diffuse_error(direct: float, reflectance: float, bounces: int) -> float:
    """Upper bound of the ΔE2000 of a diffuse scene after so many bounces: the larger of two.

    Relative to direct light, the light after n bounces is at most ρ^(n+1) / (1 - ρ) if every path stays inside; half of
    that is assumed for an ordinary room, and ΔE 1 for about 2.5 % of luminance (CIELAB at mid gray). Where the camera
    sees no direct light, as behind a corner, that says nothing: no point is brighter than ``direct`` after one
    reflection, nor brighter than ρ times the brightest after each further one.
    """
    kept = min(reflectance, MOST_REFLECTANCE)
    if kept <= 0:
        return 0.0
    later = kept ** (bounces + 1) / (1.0 - kept)
    return max(later / (2 * 0.025), min(bounds.error_of_light(direct * later), MOST_ERROR))


def reflected_radiance(scene: Scene, materials: list[Material], *, lights_vary: bool = False) -> float:
    """Largest radiance of surfaces by light that they reflect once or more often, over white.

    Without that of the world, which is never larger than the world's own.
    """
    sums = ways_of_light(materials) - 1.0  # 1 / (1 - ρ)
    if sums <= 1.0:
        return 0.0
    if lights_vary:
        return sums * USUAL_DIRECT
    solid = {material.name for material in materials if material.surface is not None}
    shown = tuple(item for item in scene.instances if not solid.isdisjoint(item.materials))  # no borders of media
    return sums * direct_radiance(replace(scene, world=World(), instances=shown), materials, 1.0 - 1.0 / sums)


def direct_radiance(scene: Scene, materials: list[Material], reflectance: float) -> float:
    """Largest radiance of a diffuse surface that lamps, emissive surfaces and the world light, over white."""
    around = radiances(replace(scene, lights=()), materials)
    found = sum(np.pi * radiance for radiance, _ in around)
    boxes = placed_boxes(scene.meshes, scene.instances)
    corners = np.concatenate(boxes) if boxes else np.zeros((0, 3))
    meshes = {mesh.name: mesh for mesh in scene.meshes}
    lamps = lamps_of(scene.lights)
    found += lamps.suns
    if len(corners) and len(lamps.centers):
        near = least_distances(lamps.centers, boxes)
        for number in np.argsort(-lamps.intensities, kind="stable")[:MOST_LAMPS]:
            near[number] = _nearest(scene, meshes, boxes, lamps.centers[number])
        reach = np.ones(len(near))
        for number in np.flatnonzero(lamps.powers):  # the others have the same intensity at any distance
            reach[number] = np.linalg.norm(corners - lamps.centers[number], axis=1).max()
        intensities = lamps.at_distance(reach)
        found += float(np.sum(np.minimum(intensities / np.maximum(near, 1e-30) ** 2, np.pi * lamps.radiances)))
    return float(min(reflectance / np.pi * found * scene.film.exposure, MOST_DIRECT))


def _nearest(scene: Scene, meshes: Mapping[str, Mesh], boxes: Sequence[Array], point: Array) -> float:
    """Distance from a point to the nearest surface; the boxes of objects (8, 3) tell which may be near."""
    apart = distances_to_boxes(point[None], boxes)[0]
    found = np.inf
    for number in np.argsort(apart):
        if apart[number] >= found:
            break
        item = scene.instances[number]
        mesh = meshes[item.mesh]
        positions = placed(mesh.positions, item.world_from_object) - point
        if len(mesh.triangles) > MOST_TRIANGLES or not len(mesh.triangles):
            found = min(found, float(np.linalg.norm(positions, axis=1).min()))
        else:
            found = min(found, _nearest_triangle(positions[mesh.triangles.astype(np.int64)]))
    return float(found)


def _nearest_triangle(corners: Array) -> float:
    """Distance of the nearest of triangles (n, 3 corners, 3) from the origin."""
    edges = np.roll(corners, -1, axis=1) - corners
    squared = np.maximum(np.sum(edges**2, axis=2, keepdims=True), 1e-300)
    along = np.clip(-np.sum(corners * edges, axis=2, keepdims=True) / squared, 0.0, 1.0)
    found = float(np.linalg.norm(corners + along * edges, axis=2).min())
    normals = np.cross(edges[:, 0], edges[:, 1])
    outside = np.sum(np.cross(edges, corners) * normals[:, None], axis=2)  # of each edge, by its sign
    over = np.all(outside >= 0, axis=1) | np.all(outside <= 0, axis=1)
    sizes = np.linalg.norm(normals, axis=1)
    heights = np.abs(np.sum(normals * corners[:, 0], axis=1))[over & (sizes > 0)] / sizes[over & (sizes > 0)]
    return min(found, float(heights.min(initial=np.inf)))
