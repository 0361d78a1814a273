# SPDX-License-Identifier: GPL-3.0-or-later
"""Scaling of very small scenes, and moving of scenes far from the origin.

Mitsuba offsets rays by 1e-4 units from their surface, times one more than the largest coordinate.
"""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import (
    Camera,
    Computed,
    Falloff,
    Light,
    Material,
    Note,
    Principled,
    Program,
    RayPortal,
    ScatteringMedium,
    Scene,
    Subsurface,
    SunLight,
    VolumeObject,
)
from spectral_core.scene.geometry import placed_boxes
from spectral_core.scene.shading.moved import Result, Units, in_units
from spectral_core.spectra.spectrum import Spectrum

Array = NDArray[np.float64]
_T = TypeVar("_T")

SMALLEST_RADIUS = 0.05
"""Radius, or typical size, below which a scene is scaled. Large scenes are not: a single distant object would shrink
all others to nothing, and offsets of rays grow with the coordinates anyway.
"""


NEAR = 5.0
"""Distance from the origin up to which a scene stays where it is."""
FAR, FAR_IN_SIZES = 100.0, (4.0, 10.0)
"""A scene is moved if it is farther from the origin than this many of its own sizes: the first beyond ``FAR``."""

IN_WORLD: dict[tuple[type, str], Result] = {
    (RayPortal, "position"): "point",
    (Subsurface, "radius"): "length",
    (Principled, "subsurface_radius"): "length",
}
"""Inputs of closures that are points or lengths of the world."""
COARSE = 0.005
"""Share of a scene's size that 32-bit numbers may be apart without a note."""


def at_origin(scene: Scene, kept: Array | None = None) -> tuple[Scene, Array]:
    """The scene moved to the origin if it is far away, and the point (3,) of it that is there then: ``kept`` if that
    is near enough.
    """
    center, distance, size = _layout(scene)
    if not (distance > NEAR and distance > FAR_IN_SIZES[0 if distance > FAR else 1] * size):
        return scene, np.zeros(3)
    stays = kept is not None and kept.any() and np.linalg.norm(center - kept) <= FAR_IN_SIZES[0] * size
    shift = kept if kept is not None and stays else np.round(center)
    step = float(np.spacing(np.float32(np.abs(shift).max())))
    if step > COARSE * typical_size(scene):
        place = f"it is {np.linalg.norm(shift):.2g} units from the origin"
        text = f"{place}, where Blender's 32-bit numbers are {step:.1g} apart; move it toward the origin"
        scene = replace(scene, notes=(*scene.notes, Note("Scene", text)))
    return moved(scene, shift), shift


def typical_size(scene: Scene) -> float:
    """Size of what is large in the picture: of single objects and their distances; infinite without any."""
    return _layout(scene, around=False)[2]


def _layout(scene: Scene, *, around: bool = True) -> tuple[Array, float, float]:
    """Middle (3,) of what is large in the picture, its distance from the origin and its size.

    Each object counts by the square of its angle in the picture, at its point that is nearest to the camera.
    ``around``: also those that the camera is in.
    """
    eye = scene.camera.world_from_camera[:3, 3]
    boxes = [box for box in placed_boxes(scene.meshes, scene.instances) if len(box)]
    corners = np.array(boxes).reshape(-1, 8, 3)
    corners = corners[np.isfinite(corners).all(axis=(1, 2))]
    if not len(corners):
        return np.zeros(3), 0.0, np.inf
    low, high = corners.min(axis=1), corners.max(axis=1)
    nearest = np.clip(eye, low, high)
    away, radius = np.linalg.norm(nearest - eye, axis=1), np.linalg.norm(high - low, axis=1) / 2
    if not around:
        outside = away > 0
        if not outside.any():
            return np.zeros(3), 0.0, np.inf
        nearest, away, radius = nearest[outside], away[outside], radius[outside]
    weights = np.ones(len(away))
    if scene.camera.kind != "orthographic":
        weights = np.minimum(1.0, (radius + 1e-9) / np.maximum(away, 1e-9)) ** 2
    center = np.array([_median(nearest[:, axis], weights) for axis in range(3)])
    sizes = np.linalg.norm(nearest - center, axis=1) + np.minimum(radius, away)
    return center, _median(np.linalg.norm(nearest, axis=1), weights), _median(sizes, weights)


def _median(values: Array, weights: Array) -> float:
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(total, total[-1] / 2)])


