# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lights and environment as Mitsuba emitters, in Blender's units.

Lights with an extent are transparent shapes (a ``null`` surface), because Blender's lights cast no shadow.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.images.environment import environment
from spectral_core.render.lights.varying import pattern_texture
from spectral_core.render.mitsuba_scene import geometry, limits, paint, radiometry
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.plugins.lamps.light_points import NarrowPanel
from spectral_core.render.plugins.lamps.shaping import Cone, Luminaire, Shaping
from spectral_core.scene import (
    AreaLight,
    Color,
    Computed,
    Falloff,
    ImageTexture,
    Light,
    PointLight,
    SpectralImage,
    SpotLight,
    SunLight,
    World,
)
from spectral_core.spectra.spectrum import Spectrum

Array = NDArray[np.float64]

ELLIPSE_CORNERS = 96
SMALLEST_AREA = 1e-30
"""Area up to which a light has none."""
SMALLEST_EDGE = 1e-6
"""Least edge of a light of triangles, relative to its distance from the origin, whose corners 32-bit positions can
separate: the power of a smaller one is emitted from this.
"""
NARROWEST_RAD = np.radians(0.02)
"""Least spread of a panel: positions of 32 bits keep no narrower beam."""
SUN_DISTANCE = 2e3
"""Distance of a sun's disk in radii of the scene: its parallax over the scene stays below 0.03 degrees."""
LEAST_DISK_RAD = 1e-4
"""Least half angle of a sun's disk of triangles, whose corners 32-bit positions separate at that distance."""
MOST_OUTGROWN = 2.0
"""Factor on that parallax up to which a scene that grows keeps the disk where it is."""


@dataclass(frozen=True, slots=True, eq=False)
class LightObject:
    """A light in Mitsuba: ``entry``, the scene's shape or emitter, and its ``emitter``."""

    entry: Any
    emitter: Any


def light_objects(context: Context, light: Light, scene_sphere: tuple[Array, float]) -> list[LightObject]:
    """Mitsuba objects of a light; none if it emits nothing.

    ``scene_sphere``: center (3,) and radius of the illuminated region.
    """
    color = plain_color(context, light)
    if isinstance(light, SunLight):
        return _sun(context, light, color, scene_sphere)
    if light.power_w == 0:
        return []
    if isinstance(light, AreaLight):
        return _area(context, light, color)
    return [_point(context, light, color)]


def plain_color(context: Context, light: Light) -> Color | Spectrum:
    """A lamp's color if it is constant; white, with a note, if it is an image or a mix."""
    if isinstance(light.color, (Color, Spectrum)):
        limits.note_unlike_light(context, light.color, context.white or paint.white_light(), light.name)
        return light.color
    context.note(light.name, "is a light with an image or a mix as its color; it is rendered white")
    return Color(np.ones(3))


def _point(context: Context, light: PointLight | SpotLight, color: Color | Spectrum) -> LightObject:
    """A point or a ball with its distribution over directions."""
    center = context.mitsuba.ScalarPoint3f(light.world_from_light[:3, 3])
    shaping = _shaping(context, light)
    if light.radius <= 0:
        emitted = _emitted(context, light, color, radiometry.intensity_of_point(light.power_w))
        emitter = context.load({"type": "blender_point", "center": center, "intensity": emitted})
        emitter.shaping = shaping
        return LightObject(emitter, emitter)
    emitter = context.load(
        {
            "type": "blender_ball",
            "center": center,
            "radius": float(light.radius),
            "faces_receiver": light.soft_falloff,
            "radiance": _emitted(context, light, color, radiometry.radiance_of_ball(light.power_w, light.radius)),
        }
    )
    emitter.shaping = shaping
    place = {"center": [float(value) for value in light.world_from_light[:3, 3]], "radius": float(light.radius)}
    return LightObject(context.load({"type": "sphere", **place, "bsdf": {"type": "null"}, "emitter": emitter}), emitter)


