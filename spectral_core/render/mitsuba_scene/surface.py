# SPDX-License-Identifier: GPL-3.0-or-later
"""Closures as rows of the scene's one BSDF.

A tree of mixes and sums is a list of closures with weights, as in Cycles; each closure becomes one leaf.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import Any

import numpy as np

from spectral_core.render.mitsuba_scene import paint
from spectral_core.render.mitsuba_scene.closures.dielectric import glass_inputs
from spectral_core.render.mitsuba_scene.closures.facets import glass, glossy, metal
from spectral_core.render.mitsuba_scene.closures.principled import principled
from spectral_core.render.mitsuba_scene.closures.soft import Below, diffuse, sheen, subsurface
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.mitsuba_scene.emission import emission, is_dark
from spectral_core.render.mitsuba_scene.fluorescent import fluorescent_lobes
from spectral_core.render.plugins.surfaces.sources import Lobe, Tint
from spectral_core.render.plugins.surfaces.table import Leaf
from spectral_core.scene import (
    Computed,
    Diffuse,
    EllipseHair,
    Emission,
    Fluorescent,
    Glass,
    Glossy,
    Holdout,
    Metal,
    Principled,
    RayPortal,
    Sheen,
    Subsurface,
    Surface,
    Toon,
    Translucent,
    Transparent,
    Weight,
    weighted_leaves,
)
from spectral_core.scene.shading.program import Instruction, OnRaised, Program, Raised
from spectral_core.scene.surface import Closure

__all__ = ["emission", "is_dark", "leaves_of"]

NOWHERE = Program((Instruction("vector", values=(0.0, 0.0, 0.0)),))
"""A direction that is not given."""
HERE = Program((Instruction("vector_input", settings=("position", 0)),))
"""The place of a hit."""


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
    """The weighted lobes of one closure, with its normal if it has one."""
    for amount, made in _lobes(context, closure, weight, subject):
        normal = getattr(closure, "normal", None)
        if normal is not None and made.name not in ("clear", "holdout"):
            fades = not isinstance(normal, Raised)
            is_sheen = isinstance(closure, Principled) and made.name == "blender_sheen"
            softens = fades and (is_sheen or _is_diffuse(closure))
            bent = {"normal": paint.vector(normal.program), "softens": softens, "fades": fades}
            made = Lobe("bent", {"closure": made, **bent})
            if isinstance(normal, OnRaised):
                around = {"normal": paint.vector(normal.surface.program), "softens": False, "fades": False}
                made = Lobe("bent", {"closure": made, **around})
        yield amount, made


def _is_diffuse(closure: Any) -> bool:
    """True for what Cycles calls diffuse: such light fades toward the horizon of a smooth surface."""
    if isinstance(closure, Toon):
        return not closure.glossy
    return closure.microfiber if isinstance(closure, Sheen) else isinstance(closure, (Diffuse, Translucent, Subsurface))


def _lobes(context: Context, closure: Any, weight: Weight, subject: str) -> Iterator[tuple[Weight, Lobe]]:
    if isinstance(closure, Diffuse):
        yield weight, diffuse(context, closure, subject)
    elif isinstance(closure, Fluorescent):
        yield from fluorescent_lobes(context, closure, weight, subject)
    elif isinstance(closure, Glossy):
        yield weight, glossy(context, closure, subject)
    elif isinstance(closure, Metal):
        yield weight, metal(context, closure, subject)
    elif isinstance(closure, Glass):
        color = paint.color(context, closure.color, subject, bright=True)
        yield weight, glass(context, (color, color), closure, closure.ior, subject)
    elif isinstance(closure, Transparent):
        yield weight, Lobe("tinted_clear", {"color": paint.color(context, closure.color, subject, bright=True)})
    elif isinstance(closure, Holdout):
        context.has_holdouts = True
        yield weight, Lobe("holdout", {})
    elif isinstance(closure, Sheen):
        yield weight, sheen(context, (closure.color, closure.roughness, closure.microfiber), subject)
    elif isinstance(closure, Subsurface):
        anisotropy, facets = closure.scattering_anisotropy, (closure.ior, closure.roughness)
        below = Below(closure.color, closure.radius, closure.scale, anisotropy, *facets, closure.model)
        made = subsurface(context, below, subject)
        yield weight, made or diffuse(context, Diffuse(closure.color), subject)
    elif isinstance(closure, Principled):
        yield from principled(context, closure, weight, subject)
    elif isinstance(closure, EllipseHair):
        made = _lobe_of_fields(context, closure, subject)
        ior = closure.ior if isinstance(closure.ior, Computed) else paint.typical_number(closure.ior)
        tables = glass_inputs(context, ior, subject, keeps_energy=True)
        yield weight, Lobe(made.name, {**tables, **made.parts})
    elif not isinstance(closure, Emission):
        yield weight, _lobe_of_fields(context, closure, subject)


def _lobe_of_fields(context: Context, closure: Closure, subject: str) -> Lobe:
    """The plugin that is named after a closure's class (``Toon``: ``blender_toon``), with its fields as inputs."""
    inputs: dict[str, Any] = {}
    for entry in fields(closure):
        value = getattr(closure, entry.name)
        if entry.type == "Paint":
            inputs[entry.name] = paint.color(
                context, value, subject, bright=isinstance(closure, (RayPortal, Translucent, Toon))
            )
        elif entry.type == "Scalar":
            inputs[entry.name] = paint.number(context, value, subject)
        elif entry.name == "position":
            inputs[entry.name] = paint.vector(HERE if value is None else value.program)
        elif entry.name in ("tangent", "edge", "major_axis", "direction"):
            inputs[entry.name] = paint.vector(NOWHERE if value is None else value.program)
        elif entry.name != "normal":  # ``_scattering`` bends every closure that has one
            inputs[entry.name] = value
    return Lobe(f"blender_{type(closure).__name__.lower()}", inputs)