def moved(scene: Scene, shift: Array) -> Scene:
    """The scene moved by ``-shift`` (3,). Its programs see the points of the world where they were."""
    back = np.eye(4)
    back[:3, 3] = -shift
    units = Units(shift=(float(shift[0]), float(shift[1]), float(shift[2])))

    def put(items: tuple[_T, ...], name: str) -> tuple[_T, ...]:
        return tuple(replace(item, **{name: back @ getattr(item, name)}) for item in items)  # type: ignore[type-var]

    return replace(
        scene,
        camera=put((scene.camera,), "world_from_camera")[0],
        instances=put(scene.instances, "world_from_object"),
        lights=put(in_renderer_units(scene.lights, units), "world_from_light"),
        materials=tuple(
            replace(item, medium=_medium_moved(item.medium, back)) if item.medium is not None else item
            for item in in_renderer_units(scene.materials, units)
        ),
        volumes=put(scene.volumes, "world_from_index"),
        world=replace(scene.world, medium=_medium_moved(scene.world.medium, back)),
        moments=tuple(
            replace(
                moment,
                camera=put((moment.camera,), "world_from_camera")[0],
                instances=put(moment.instances, "world_from_object"),
                volumes=put(moment.volumes, "world_from_index"),
            )
            for moment in scene.moments
        ),
    )


def moved_back(positions: NDArray[np.float32], shift: Array) -> NDArray[np.float32]:
    """The pass Position (h, w, 3) of a moved scene, as of the scene itself; pixels without a surface stay 0."""
    is_hit = (positions != 0).any(axis=-1, keepdims=True)
    return np.where(is_hit, positions + shift, positions).astype(np.float32)


def _medium_moved(medium: ScatteringMedium | None, back: Array) -> ScatteringMedium | None:
    if medium is None or medium.grid is None:
        return medium
    return replace(medium, grid=replace(medium.grid, world_from_index=back @ medium.grid.world_from_index))


def in_renderer_units(item: Any, units: Units) -> Any:
    """Materials, lamps and their parts with every program and every length of theirs in the renderer's units."""
    if isinstance(item, tuple):
        parts = tuple(in_renderer_units(part, units) for part in item)
        return item if all(a is b for a, b in zip(parts, item, strict=True)) else parts
    if isinstance(item, Computed):
        made = in_units(item.program, units)
        item = item if made is item.program else replace(item, program=made)
    if not is_dataclass(item) or isinstance(item, (type, Spectrum, Program)):
        return item
    changes: dict[str, Any] = {}
    for entry in fields(item):
        value = getattr(item, entry.name)
        if value is not None and (type(item), entry.name) in IN_WORLD:
            changes[entry.name] = _result_in(value, units, IN_WORLD[type(item), entry.name])
        elif (new := in_renderer_units(value, units)) is not value:
            changes[entry.name] = new
    return replace(item, **changes) if changes else item


def _result_in(value: Any, units: Units, result: Result) -> Any:
    """A point or lengths of the world: a program's, or constant lengths."""
    if isinstance(value, Computed):
        return replace(value, program=in_units(value.program, units, result))
    return tuple(units.factor * float(part) for part in value)


def in_working_units(scene: Scene, radius: float) -> Scene:
    """The scene scaled to a radius of 1 if it is so small that the offset of rays would exceed its details; the light
    stays the same.
    """
    if radius >= SMALLEST_RADIUS or not radius > 0:
        return scene
    factor = 1.0 / radius
    units = Units(factor)
    return replace(
        scene,
        camera=_camera(scene.camera, factor),
        instances=tuple(
            replace(item, world_from_object=_scaled(item.world_from_object, factor)) for item in scene.instances
        ),
        lights=tuple(_light(item, factor) for item in in_renderer_units(scene.lights, units)),
        materials=tuple(_material(item, factor) for item in in_renderer_units(scene.materials, units)),
        volumes=tuple(_volume(item, factor) for item in scene.volumes),
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


def _volume(volume: VolumeObject, factor: float) -> VolumeObject:
    """Extinction, emission and gradients of a transfer function are per unit of length."""
    materials = []
    for item in volume.transfer.materials:
        steps = item.gradient_values
        changes = {"extinction": item.extinction / factor, "gradient_values": None if steps is None else steps / factor}
        materials.append(replace(item, emission=item.emission / factor, **changes))
    transfer = replace(volume.transfer, materials=tuple(materials))
    return replace(volume, world_from_index=_scaled(volume.world_from_index, factor), transfer=transfer)