def _shaping(context: Context, light: Light) -> Shaping:
    factors: list[Any] = []
    if isinstance(light, SpotLight):
        cosine = float(np.cos(min(light.cone_angle_rad, np.pi) / 2))
        factors.append(Cone(beam_axes(light, light.cone_scale), cosine, float(light.blend)))
    if isinstance(light, (PointLight, SpotLight)) and light.photometry is not None:
        factors.append(Luminaire(beam_axes(light), light.photometry))
    return Shaping(
        factors, light.falloff.power, light.falloff.smooth, pattern=pattern_texture(context, light),
        is_far=isinstance(light, SunLight),
    )  # fmt: skip


def beam_axes(light: Light, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Array:
    """Rows that transform a world direction to the light's scaled axes, rotated so that the beam is the third."""
    axes = np.linalg.pinv(light.world_from_light[:3, :3] * np.asarray(scale))
    return np.stack([axes[0], -axes[1], -axes[2]])


def _sun(
    context: Context, light: SunLight, color: Color | Spectrum, scene_sphere: tuple[Array, float]
) -> list[LightObject]:
    direction = -light.world_from_light[:3, 2]
    length = np.linalg.norm(direction)
    if light.irradiance == 0 or length == 0:
        return []
    direction = direction / length
    half_angle = radiometry.sun_half_angle(light.angle_rad)
    if half_angle == 0 and light.pattern is None:
        irradiance = _emitted(context, light, color, light.irradiance)
        toward = context.mitsuba.ScalarVector3f(direction)
        emitter = context.load({"type": "blender_sun", "direction": toward, "irradiance": irradiance})
        emitter.reach.enclose(*scene_sphere)
        return [LightObject(emitter, emitter)]
    center, radius = scene_sphere
    half_angle = max(half_angle, LEAST_DISK_RAD)
    distance = SUN_DISTANCE * max(radius, 1e-6)
    corners = _ellipse(_basis(direction), center - direction * distance, 2 * distance * np.tan(half_angle) * np.ones(2))
    radiance = radiometry.radiance_of_sun(light.irradiance, half_angle)
    part, emitted = geometry.polygon(corners, light.name), _emitted(context, light, color, radiance)
    return [_emitting_polygon(context, part, emitted, _shaping(context, light) if light.pattern else None)]


def is_far(mitsuba: Any, light: SunLight, sun: LightObject, scene_sphere: tuple[Array, float]) -> bool:
    """True if the disk of a sun is far enough away for a scene that may have grown or moved since it was made."""
    center, radius = scene_sphere
    disk = np.array(mitsuba.traverse(sun.entry)["vertex_positions"], dtype=np.float64).reshape(-1, 3).mean(axis=0)
    distance, direction = float(np.linalg.norm(center - disk)), -light.world_from_light[:3, 2]
    turned = np.linalg.norm((center - disk) / distance - direction / np.linalg.norm(direction))
    return bool(distance * MOST_OUTGROWN >= SUN_DISTANCE * radius and turned * SUN_DISTANCE <= MOST_OUTGROWN)


def _area(context: Context, light: AreaLight, color: Color | Spectrum) -> list[LightObject]:
    axes = light.world_from_light[:3, :3].copy()
    axes[:, 1:] *= -1  # rotated about x, so that the front faces -z
    origin, size = light.world_from_light[:3, 3], np.asarray(light.size, dtype=np.float64)
    if not has_area(context, light, float(np.linalg.norm(np.cross(*(axes[:, :2] * size).T)))):
        return []
    size = np.maximum(size, SMALLEST_EDGE * (np.abs(origin).max() + size.max()))
    if light.shape == "ellipse":
        corners = _ellipse(axes, origin, size)
    else:
        signs = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]]) / 2
        corners = origin + (signs * size) @ axes[:, :2].T
    if np.linalg.det(axes) < 0:
        corners = corners[::-1]
    part = geometry.polygon(corners, light.name)
    area = geometry.area_of(part)
    radiance = _emitted(context, light, color, radiometry.radiance_of_panel(light.power_w, area))
    tangent, gain = spread_of(light)
    is_narrow = tangent > 0
    spread = {"spread_tangent": tangent, "spread_gain": gain} if is_narrow else {}
    is_shaped = light.falloff != Falloff() or light.pattern is not None
    made = _emitting_polygon(context, part, radiance, _shaping(context, light) if is_shaped else None, spread)
    if is_narrow:
        half_axes = axes[:, :2] * size / 2 * np.array([np.sign(np.linalg.det(axes)), 1.0])
        made.emitter.surface = NarrowPanel(origin, half_axes, tangent, ellipse=light.shape == "ellipse")
    return [made]


