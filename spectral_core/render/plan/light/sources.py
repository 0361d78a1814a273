# SPDX-License-Identifier: GPL-3.0-or-later
"""Sources of light: their radiance, and the irradiance that they cause at most, all lamps of a scene at once.

A scene may have thousands of lamps and of objects, so nothing here is computed for each pair of them in turn.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.mitsuba_scene.light import spread_of
from spectral_core.render.mitsuba_scene.radiometry import (
    intensity_of_point,
    radiance_of_ball,
    radiance_of_panel,
    radiance_of_sun,
)
from spectral_core.render.plan.light.sizes import largest_light, largest_size, paint_parts
from spectral_core.scene import AreaLight, Light, Material, PointLight, Scene, SpotLight, SunLight, emissions_of
from spectral_core.scene.geometry import box_of, placed

Array = NDArray[np.float64]

AT_ONCE = 1 << 20
"""Pairs whose distance is computed at once."""


@dataclass(frozen=True, slots=True, eq=False)
class Lamps:
    """All lamps that shine: ``suns`` is the irradiance of all suns together, the rest describes the others, (n, …).

    ``intensities``: the largest ones without the falloff, whose ``powers`` multiply them with the distance beyond 1.
    ``half_sizes``: half of the largest side of an area light, or the radius of a ball. ``radiances``: infinite for a
    lamp without a size, and for one with a pattern.
    """

    suns: float
    centers: Array
    intensities: Array
    powers: Array
    half_sizes: Array
    radiances: Array

    def at_distance(self, distances: Array) -> Array:
        """Largest intensity (n,) of each lamp up to a distance (n,)."""
        # irradiance of a falloff of power p is intensity · dᵖ / d²
        return np.asarray(self.intensities * np.maximum(1.0, distances) ** self.powers)


@lru_cache(1)
def lamps_of(lights: tuple[Light, ...]) -> Lamps:
    """The lamps of a scene; an edit of anything else leaves its lights the same tuple."""
    shining = [light for light in lights if strength_of(light) > 0]  # the others are dark, whatever their pattern
    others = [light for light in shining if not isinstance(light, SunLight)]
    rows = [
        (
            largest_light(light.color) * intensity_of_point(abs(light.power_w)) * _gain(light),
            light.falloff.power,
            max(light.size) / 2 if isinstance(light, AreaLight) else light.radius,
            _largest_radiance(light),
        )
        for light in others
    ]
    intensities, powers, sizes, bright = np.array(rows, dtype=np.float64).reshape(-1, 4).T
    centers = np.array([light.world_from_light[:3, 3] for light in others], dtype=np.float64).reshape(-1, 3)
    suns = sum(strength_of(light) for light in shining if isinstance(light, SunLight))
    return Lamps(float(suns), centers, intensities, powers, sizes, bright)


def strength_of(light: Light) -> float:
    """Power or irradiance of a lamp in its brightest channel."""
    amount = light.irradiance if isinstance(light, SunLight) else light.power_w
    return 0.0 if amount == 0 else abs(amount) * largest_light(light.color)


def _largest_radiance(light: Light) -> float:
    if getattr(light, "photometry", None) is not None or light.pattern is not None:
        return np.inf
    radiance = radiance_of(light)
    return np.inf if radiance is None else radiance


def _gain(light: PointLight | SpotLight | AreaLight) -> float:
    """Largest intensity of a lamp over that of a point of its power; infinite for a pattern, which may have any."""
    if light.pattern is not None:
        return float("inf")
    if isinstance(light, AreaLight):
        return 4.0 * spread_of(light)[1]
    return 1.0 if light.photometry is None else float(np.max(np.abs(light.photometry.strength), initial=0.0))


def radiance_of(light: Light) -> float | None:
    """Radiance of a lamp that a ray can hit; None for one without a size."""
    tint = largest_light(light.color)
    if isinstance(light, SunLight):
        half = max(min(light.angle_rad, np.pi) / 2, 1e-5)
        return tint * radiance_of_sun(abs(light.irradiance), half)
    if isinstance(light, AreaLight):
        scale = abs(float(np.linalg.det(light.world_from_light[:3, :3]))) ** (2 / 3)
        area = max(light.size[0] * light.size[1] * scale, 1e-12)
        return tint * radiance_of_panel(abs(light.power_w), area) * spread_of(light)[1]
    return tint * radiance_of_ball(abs(light.power_w), light.radius) if light.radius > 0 else None


def radiances(scene: Scene, materials: Sequence[Material]) -> Iterator[tuple[float, str]]:
    """Radiance and name of every source that a ray can hit; point lamps have none."""
    for light in scene.lights:
        if (radiance := radiance_of(light)) is not None:
            yield radiance, light.name
    if not scene.world.is_black:
        yield abs(scene.world.strength) * largest_light(scene.world.color), "World"
    for material in materials:
        if (radiance := emitted_by(material)) > 0:
            yield radiance, material.name


def emitted_by(material: Material) -> float:
    """Largest radiance that a material emits."""
    found = 0.0
    for color, amount in emissions_of(material.surface):
        strength = abs(float(amount)) if isinstance(amount, (int, float)) else largest_size(amount)
        found = max(found, strength * max(largest_light(part) for part in paint_parts(color)))
    return found


@dataclass(frozen=True, slots=True, eq=False)
class Sources:
    """The lamps and emissive objects of a scene. ``pixels``: (n,) radius of half a pixel at each of its lamps.

    ``surfaces``: (k, 2) radiance and area of each emissive object; ``boxes``: (k, 2, 3) ends of the box around it.
    """

    lamps: Lamps
    pixels: Array
    surfaces: Array
    boxes: Array

    def along(self, box: Array, length: float) -> float:
        """Upper bound of the integral of their irradiance along a path of some length through a box (8, 3)."""
        if length == 0:
            return 0.0
        lamps = self.lamps
        reach = np.linalg.norm(lamps.centers[:, None] - box, axis=2).max(axis=1)
        intensities = lamps.at_distance(reach)
        away = distances_to_boxes(lamps.centers, [box])[:, 0]
        # a ray may come as near to a lamp inside the box as its size, or a pixel, permits
        inside = np.pi * intensities / np.maximum(np.maximum(lamps.half_sizes, self.pixels), 1e-12)
        found = np.where(away > 0, intensities / np.maximum(away, 1e-150) ** 2 * length, inside)
        return lamps.suns * length + float(found.sum()) + self._of_surfaces(box, length)

    def _of_surfaces(self, box: Array, length: float) -> float:
        """The same of the emissive objects."""
        radiance, area = self.surfaces.T
        inside = np.pi * radiance * np.sqrt(np.pi * area)  # no more of it is seen from anywhere
        gaps = np.maximum(box.min(axis=0) - self.boxes[:, 1], self.boxes[:, 0] - box.max(axis=0))
        away = np.linalg.norm(np.maximum(gaps, 0.0), axis=1)
        outside = radiance * area / np.maximum(away, 1e-150) ** 2 * length
        return float(np.where(away > 0, np.minimum(inside, outside), inside).sum())


def sources_of(scene: Scene, half_pixels: Array) -> Sources:
    """The sources of a scene; ``half_pixels``: (n,) half of the size of a pixel at each of its lamps."""
    emitted = {material.name: emitted_by(material) for material in scene.materials}
    shining = {name: radiance for name, radiance in emitted.items() if radiance > 0}
    meshes = {mesh.name: mesh for mesh in scene.meshes} if shining else {}
    surfaces, boxes = [], []
    for item in scene.instances if shining else ():
        radiance = max((shining.get(name, 0.0) for name in item.materials), default=0.0)
        mesh = meshes[item.mesh]
        if radiance > 0 and len(mesh.triangles):
            a, b, c = (placed(mesh.positions[mesh.triangles[:, k]], item.world_from_object) for k in range(3))
            area = float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2
            box = placed(box_of(mesh), item.world_from_object)
            surfaces.append((radiance, area))
            boxes.append((box.min(axis=0), box.max(axis=0)))
    arrays = np.array(surfaces, dtype=np.float64).reshape(-1, 2), np.array(boxes, dtype=np.float64).reshape(-1, 2, 3)
    return Sources(lamps_of(scene.lights), half_pixels, *arrays)


def least_distances(points: Array, boxes: Sequence[Array]) -> Array:
    """(n,) distance from each of points (n, 3) to the nearest axis-aligned box, of which there is at least one."""
    step = max(1, AT_ONCE // len(boxes))
    parts = [distances_to_boxes(points[first : first + step], boxes) for first in range(0, len(points), step)]
    return np.concatenate([np.zeros(0), *(part.min(axis=1) for part in parts)])


def distances_to_boxes(points: Array, boxes: Sequence[Array]) -> Array:
    """(n, k) distances from points (n, 3) to the axis-aligned boxes around corners (8, 3); infinite without corners."""
    full = [number for number, box in enumerate(boxes) if len(box)]
    found = np.full((len(points), len(boxes)), np.inf)
    if full:
        corners = np.array([boxes[number] for number in full])
        gaps = np.maximum(corners.min(axis=1) - points[:, None], points[:, None] - corners.max(axis=1))
        found[:, full] = np.linalg.norm(np.maximum(gaps, 0.0), axis=2)
    return found
