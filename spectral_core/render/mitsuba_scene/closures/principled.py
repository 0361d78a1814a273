# SPDX-License-Identifier: GPL-3.0-or-later
"""The Principled BSDF as lobes: sheen, glass, and an opaque rest under its coat."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from spectral_core.render.mitsuba_scene import paint
from spectral_core.render.mitsuba_scene.closures.dielectric import (
    coat_inputs,
    facet_inputs,
    film_inputs,
    specular_inputs,
    varying_specular_inputs,
)
from spectral_core.render.mitsuba_scene.closures.facets import direction, glass
from spectral_core.render.mitsuba_scene.closures.soft import Below, sheen, subsurface
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.mitsuba_scene.emission import sheen_clear
from spectral_core.render.plugins.surfaces.sources import Lobe, Number, Source, Tint
from spectral_core.scene import Color, Computed, Principled, Weight, nominal_ior, specular_ior


def principled(context: Context, closure: Principled, weight: Weight, subject: str) -> Iterator[tuple[Weight, Lobe]]:
    opaque = weight.times(closure.alpha)
    if closure.sheen_weight != 0:
        fibers = (closure.sheen_tint, closure.sheen_roughness, True)
        yield opaque.times(closure.sheen_weight), sheen(context, fibers, subject)
        opaque = opaque.times(sheen_clear(context, closure, subject, closure.normal))
    if closure.alpha != 1.0:
        yield weight.times(closure.alpha, complement=True), Lobe("clear", {})
    base = paint.color(context, closure.base_color, subject, bright=True)
    ior = gloss_ior(closure)
    if closure.transmission != 0:
        through = opaque.times(closure.metallic, complement=True).times(closure.transmission)
        # light passes two surfaces on its way through a body, so each applies half of the color
        tint = _specular_tint(context, closure, subject)
        colors = (Tint(np.ones(3)), base)
        made = glass(context, colors, closure, closure.ior, subject, halves=True, specular_tint=tint)
        if closure.coat_weight == 0:
            yield through, made
        else:
            coat = _coat(context, closure, subject)
            yield through, Lobe("under_coat", {"closure": made, **facet_inputs(), **coat})
            yield through, _coat_alone(coat)
    # metal keeps its full share; transmission replaces a share of the rest
    kept = opaque if closure.transmission == 0 else opaque.times(closure.transmission, complement=True)
    reflecting = {
        "base_color": base,
        "metallic": paint.number(context, closure.metallic, subject),
        "roughness": paint.number(context, closure.roughness, subject),
        "keeps_energy": closure.multiple_scattering,
        **facet_inputs(),
        **_specular(context, closure, ior, subject),
        **direction(context, closure.anisotropic, closure.anisotropic_rotation, closure.tangent, subject),
        **film_inputs(context, closure, subject),
    }
    if closure.coat_weight != 0:
        reflecting |= _coat(context, closure, subject)
    if not _is_white(closure.specular_tint):
        tint = _specular_tint(context, closure, subject)
        reflecting |= {"specular_tint": tint, "edge_tint": tint}
    if closure.diffuse_roughness != 0:
        reflecting["diffuse_roughness"] = paint.number(context, closure.diffuse_roughness, subject)
    if closure.subsurface_weight != 0:
        below = subsurface(context, _below(closure, ior), subject)
        if below is not None:
            weight_below = paint.number(context, closure.subsurface_weight, subject)
            reflecting |= {"subsurface": below, "subsurface_weight": weight_below}
    yield kept, Lobe("blender_principled", reflecting)
    if closure.transmission != 0 and closure.metallic != 0:
        metal = opaque.times(closure.transmission).times(closure.metallic)
        yield metal, Lobe("blender_principled", {**reflecting, "metallic": Number(1.0)})


def _specular(context: Context, closure: Principled, ior: float, subject: str) -> dict[str, Any]:
    """The dielectric layer over the diffuse part, of an index of refraction that may vary."""
    keeps_energy = closure.multiple_scattering
    if not isinstance(closure.ior, Computed) and isinstance(closure.specular_level, float | int):
        return specular_inputs(ior, keeps_energy)
    index = closure.ior if isinstance(closure.ior, Computed) else nominal_ior(closure.ior)
    return varying_specular_inputs(context, (index, closure.specular_level), keeps_energy, subject)


def _below(closure: Principled, ior: float) -> Below:
    """The medium below the surface; skin has an index of refraction of its own."""
    entry_ior = closure.subsurface_ior if closure.subsurface_model == "random_walk_skin" else ior
    radius, scale, anisotropy = closure.subsurface_radius, closure.subsurface_scale, closure.subsurface_anisotropy
    facets, model = (entry_ior, closure.roughness), closure.subsurface_model
    return Below(closure.base_color, radius, scale, anisotropy, *facets, model, squares=True)


def _coat(context: Context, closure: Principled, subject: str) -> dict[str, Any]:
    """Inputs of the coat."""
    coat = {
        "coat_weight": paint.number(context, closure.coat_weight, subject),
        "coat_roughness": paint.number(context, closure.coat_roughness, subject),
        **coat_inputs(float(closure.coat_ior)),
    }
    if closure.coat_normal is not None:
        coat["coat_normal"] = paint.vector(closure.coat_normal.program)
    if not _is_white(closure.coat_tint):
        coat["coat_tint"] = paint.color(context, closure.coat_tint, subject)
    return coat


def _coat_alone(coat: dict[str, Any]) -> Lobe:
    """The reflection of a coat, over nothing."""
    nothing = {
        "base_color": Tint(np.zeros(3)),
        "metallic": Number(0.0),
        "roughness": Number(1.0),
        "keeps_energy": True,
        **facet_inputs(),
        **specular_inputs(1.0 + 1e-4, True),
    }
    return Lobe("blender_principled", nothing | coat)


def _is_white(color: Any) -> bool:
    return isinstance(color, Color) and bool(np.all(color.linear_rgb == 1))


def gloss_ior(closure: Principled) -> float:
    """Index of refraction of the layer over the diffuse part; the mean of one that varies."""
    return specular_ior(nominal_ior(closure.ior), paint.typical_number(closure.specular_level))


def _specular_tint(context: Context, closure: Principled, subject: str) -> Source | None:
    """Tint of the reflectance at normal incidence; None for white."""
    if _is_white(closure.specular_tint):
        return None
    return paint.color(context, closure.specular_tint, subject, bright=True)