def has_area(context: Context, light: AreaLight, area: float) -> bool:
    """False, with a note, for an area light that is a line or a point."""
    if area > SMALLEST_AREA:
        return True
    context.note(light.name, "is an area light without area, so it emits no light; give it a size and a scale")
    return False


def spread_of(light: AreaLight) -> tuple[float, float]:
    """Cycles' spread: tangent of the half angle of the beam, and the gain that preserves its power; (0, 1) for no
    spread.

    Cycles (light/area.h): attenuation max(0, normalize · (tan s - tan θ)) with normalize = 1 / (tan s - s).
    """
    if light.spread_rad >= np.pi - 1e-6:
        return 0.0, 1.0
    half_angle = max(light.spread_rad, NARROWEST_RAD) / 2
    tangent = np.tan(half_angle)
    return float(tangent), float(tangent / (tangent - half_angle))


def _basis(direction: Array) -> Array:
    """Axes (3, 3) whose third column is ``direction``."""
    across = np.eye(3)[int(np.argmin(np.abs(direction)))]
    first = np.cross(across, direction)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(direction, first), direction], axis=1)


def _ellipse(axes: Array, origin: Array, size: Array) -> Array:
    """Corners of a polygon with the same area as the ellipse of full extent ``size`` along the first two axes."""
    angles = np.arange(ELLIPSE_CORNERS) * (2 * np.pi / ELLIPSE_CORNERS)
    inscribed_share = np.sin(2 * np.pi / ELLIPSE_CORNERS) * ELLIPSE_CORNERS / (2 * np.pi)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1) / np.sqrt(inscribed_share)
    return np.asarray(origin + (circle * size / 2) @ axes[:, :2].T)


def _emitted(context: Context, light: Light, color: Color | Spectrum, strength: float) -> Any:
    return context.switched(
        _signed(context, paint.constant_emission(context, color, abs(strength)), strength), light.group
    )


def _signed(context: Context, emitted: Any, strength: float) -> Any:
    """What is emitted, below 0 for a negative ``strength``: Mitsuba's spectra are not negative."""
    if strength >= 0:
        return emitted
    return context.load({"type": "product_paint", "color": emitted, "amount": context.constant(-1.0)})


def _emitting_polygon(
    context: Context,
    part: geometry.Part,
    radiance: Any,
    shaping: Shaping | None,
    spread: dict[str, float] | None = None,
) -> LightObject:
    kind = "blender_area" if spread or shaping else "area"
    emitter = context.load({"type": kind, "radiance": radiance, **(spread or {})})
    if shaping is not None:
        emitter.shaping = shaping
    children = {"bsdf": context.load({"type": "null"}), "emitter": emitter}
    return LightObject(geometry.mesh_shape(context, part, children), emitter)


def world_emitter(context: Context, world: World) -> Any | None:
    """Mitsuba's environment, or None for a black one."""
    if world.is_black:
        return None
    if isinstance(world.color, (Color, Spectrum)):
        radiance = _signed(context, paint.emission(context, world.color, abs(world.strength), "World"), world.strength)
        return context.load({"type": "constant", "radiance": context.switched(radiance, world.group)})
    if isinstance(world.color, ImageTexture):
        return environment(context, world, world.color)
    if isinstance(world.color, SpectralImage):
        context.note("World", "has a spectral texture; it emits the texture's color under D65")
        return environment(context, world, paint.in_daylight(world.color))
    if isinstance(world.color, Computed):
        context.note("World", "has a color that varies; its mean lights the scene")
        typical = Color(np.broadcast_to(world.color.typical, (3,)))
        return world_emitter(context, World(typical, world.strength, world.world_from_environment, world.group))
    context.note("World", "has a mixed color; the first part of the mix lights the scene")
    first = World(world.color.first, world.strength, world.world_from_environment, world.group)
    return world_emitter(context, first)
