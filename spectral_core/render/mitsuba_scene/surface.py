# SPDX-License-Identifier: GPL-3.0-or-later
"""Closures as rows of the scene's one BSDF, and what a surface emits.

A tree of mixes and sums is a list of closures with weights, as in Cycles; each closure becomes one leaf.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import Any

import numpy as np

from spectral_core.render.mitsuba_scene import paint
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.mitsuba_scene.dielectric import coat_inputs, facet_inputs, glass_inputs, specular_inputs
from spectral_core.render.mitsuba_scene.fluorescent import fluorescent_lobes
from spectral_core.render.mitsuba_scene.glow import emission, is_dark, sheen_clear
from spectral_core.render.plugins.closures.sheen import sheen_tables
from spectral_core.render.plugins.surfaces.sources import Albedos, Lobe, Number, Source, Tint
from spectral_core.render.plugins.surfaces.table import Leaf
from spectral_core.scene import (
    Color,
    Diffuse,
    Emission,
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
    Translucent,
    Transparent,
    Weight,
    weighted_leaves,
)
from spectral_core.scene.surface import Closure
from spectral_core.spectra.spectrum import Spectrum

__all__ = ["emission", "is_dark", "leaves_of"]

MIRROR_ROUGHNESS = 0.03
"""Cycles treats rougher-than-this as rough; below it a surface is a sharp mirror (alpha² under 5e-7)."""


def leaves_of(context: Context, surface: Surface | None, subject: str) -> list[Leaf]:
    """The weighted closures that scatter light at a surface; a clear one for None, a black one if it only emits."""
    if surface is None:
        return [Leaf(Lobe("clear", {}), 1.0)]
    parts = [
        _leaf(context, weight, lobe, subject)
        for part, closure in weighted_leaves(surface)
        for weight, lobe in _scattering(context, closure, part, subject)
        if weight.constant > 0
    ]
    return parts or [Leaf(Lobe("diffuse", {"color": Tint(np.zeros(3))}), 1.0)]


def _leaf(context: Context, weight: Weight, lobe: Lobe, subject: str) -> Leaf:
    factors = ((paint.number(context, value, subject), complement) for value, complement in weight.varying)
    return Leaf(lobe, weight.constant, tuple(factors))


def _scattering(context: Context, closure: Any, weight: Weight, subject: str) -> Iterator[tuple[Weight, Lobe]]:
    """The weighted lobes of one closure, bent where it has a normal of its own."""
    for amount, made in _lobes(context, closure, weight, subject):
        normal = getattr(closure, "normal", None)
        if normal is not None and made.name not in ("clear", "holdout"):
            plain = isinstance(closure, Principled) and isinstance(closure.metallic, float) and closure.metallic < 0.5
            softens = plain or isinstance(closure, (Diffuse, Translucent, Subsurface))
            made = Lobe("bent", {"closure": made, "normal": paint.vector(normal.program), "softens": softens})
        yield amount, made


def _lobes(context: Context, closure: Any, weight: Weight, subject: str) -> Iterator[tuple[Weight, Lobe]]:
    if isinstance(closure, Diffuse):
        yield weight, _diffuse(context, closure, subject)
    elif isinstance(closure, Fluorescent):
        yield from fluorescent_lobes(context, closure, weight, subject)
    elif isinstance(closure, Glossy):
        yield weight, _glossy(context, closure, subject)
    elif isinstance(closure, Metal):
        yield weight, _metal(context, closure, subject)
    elif isinstance(closure, Glass):
        color = paint.color(context, closure.color, subject)
        yield weight, _glass(context, (color, color), closure, closure.ior, subject)
    elif isinstance(closure, Transparent):
        yield weight, Lobe("tinted_clear", {"color": paint.color(context, closure.color, subject)})
    elif isinstance(closure, Holdout):
        context.has_holdouts = True
        yield weight, Lobe("holdout", {})
    elif isinstance(closure, Sheen):
        yield weight, _sheen(context, (closure.color, closure.roughness, closure.microfiber), subject)
    elif isinstance(closure, Subsurface):
        medium = (closure.radius, closure.scale, closure.scattering_anisotropy)
        made = _subsurface(context, closure.color, medium, subject)
        yield weight, made or _diffuse(context, Diffuse(closure.color), subject)
    elif isinstance(closure, Principled):
        yield from _principled(context, closure, weight, subject)
    elif not isinstance(closure, Emission):
        yield weight, _lobe_of_fields(context, closure, subject)


def _lobe_of_fields(context: Context, closure: Closure, subject: str) -> Lobe:
    """The plugin that is named after a closure's class (``Toon``: ``blender_toon``), with its fields as inputs."""
    inputs: dict[str, Any] = {}
    for entry in fields(closure):
        value = getattr(closure, entry.name)
        if entry.type == "Paint":
            inputs[entry.name] = paint.color(context, value, subject)
        elif entry.type == "Scalar":
            inputs[entry.name] = paint.number(context, value, subject)
        elif entry.name != "normal":  # ``_scattering`` bends every closure that has one
            inputs[entry.name] = value
    return Lobe(f"blender_{type(closure).__name__.lower()}", inputs)


