# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights and the environment as Mitsuba's emitters, in Blender's units."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.images.environment import ENVIRONMENT_AXES, rows_from_pole_to_pole
from spectral_core.render.mitsuba_export import paints
from spectral_core.render.mitsuba_export import xml_elements as xml
from spectral_core.render.mitsuba_export.draft import Draft
from spectral_core.render.mitsuba_scene import radiometry
from spectral_core.render.mitsuba_scene.light import SUN_DISTANCE
from spectral_core.render.mitsuba_scene.paint import color_pixels, in_daylight
from spectral_core.scene import (
    AreaLight,
    Color,
    Computed,
    DrawnPattern,
    ImageTexture,
    Light,
    MixedPaint,
    PointLight,
    SpectralImage,
    SpotLight,
    SunLight,
    World,
)
from spectral_core.spectra.spectrum import Spectrum

Array = NDArray[np.float64]

_WRITTEN = {
    "name", "world_from_light", "color", "group", "camera_visible", "is_planckian", "is_in_footage", "power_w",
    "radius", "soft_falloff", "irradiance", "angle_rad", "cone_angle_rad", "blend", "size", "shape",
}  # fmt: skip


def lamp(draft: Draft, light: Light, sphere: tuple[Array, float]) -> Iterator[xml.Element]:
    """Shapes and emitters of a light; ``sphere``: center and radius of the scene."""
    draft.leftover(light.name, light, _WRITTEN)
    if isinstance(light, SunLight):
        yield from _sun(draft, light, sphere)
    elif light.power_w > 0 and isinstance(light, AreaLight):
        yield from _panel(draft, light)
    elif light.power_w > 0 and isinstance(light, SpotLight):
        yield _spot(draft, light)
    elif light.power_w > 0 and isinstance(light, PointLight):
        yield _point(draft, light)


def _emitted(draft: Draft, name: str, light: Light, strength: float) -> xml.Element:
    color = light.color
    if not isinstance(color, (Color, Spectrum)):
        draft.note(light.name, "is a light with an image or a mix as its color; it is written white")
        color = Color(np.ones(3))
    return paints.emission(draft, name, color, strength, light.name)


def _body(draft: Draft, kind: str, radiance: xml.Element, *placement: xml.Element) -> xml.Element:
    """A shape that emits light and casts no shadow."""
    draft.has_clear_surfaces = True
    emitter = xml.plugin("emitter", "area", radiance)
    return xml.plugin("shape", kind, *placement, xml.plugin("bsdf", "null"), emitter)


def _point(draft: Draft, light: PointLight) -> xml.Element:
    center = light.world_from_light[:3, 3]
    if light.radius <= 0:
        intensity = _emitted(draft, "intensity", light, radiometry.intensity_of_point(light.power_w))
        return xml.plugin("emitter", "point", xml.point("position", center), intensity)
    if light.soft_falloff:
        draft.note(light.name, "illuminates like a ball; Blender's soft falloff differs near it")
    radiance = _emitted(draft, "radiance", light, radiometry.radiance_of_ball(light.power_w, light.radius))
    return _body(draft, "sphere", radiance, xml.point("center", center), xml.number("radius", light.radius))


def _spot(draft: Draft, light: SpotLight) -> xml.Element:
    """Mitsuba's spot: its strength falls linearly in the angle where Blender's is a smooth step."""
    if light.radius > 0:
        draft.note(light.name, "is a point in Mitsuba, whose spots have no radius; its shadows are sharp")
    if light.blend > 0:
        draft.note(light.name, "the soft edge of its cone has another profile in Mitsuba")
    half = min(light.cone_angle_rad, np.pi - 1e-3) / 2
    edge = np.cos(half)
    cutoff, inner = np.degrees(half), np.degrees(np.arccos(min(edge + (1 - edge) * light.blend, 1.0)))
    intensity = _emitted(draft, "intensity", light, radiometry.intensity_of_point(light.power_w))
    return xml.plugin(
        "emitter", "spot", _oriented(light.world_from_light), intensity, xml.number("cutoff_angle", cutoff),
        xml.number("beam_width", min(inner, cutoff * (1 - 1e-4))),
    )  # fmt: skip


