# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lamps as rows of the light tables, in Blender's units."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.render.lights.emissive_meshes import geometry as triangle_geometry
from spectral_core.render.lights.listing import Ball, Beam, EmissiveMesh, LightList, Panel, Source, Sun
from spectral_core.render.lights.varying import pattern_mean, pattern_texture
from spectral_core.render.mitsuba_scene import geometry, paint, radiometry
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.mitsuba_scene.light import beam_axes, has_area, plain_color, spread_of
from spectral_core.render.plugins.numbers import channel_mean, table
from spectral_core.scene import (
    AreaLight,
    Color,
    Emission,
    Light,
    PointLight,
    Principled,
    SpotLight,
    SunLight,
    Surface,
    World,
    weighted_leaves,
)
from spectral_core.scene.paint import DrawnPattern, ImageTexture
from spectral_core.spectra.spectrum import Spectrum

ROWS = 32
"""Rows of the coarse picture of an environment from which its irradiance is computed."""


def add_lamp(context: Context, lights: LightList, light: Light) -> int | None:
    """Add a lamp; returns its source, None if it emits nothing."""
    color = plain_color(context, light)
    if isinstance(light, SunLight):
        return _sun(context, lights, light, color)
    if light.power_w == 0:
        return None
    if isinstance(light, AreaLight):
        return _panel(context, lights, light, color)
    return _ball(context, lights, light, color)


def _source(context: Context, lights: LightList, light: Light, color: Color | Spectrum, strength: float) -> int:
    emitted = weight_of(color, strength) if lights.only_weighs else emitted_by(context, color, strength)
    pattern, mean = None if lights.only_weighs else pattern_texture(context, light), pattern_mean(light)
    shown = {"camera_visible": light.camera_visible}
    source = lights.add_source(Source(emitted, light.group, **shown, pattern=pattern, pattern_mean=mean))
    _switched(context, lights, source, light.group)
    return source


def emitted_by(context: Context, color: Color | Spectrum, strength: float) -> Any:
    """Emission of a source with a paint: a spectrum, or linear RGB (3,)."""
    if context.spectral:
        return radiometry.at_strength(paint.emitted_spectrum(color, context.white), strength)
    return paint.emitted_rgb(color) * strength


def weight_of(color: Color | Spectrum, strength: float) -> Any:
    """The same for the choice of lights alone, which needs no spectrum of a color."""
    if isinstance(color, Color):
        return color.linear_rgb * strength
    return radiometry.at_strength(paint.unit_luminance(color), strength)


def _switched(context: Context, lights: LightList, source: int, group: str) -> None:
    if context.switches is not None:
        context.switches.setdefault(group, []).append(lambda on: lights.switch(source, on))


def _ball(context: Context, lights: LightList, light: PointLight | SpotLight, color: Color | Spectrum) -> int:
    source = _source(context, lights, light, color, radiometry.intensity_of_point(light.power_w))
    radius = max(float(light.radius), 0.0)
    plain = beam_axes(light)
    axes, cosine, softness = np.eye(3), -2.0, 1e-6
    if isinstance(light, SpotLight):
        axes = beam_axes(light, light.cone_scale)
        cosine = float(np.cos(min(light.cone_angle_rad, np.pi) / 2))
        softness = max(1e-6, (1.0 - cosine) * float(light.blend))
    lights.balls.append(
        Ball(
            source,
            light.world_from_light[:3, 3],
            radius,
            light.soft_falloff,
            Beam(axes, cosine, softness, plain, light.photometry),
            (light.falloff.power, light.falloff.smooth),
        )
    )
    return source


def _sun(context: Context, lights: LightList, light: SunLight, color: Color | Spectrum) -> int | None:
    toward = light.world_from_light[:3, 2]
    length = float(np.linalg.norm(toward))
    if light.irradiance == 0 or length == 0:
        return None
    half = radiometry.sun_half_angle(light.angle_rad)
    strength = radiometry.radiance_of_sun(light.irradiance, half) if half else light.irradiance
    source = _source(context, lights, light, color, strength)
    lights.suns.append(Sun(source, toward / length, half))
    return source


def _panel(context: Context, lights: LightList, light: AreaLight, color: Color | Spectrum) -> int | None:
    axes = light.world_from_light[:3, :3].copy()
    axes[:, 1:] *= -1  # rotated about x, so that the front faces -z
    half = axes[:, :2] * np.asarray(light.size, dtype=np.float64) / 2
    front = np.cross(half[:, 0], half[:, 1])
    center = light.world_from_light[:3, 3]
    area = 4.0 * float(np.linalg.norm(front)) * (np.pi / 4 if light.shape == "ellipse" else 1.0)
    if not has_area(context, light, area):
        return None
    # mirroring reverses the order of the corners, but not the emitting side
    normal = front / np.linalg.norm(front) * (1.0 if np.linalg.det(axes) >= 0 else -1.0)
    source = _source(context, lights, light, color, radiometry.radiance_of_panel(light.power_w, area))
    lights.panels.append(
        Panel(
            source,
            center,
            half,
            normal,
            light.shape == "ellipse",
            spread_of(light),
            (light.falloff.power, light.falloff.smooth),
        )
    )
    return source


def add_world(context: Context, lights: LightList, world: World, emitter: Any) -> int:
    """Add the environment; its emission comes from Mitsuba's emitter."""
    context.read_numbers(emitter)
    source = lights.add_source(Source(None, world.group, emitter, camera_visible=True))
    lights.world = (source, abs(world.strength) * world_weight(world.color))
    lights.world_is_constant = isinstance(world.color, (Color, Spectrum))
    return source