def _diffuse(context: Context, closure: Diffuse, subject: str) -> Lobe:
    color = paint.color(context, closure.color, subject)
    if closure.roughness == 0:
        return Lobe("diffuse", {"color": color})
    return Lobe("rough_diffuse", {"color": color, "roughness": paint.number(context, closure.roughness, subject)})


def _subsurface(
    context: Context, color: Paint, medium: tuple[tuple[float, float, float], Scalar, float], subject: str
) -> Lobe | None:
    """Light below the surface (radius, scale, anisotropy); None, with a note, where no path walks there."""
    if not context.walks_below:
        context.note(subject, "light below the surface is shown as diffuse where media or volumes are in the scene")
        return None
    radius, scale, anisotropy = medium
    context.has_subsurface = True
    inputs = {
        "color": paint.color(context, color, subject),
        "scale": paint.number(context, scale, subject),
        "anisotropy": Number(float(np.clip(anisotropy, -0.99, 0.99))),
        **{f"radius_{k}": Number(float(max(value, 0.0))) for k, value in enumerate(radius)},
    }
    return Lobe("subsurface", inputs)


def _is_smooth(roughness: Scalar) -> bool:
    return isinstance(roughness, (int, float)) and roughness < MIRROR_ROUGHNESS


def _direction(context: Context, anisotropy: Scalar, rotation: Scalar, tangent: Any, subject: str) -> dict[str, Any]:
    """What makes a lobe anisotropic, nothing where it is not."""
    if anisotropy == 0 or tangent is None:
        return {}
    return {
        "anisotropy": paint.number(context, anisotropy, subject),
        "rotation": paint.number(context, rotation, subject),
        "tangent": paint.vector(tangent.program),
    }


def _glossy(context: Context, closure: Glossy, subject: str) -> Lobe:
    color = paint.color(context, closure.color, subject)
    if _is_smooth(closure.roughness):
        return Lobe("mirror", {"color": color})
    inputs = {
        "color": color,
        "roughness": paint.number(context, closure.roughness, subject),
        "keeps_energy": closure.multiple_scattering,
        "distribution": closure.distribution,
        **facet_inputs(),
        **_direction(context, closure.anisotropy, closure.rotation, closure.tangent, subject),
    }
    return Lobe("blender_glossy", inputs)


def _metal(context: Context, closure: Metal, subject: str) -> Lobe:
    inputs = {
        "color": paint.color(context, closure.color, subject),
        "edge_tint": paint.color(context, closure.edge_tint, subject),
        "roughness": paint.number(context, closure.roughness, subject),
        "keeps_energy": closure.multiple_scattering,
        **facet_inputs(),
        **_direction(context, closure.anisotropy, closure.rotation, closure.tangent, subject),
    }
    return Lobe("blender_glossy", inputs)


