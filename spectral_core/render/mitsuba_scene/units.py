# SPDX-License-Identifier: GPL-3.0-or-later
"""Scaling of very small scenes: Mitsuba offsets rays by 1e-4 units from their surface, or more at large coordinates."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Camera, Falloff, Light, Material, ScatteringMedium, Scene, SunLight

SMALLEST_RADIUS = 0.05
"""Radius below which a scene is scaled. Large scenes are not: a single distant object would shrink all others to
nothing, and offsets of rays grow with the coordinates anyway.
"""


def in_working_units(scene: Scene, radius: float) -> Scene:
    """The scene scaled to a radius of 1 if it is so small that the offset of rays would exceed its details; the light
    stays the same.

    Sampled volumes state extinction per unit of length, so a scene with volumes is not scaled.
    """
    if radius >= SMALLEST_RADIUS or scene.volumes or not radius > 0:
        return scene
    factor = 1.0 / radius
    return replace(
        scene,
        camera=_camera(scene.camera, factor),
        instances=tuple(
            replace(item, world_from_object=_scaled(item.world_from_object, factor)) for item in scene.instances
        ),
        lights=tuple(_light(item, factor) for item in scene.lights),
        materials=tuple(_material(item, factor) for item in scene.materials),
        world=replace(scene.world, medium=_medium(scene.world.medium, factor)),
    )


def _scaled(matrix: NDArray[np.float64], factor: float) -> NDArray[np.float64]:
    return np.diag([factor, factor, factor, 1.0]) @ matrix


def _moved(matrix: NDArray[np.float64], factor: float) -> NDArray[np.float64]:
    """Only the position changes: the matrix of a camera or a lamp contains no size."""
    result = matrix.copy()
    result[:3, 3] *= factor
    return result


def _camera(camera: Camera, factor: float) -> Camera:
    names = ("orthographic_scale", "aperture_radius", "focus_distance", "near", "far")
    # values beyond the bounds of a camera's numbers behave as the bounds: the scene itself has a radius of 1
    lengths = {name: min(max(getattr(camera, name) * factor, 0.0), 1e11) for name in names}
    lengths["focus_distance"] = max(lengths["focus_distance"], 1e-8)
    return replace(camera, world_from_camera=_moved(camera.world_from_camera, factor), **lengths)


def _light(light: Light, factor: float) -> Light:
    changes: dict[str, Any] = {"world_from_light": _moved(light.world_from_light, factor)}
    if isinstance(light, SunLight):
        return replace(light, **changes)
    # distances grow by the factor, so equal irradiance needs its square in power; the exponent of the falloff changes
    # that
    changes["power_w"] = light.power_w * factor ** (2 - light.falloff.power)
    changes["falloff"] = Falloff(light.falloff.power, light.falloff.smooth * factor**2)
    if hasattr(light, "radius"):
        changes["radius"] = light.radius * factor
    else:
        changes["size"] = (light.size[0] * factor, light.size[1] * factor)
    return replace(light, **changes)


def _material(material: Material, factor: float) -> Material:
    return replace(material, medium=_medium(material.medium, factor))


def _medium(medium: ScatteringMedium | None, factor: float) -> ScatteringMedium | None:
    if medium is None:
        return None
    strength, grid = medium.emission_strength / factor, medium.grid
    if grid is not None:
        grid = replace(grid, world_from_index=_scaled(grid.world_from_index, factor))
    return replace(medium, density=medium.density / factor, emission_strength=strength, grid=grid)