def world_weight(color: Any) -> float:
    """Irradiance by which an environment of strength 1 is chosen: the root of the mean square of what its samples give
    to a plane, for the plane where it is largest.
    """
    if isinstance(color, DrawnPattern) and color.is_only_met:
        return 0.0
    if isinstance(color, ImageTexture):
        return _weight_of_picture(np.abs(paint.color_pixels(color)).mean(axis=2))
    return float(np.pi * np.mean(np.abs(color.linear_rgb))) if isinstance(color, Color) else np.pi


def _weight_of_picture(radiance: Any) -> float:
    """The same for a picture of the environment (rows from below, columns around the vertical), by a coarse one."""
    repeats = [-(-least // size) for least, size in zip((ROWS, 2 * ROWS), radiance.shape, strict=True)]
    if max(repeats) > 1:
        radiance = np.repeat(np.repeat(radiance, repeats[0], axis=0), repeats[1], axis=1)
    height, width = radiance.shape
    rows, columns = np.arange(ROWS) * height // ROWS, np.arange(2 * ROWS) * width // (2 * ROWS)
    # the light of a cell: its radiance times its solid angle
    heights = np.diff(np.sin(np.pi * (np.arange(height + 1) / height - 0.5)))
    light = np.add.reduceat(np.add.reduceat(radiance, columns, axis=1) * heights[:, None], rows, axis=0)
    light = light.ravel() * (2 * np.pi / width)
    up, around = np.meshgrid(np.pi * ((np.arange(ROWS) + 0.5) / ROWS - 0.5), np.pi * np.arange(2 * ROWS) / ROWS)
    toward = np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=-1)
    normals = toward[::4, ::4].reshape(-1, 3)
    cosines = np.maximum(normals @ toward.transpose(1, 0, 2).reshape(-1, 3).T, 0.0)
    return float(np.sqrt((cosines**2 @ light).max() * light.sum()))


def emitted_evenly(surface: Surface | None) -> tuple[Color | Spectrum, float] | None:
    """The single color and strength of a surface's emission; None if it varies, or if several emissions add up."""
    found: list[tuple[Any, float]] = []
    for weight, closure in weighted_leaves(surface):
        if isinstance(closure, Emission):
            color, strength = closure.color, closure.strength
        elif isinstance(closure, Principled):
            color, strength = closure.emission_color, closure.emission_strength
            if closure.sheen_weight != 0:
                return None
            weight = weight.times(closure.alpha)
        else:
            continue
        if not isinstance(strength, (int, float)):
            return None
        if strength * weight.constant == 0:
            continue
        if weight.varying or not isinstance(color, (Color, Spectrum)):
            return None
        found.append((color, float(strength) * weight.constant))
    return found[0] if len(found) == 1 else None


def add_emissive(context: Context, part: geometry.Part, shape: Any, emission: tuple[Any, Any, str]) -> None:
    """Add an emissive mesh: its emission (None if only its emitter knows it), the emitter, the light group."""
    assert context.lights is not None
    emitted, emitter, group = emission
    lights, corners = context.lights, part.positions[part.triangles].astype(np.float64)
    uvs = None if part.uvs is None else part.uvs[part.triangles]
    source = lights.add_source(Source(emitted, group, emitter))
    if emitter is None:
        brightness = np.ones(len(corners))
        _switched(context, lights, source, group)
    else:  # the texture of a varying emission contains its switch
        brightness = _emission_by_triangle(context, emitter, shape, corners, uvs)
    lights.emissive.append(EmissiveMesh(source, corners, uvs, shape, brightness))


def _emission_by_triangle(context: Context, emitter: Any, shape: Any, corners: Any, uvs: Any) -> Any:
    """Brightness of each triangle of a varying emission (t,), from three points of each."""
    import drjit as dr

    mi = context.mitsuba
    total = np.zeros(len(corners))
    for weights in ((0.6, 0.2, 0.2), (0.2, 0.6, 0.2), (0.2, 0.2, 0.6)):
        si = dr.zeros(mi.SurfaceInteraction3f, len(corners))
        si.p = mi.Point3f(*(table(mi.Float, row) for row in np.tensordot(corners, weights, (1, 0)).T))
        normals, _ = triangle_geometry(corners)
        si.n = mi.Normal3f(*(table(mi.Float, row) for row in normals.T))
        si.sh_frame, si.wi = mi.Frame3f(si.n), mi.Vector3f(0.0, 0.0, 1.0)
        at = np.broadcast_to(weights[1:], (len(corners), 2)) if uvs is None else np.tensordot(uvs, weights, (1, 0))
        si.uv = mi.Point2f(*(table(mi.Float, row) for row in at.T))
        si.shape, si.prim_index = mi.ShapePtr(shape), dr.arange(mi.UInt32, len(corners))
        if context.spectral:
            si.wavelengths = mi.Spectrum(450.0, 530.0, 590.0, 640.0)
        total += np.abs(np.array(channel_mean(dr, emitter.radiance.eval(si))).reshape(-1)) / 3
    if context.spectral:
        total /= float(np.mean(paint.white_light().at(np.array([450.0, 530.0, 590.0, 640.0]))))
    # parts that the three points miss still get a share
    return np.maximum(total, 0.1 * total.mean()) + 1e-12