def _glass(
    context: Context,
    colors: tuple[Source, Source],
    closure: Glass | Principled,
    ior: float | Spectrum,
    subject: str,
    *,
    halves: bool = False,
) -> Lobe:
    """``colors``: what is reflected, and what passes."""
    roughness = closure.roughness
    smooth = _is_smooth(roughness)
    disperses = isinstance(ior, Spectrum) and context.spectral
    inputs = {
        "reflection_color": colors[0],
        "transmission_color": colors[1],
        "disperses": disperses,
        "smooth": smooth,
        "halves": halves,
        "reflects": getattr(closure, "reflects", True),
        "keeps_energy": closure.multiple_scattering,
        **glass_inputs(context, ior, smooth=smooth),
    }
    if not smooth:
        inputs["facet_color"] = colors[1]
        inputs["roughness"] = paint.number(context, roughness, subject)
    return Lobe("blender_glass", inputs)


def _principled(context: Context, closure: Principled, weight: Weight, subject: str) -> Iterator[tuple[Weight, Lobe]]:
    opaque = weight.times(closure.alpha)
    if closure.sheen_weight != 0:
        sheen = (closure.sheen_tint, closure.sheen_roughness, True)
        yield opaque.times(closure.sheen_weight), _sheen(context, sheen, subject)
        opaque = opaque.times(sheen_clear(context, closure, subject))
    if closure.alpha != 1.0:
        yield weight.times(closure.alpha, complement=True), Lobe("clear", {})
    base = paint.color(context, closure.base_color, subject)
    ior = _specular_ior(closure)
    if closure.transmission != 0:
        through = opaque.times(closure.metallic, complement=True).times(closure.transmission)
        # light passes two surfaces on its way through a body, so each takes half of the color
        glass_ior = closure.ior if isinstance(closure.ior, Spectrum) else ior
        yield through, _glass(context, (Tint(np.ones(3)), base), closure, glass_ior, subject, halves=True)
    # metal keeps its full share; transmission takes its share from what is not metal
    kept = opaque if closure.transmission == 0 else opaque.times(closure.transmission, complement=True)
    reflecting = {
        "base_color": base,
        "metallic": paint.number(context, closure.metallic, subject),
        "roughness": paint.number(context, closure.roughness, subject),
        "keeps_energy": closure.multiple_scattering,
        **facet_inputs(),
        **specular_inputs(ior, closure.multiple_scattering),
        **_direction(context, closure.anisotropic, closure.anisotropic_rotation, closure.tangent, subject),
    }
    if closure.coat_weight != 0:
        reflecting |= {
            "coat_weight": paint.number(context, closure.coat_weight, subject),
            "coat_roughness": paint.number(context, closure.coat_roughness, subject),
            **coat_inputs(float(closure.coat_ior)),
        }
    if not _is_white(closure.specular_tint):
        tint = paint.color(context, closure.specular_tint, subject)
        reflecting |= {"specular_tint": tint, "edge_tint": tint}
    if not _is_white(closure.coat_tint):
        reflecting["coat_tint"] = paint.color(context, closure.coat_tint, subject)
    if closure.diffuse_roughness != 0:
        reflecting["diffuse_roughness"] = paint.number(context, closure.diffuse_roughness, subject)
    if closure.subsurface_weight != 0:
        medium = (closure.subsurface_radius, closure.subsurface_scale, closure.subsurface_anisotropy)
        below = _subsurface(context, closure.base_color, medium, subject)
        if below is not None:
            weight_below = paint.number(context, closure.subsurface_weight, subject)
            reflecting |= {"subsurface": below, "subsurface_weight": weight_below}
    yield kept, Lobe("blender_principled", reflecting)
    if closure.transmission != 0 and closure.metallic != 0:
        metal = opaque.times(closure.transmission).times(closure.metallic)
        yield metal, Lobe("blender_principled", {**reflecting, "metallic": Number(1.0)})


def _sheen(context: Context, made_of: tuple[Paint, Scalar, bool], subject: str) -> Lobe:
    color, roughness, microfiber = made_of
    inputs: dict[str, Any] = {
        "color": paint.color(context, color, subject),
        "roughness": paint.number(context, roughness, subject),
        "ashikhmin": not microfiber,
    }
    if microfiber:
        inputs |= {name: Albedos(values) for name, values in sheen_tables().items()}
    return Lobe("blender_sheen", inputs)


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
