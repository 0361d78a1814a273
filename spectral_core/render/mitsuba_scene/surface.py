# SPDX-License-Identifier: GPL-3.0-or-later
"""Closures as Mitsuba BSDFs, and what a surface emits.

A tree of mixes and sums is a list of closures with weights, as in Cycles; each closure becomes one BSDF, and where
there is more than one the ``closures`` BSDF adds them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from spectral_core.render.mitsuba_scene import paint
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.mitsuba_scene.fluorescent import fluorescent_lobes
from spectral_core.render.mitsuba_scene.glow import emission, is_dark, sheen_clear, weight_texture
from spectral_core.render.mitsuba_scene.leaf_rows import grouped
from spectral_core.scene import (
    Color,
    Diffuse,
    Fluorescent,
    Glass,
    Glossy,
    Holdout,
    Metal,
    Paint,
    Principled,
    Scalar,
    Sheen,
    Subsurface,
    Surface,
    Toon,
    Translucent,
    Transparent,
    Weight,
    weighted_leaves,
)
from spectral_core.spectra.spectrum import Spectrum

__all__ = ["bsdf", "emission", "is_dark"]

MIRROR_ROUGHNESS = 0.03
"""Cycles treats rougher-than-this as rough; below it a surface is a sharp mirror (alpha² under 5e-7)."""


def bsdf(context: Context, surface: Surface | None, subject: str) -> Any:
    """Mitsuba BSDF of what a surface scatters: black where it only emits, clear where there is no surface at all."""
    if surface is None:
        return context.load({"type": "null"})
    parts = [
        (*part, rows, cursor)
        for weight, closure, rows, cursor in grouped(list(weighted_leaves(surface)))
        for part in _scattering(context, closure, weight, subject)
        if part[0].constant > 0
    ]
    if not parts:
        return context.load({"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.0}})
    if len(parts) == 1 and not parts[0][0].factors:
        return parts[0][1]
    description: dict[str, Any] = {"type": "closures", "count": len(parts)}
    for number, (weight, child, _, _) in enumerate(parts):
        description[f"bsdf_{number}"] = child
        description[f"weight_{number}"] = weight_texture(context, weight, subject)
    made = context.load(description)
    made.tables = [(cursor, rows) for _, _, rows, cursor in parts]
    return made


def _scattering(context: Context, closure: Any, weight: Weight, subject: str) -> Iterator[tuple[Weight, Any]]:
    """What one closure scatters, as weighted BSDFs."""
    for amount, made in _lobes(context, closure, weight, subject):
        normal = getattr(closure, "normal", None)
        if normal is not None and made.class_name() not in ("NullBSDF", "Holdout"):
            plain = isinstance(closure, Principled) and isinstance(closure.metallic, float) and closure.metallic < 0.5
            softens = plain or isinstance(closure, (Diffuse, Translucent, Subsurface))
            texture = context.computed(normal.program)
            made = context.load({"type": "bent", "bsdf": made, "normal": texture, "softens": softens})
        yield amount, made


def _lobes(context: Context, closure: Any, weight: Weight, subject: str) -> Iterator[tuple[Weight, Any]]:
    if isinstance(closure, Diffuse):
        yield weight, _diffuse(context, closure, subject)
    elif isinstance(closure, Fluorescent):
        yield from fluorescent_lobes(context, closure, weight, subject)
    elif isinstance(closure, Glossy):
        yield weight, _glossy(context, closure, subject)
    elif isinstance(closure, Metal):
        yield weight, _metal(context, closure, subject)
    elif isinstance(closure, Glass):
        color = paint.reflectance(context, closure.color, subject)
        made = _glass(context, (color, color, color), closure, closure.ior, subject)
        yield weight, made
    elif isinstance(closure, Transparent):
        color = paint.reflectance(context, closure.color, subject)
        yield weight, context.load({"type": "tinted_null", "color": color})
    elif isinstance(closure, Sheen):
        yield weight, _sheen(context, (closure.color, closure.roughness, closure.microfiber), subject)
    elif isinstance(closure, Holdout):
        context.has_holdouts = True
        yield weight, context.load({"type": "holdout"})
    elif isinstance(closure, Translucent):
        color = paint.reflectance(context, closure.color, subject)
        yield weight, context.load({"type": "blender_translucent", "color": color})
    elif isinstance(closure, Toon):
        size, smooth = (paint.scalar_texture(context, value, subject) for value in (closure.size, closure.smooth))
        color = paint.reflectance(context, closure.color, subject)
        toon = {"type": "blender_toon", "color": color, "size": size, "smooth": smooth, "glossy": closure.glossy}
        yield weight, context.load(toon)
    elif isinstance(closure, Subsurface):
        medium = (closure.radius, closure.scale, closure.scattering_anisotropy)
        made = _subsurface(context, closure.color, medium, subject)
        yield weight, made or _diffuse(context, Diffuse(closure.color), subject)
    elif isinstance(closure, Principled):
        yield from _principled(context, closure, weight, subject)


def _diffuse(context: Context, closure: Diffuse, subject: str) -> Any:
    reflectance = paint.reflectance(context, closure.color, subject)
    if closure.roughness != 0:
        roughness = paint.scalar_texture(context, closure.roughness, subject)
        return context.load({"type": "rough_diffuse", "color": reflectance, "roughness": roughness})
    return context.load({"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": reflectance}})


def _subsurface(
    context: Context, color: Paint, medium: tuple[tuple[float, float, float], Scalar, float], subject: str
) -> Any | None:
    """Light below the surface (radius, scale, anisotropy); None, with a note, where no path walks there."""
    if not context.walks_below:
        context.note(subject, "light below the surface is shown as diffuse where media or volumes are in the scene")
        return None
    radius, scale, anisotropy = medium
    context.has_subsurface = True
    description = {
        "type": "subsurface",
        "color": paint.reflectance(context, color, subject),
        "scale": paint.scalar_texture(context, scale, subject),
        "anisotropy": float(np.clip(anisotropy, -0.99, 0.99)),
        **{f"radius_{k}": float(max(value, 0.0)) for k, value in enumerate(radius)},
    }
    return context.load(description)


def _is_smooth(roughness: Scalar) -> bool:
    return isinstance(roughness, (int, float)) and roughness < MIRROR_ROUGHNESS


def _direction(context: Context, anisotropy: Scalar, rotation: Scalar, tangent: Any, subject: str) -> dict[str, Any]:
    """What makes a lobe anisotropic, nothing where it is not."""
    if anisotropy == 0 or tangent is None:
        return {}
    return {
        "anisotropy": paint.scalar_texture(context, anisotropy, subject),
        "rotation": paint.scalar_texture(context, rotation, subject),
        "tangent": context.computed(tangent.program),
    }


def _glossy(context: Context, closure: Glossy, subject: str) -> Any:
    color = paint.reflectance(context, closure.color, subject)
    if _is_smooth(closure.roughness):
        mirror = {"type": "conductor", "material": "none", "specular_reflectance": color}
        return context.load({"type": "twosided", "bsdf": mirror})
    description = {
        "type": "blender_glossy",
        "color": color,
        "roughness": paint.scalar_texture(context, closure.roughness, subject),
        "keeps_energy": closure.multiple_scattering,
        "distribution": closure.distribution,
        **_direction(context, closure.anisotropy, closure.rotation, closure.tangent, subject),
    }
    return context.load(description)


def _metal(context: Context, closure: Metal, subject: str) -> Any:
    description = {
        "type": "blender_glossy",
        "color": paint.reflectance(context, closure.color, subject),
        "edge_tint": paint.reflectance(context, closure.edge_tint, subject),
        "roughness": paint.scalar_texture(context, closure.roughness, subject),
        "keeps_energy": closure.multiple_scattering,
        **_direction(context, closure.anisotropy, closure.rotation, closure.tangent, subject),
    }
    return context.load(description)


def _glass(
    context: Context,
    colors: tuple[Any, Any, Any],
    closure: Glass | Principled,
    ior: float | Spectrum,
    subject: str,
) -> Any:
    roughness = closure.roughness
    if isinstance(ior, Spectrum):
        texture, nominal = paint.sampled_spectrum(context, ior), float(ior.at(589.3)) or 1.5
    else:
        texture, nominal = context.load({"type": "uniform", "value": float(ior)}), float(ior)
    smooth = _is_smooth(roughness)
    description = {
        "type": "blender_glass",
        "reflection_color": colors[0],
        "transmission_color": colors[1],
        "ior": texture,
        "nominal_ior": nominal,
        "smooth": smooth,
        "reflects": getattr(closure, "reflects", True),
        "keeps_energy": closure.multiple_scattering,
    }
    if not smooth:
        description["facet_color"] = colors[2]
        description["roughness"] = paint.scalar_texture(context, roughness, subject)
    return context.load(description)


def _principled(context: Context, closure: Principled, weight: Weight, subject: str) -> Iterator[tuple[Weight, Any]]:
    opaque = weight.times(closure.alpha)
    if closure.sheen_weight != 0:
        sheen = (closure.sheen_tint, closure.sheen_roughness, True)
        yield opaque.times(closure.sheen_weight), _sheen(context, sheen, subject)
        opaque = opaque.times(sheen_clear(context, closure, subject))
    if closure.alpha != 1.0:
        yield weight.times(closure.alpha, complement=True), context.load({"type": "null"})
    base = paint.reflectance(context, closure.base_color, subject)
    ior = _specular_ior(closure)
    if closure.transmission != 0:
        through = opaque.times(closure.metallic, complement=True).times(closure.transmission)
        white = context.load({"type": "uniform", "value": 1.0})
        # light passes two surfaces on its way through a body, so each takes half of the color
        half_tint = context.load({"type": "root_paint", "color": base})
        glass_ior = closure.ior if isinstance(closure.ior, Spectrum) else ior
        yield through, _glass(context, (white, half_tint, base), closure, glass_ior, subject)
    # metal keeps its full share; transmission takes its share from what is not metal
    kept = opaque if closure.transmission == 0 else opaque.times(closure.transmission, complement=True)
    reflecting = {
        "type": "blender_principled",
        "base_color": base,
        "metallic": paint.scalar_texture(context, closure.metallic, subject),
        "roughness": paint.scalar_texture(context, closure.roughness, subject),
        "ior": ior,
        "coat_roughness": paint.scalar_texture(context, closure.coat_roughness, subject),
        "coat_ior": float(closure.coat_ior),
        "keeps_energy": closure.multiple_scattering,
        **_direction(context, closure.anisotropic, closure.anisotropic_rotation, closure.tangent, subject),
    }
    if closure.coat_weight != 0:
        reflecting["coat_weight"] = paint.scalar_texture(context, closure.coat_weight, subject)
    if not _is_white(closure.specular_tint):
        tint = paint.reflectance(context, closure.specular_tint, subject)
        reflecting |= {"specular_tint": tint, "edge_tint": tint}
    if not _is_white(closure.coat_tint):
        reflecting["coat_tint"] = paint.reflectance(context, closure.coat_tint, subject)
    if closure.diffuse_roughness != 0:
        reflecting["diffuse_roughness"] = paint.scalar_texture(context, closure.diffuse_roughness, subject)
    if closure.subsurface_weight != 0:
        medium = (closure.subsurface_radius, closure.subsurface_scale, closure.subsurface_anisotropy)
        below = _subsurface(context, closure.base_color, medium, subject)
        if below is not None:
            weight_below = paint.scalar_texture(context, closure.subsurface_weight, subject)
            reflecting |= {"subsurface": below, "subsurface_weight": weight_below}
    yield kept, context.load(reflecting)
    if closure.transmission != 0 and closure.metallic != 0:
        one = context.load({"type": "uniform", "value": 1.0})
        metal = opaque.times(closure.transmission).times(closure.metallic)
        yield metal, context.load({**reflecting, "metallic": one})


def _sheen(context: Context, made_of: tuple[Paint, Scalar, bool], subject: str) -> Any:
    color, roughness, microfiber = made_of
    description = {
        "type": "blender_sheen",
        "color": paint.reflectance(context, color, subject),
        "roughness": paint.scalar_texture(context, roughness, subject),
        "ashikhmin": not microfiber,
    }
    return context.load(description)


def _is_white(color: Any) -> bool:
    return isinstance(color, Color) and bool(np.all(color.linear_rgb == 1))


def _specular_ior(closure: Principled) -> float:
    """Index of refraction that gives the specular level its reflectance: F0 times twice the level (Blender 4)."""
    ior = closure.ior if isinstance(closure.ior, float | int) else float(closure.ior.at(589.3)) or 1.5
    if closure.specular_level == 0.5:
        return float(ior)
    normal = float(np.clip(((ior - 1) / (ior + 1)) ** 2 * 2 * closure.specular_level, 0.0, 0.99))
    raised = (1 + np.sqrt(normal)) / (1 - np.sqrt(normal))
    return float(raised if ior >= 1 else 1 / raised)