def _sun(draft: Draft, light: SunLight, sphere: tuple[Array, float]) -> Iterator[xml.Element]:
    direction = -light.world_from_light[:3, 2]
    length = np.linalg.norm(direction)
    if light.irradiance == 0 or length == 0:
        return
    direction = direction / length
    half = radiometry.sun_half_angle(light.angle_rad)
    if half == 0:
        toward = xml.vector("direction", direction)
        yield xml.plugin("emitter", "directional", toward, _emitted(draft, "irradiance", light, light.irradiance))
        return
    center, radius = sphere
    distance = SUN_DISTANCE * max(radius, 1e-6)
    matrix = _frame(direction, distance * np.tan(half), center - direction * distance)
    radiance = _emitted(draft, "radiance", light, radiometry.radiance_of_sun(light.irradiance, half))
    yield _body(draft, "disk", radiance, xml.transform("to_world", matrix))


def _panel(draft: Draft, light: AreaLight) -> Iterator[xml.Element]:
    axes = light.world_from_light[:3, :3].copy()
    axes[:, 1:] *= -1  # rotated about x, so that the front faces -z
    half = axes[:, :2] * np.asarray(light.size, dtype=np.float64) / 2
    front = np.cross(half[:, 0], half[:, 1])
    is_ellipse = light.shape == "ellipse"
    area = 4.0 * float(np.linalg.norm(front)) * (np.pi / 4 if is_ellipse else 1.0)
    if not area > 0:
        draft.note(light.name, "is an area light without area, so it emits no light; give it a size and a scale")
        return
    matrix = np.eye(4)
    matrix[:3, :2] = half
    matrix[:3, 2] = front / np.linalg.norm(front) * (1.0 if np.linalg.det(axes) >= 0 else -1.0)
    matrix[:3, 3] = light.world_from_light[:3, 3]
    radiance = _emitted(draft, "radiance", light, radiometry.radiance_of_panel(light.power_w, area))
    yield _body(draft, "disk" if is_ellipse else "rectangle", radiance, xml.transform("to_world", matrix))


def _frame(normal: Array, radius: float, center: Array) -> Array:
    """Matrix of a disk with a normal, radius and center."""
    across = np.eye(3)[int(np.argmin(np.abs(normal)))]
    first = np.cross(across, normal)
    first /= np.linalg.norm(first)
    matrix = np.eye(4)
    matrix[:3] = np.stack([first * radius, np.cross(normal, first) * radius, normal, center], axis=1)
    return matrix


def _oriented(world_from_light: Array) -> xml.Element:
    """Placement of an emitter that shines along its +z, of a light that shines along its -z; its scale is left out."""
    axes = world_from_light[:3, :3]
    forward = -axes[:, 2] / max(float(np.linalg.norm(axes[:, 2])), 1e-30)
    matrix = _frame(forward, 1.0, world_from_light[:3, 3])
    return xml.transform("to_world", matrix)


def environment(draft: Draft, world: World) -> xml.Element | None:
    """Mitsuba's environment, None for a black one."""
    if world.is_black:
        return None
    draft.leftover("World", world, {"color", "strength", "world_from_environment", "group", "medium"})
    color: Any = world.color
    if isinstance(color, SpectralImage):
        draft.note("World", "has a spectral texture; it is written in its color under D65")
        color = in_daylight(color)
    if isinstance(color, MixedPaint):
        draft.note("World", "has a mixed color; the first part of the mix is written")
        return environment(draft, replace(world, color=color.first))
    if isinstance(color, Computed):
        draft.note("World", "has a color that varies by a node tree; its mean is written")
        color = Color(np.broadcast_to(color.typical, (3,)))
    if isinstance(color, ImageTexture):
        return _image(draft, world, color)
    return xml.plugin("emitter", "constant", paints.emission(draft, "radiance", color, world.strength, "World"))


def _image(draft: Draft, world: World, image: ImageTexture) -> xml.Element:
    if isinstance(image, DrawnPattern):
        blurred = "its pattern is written as an image, in which its finest details are blurred"
        draft.note("World", "it is written for diffuse rays alone" if image.tells_rays else blurred)
    pixels = np.maximum(color_pixels(image), 0.0)
    pixels = np.repeat(pixels, 3, axis=2) if pixels.shape[2] == 1 else pixels
    if draft.white is not None:
        draft.note("World", "its image tints D65 in Mitsuba, not the scene's own white")
    path = paints.image_file(draft, image.name, rows_from_pole_to_pole(pixels[::-1]))
    matrix = world.world_from_environment @ ENVIRONMENT_AXES
    return xml.plugin(
        "emitter", "envmap", xml.string("filename", path), xml.number("scale", world.strength * draft.brightness),
        xml.transform("to_world", matrix),
    )  # fmt: skip
