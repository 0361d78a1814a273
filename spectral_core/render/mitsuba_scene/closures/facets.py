# SPDX-License-Identifier: GPL-3.0-or-later
"""Mirrors, metals and glass, smooth or of microfacets."""

from __future__ import annotations

from typing import Any

from spectral_core.render.mitsuba_scene import paint
from spectral_core.render.mitsuba_scene.closures.dielectric import (
    facet_inputs,
    facing_inputs,
    film_inputs,
    glass_inputs,
)
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.plugins.surfaces.sources import Lobe, Source
from spectral_core.scene import Computed, Glass, Glossy, Metal, Principled, Scalar
from spectral_core.spectra.spectrum import Spectrum

MIRROR_ROUGHNESS = 0.03
"""Roughness from which Cycles treats a surface as rough; below it, it is a perfect mirror (alpha² under 5e-7)."""


def is_smooth(roughness: Scalar, *, by_size: bool = False) -> bool:
    """True for a mirror; ``by_size``: a negative roughness counts as a positive one, as in Cycles' Refraction."""
    return isinstance(roughness, (int, float)) and (abs(roughness) if by_size else roughness) < MIRROR_ROUGHNESS


def direction(context: Context, anisotropy: Scalar, rotation: Scalar, tangent: Any, subject: str) -> dict[str, Any]:
    """Inputs of an anisotropic lobe; none for an isotropic one."""
    if anisotropy == 0:
        return {}
    if tangent is None:
        context.note(subject, "is anisotropic without a tangent, so it reflects evenly; give it a tangent")
        return {}
    return {
        "anisotropy": paint.number(context, anisotropy, subject),
        "rotation": paint.number(context, rotation, subject),
        "tangent": paint.vector(tangent.program),
    }


def glossy(context: Context, closure: Glossy, subject: str) -> Lobe:
    color = paint.color(context, closure.color, subject, bright=True)
    smooth = is_smooth(closure.roughness)
    sharp = Lobe("mirror", {"color": color})
    if smooth and not context.filter_glossy:
        return sharp
    inputs = {
        "color": color,
        "roughness": paint.number(context, closure.roughness, subject),
        "keeps_energy": closure.multiple_scattering and not smooth,  # as Cycles, which blurs after it kept energy
        "distribution": closure.distribution,
        **facet_inputs(),
        **direction(context, closure.anisotropy, closure.rotation, closure.tangent, subject),
    }
    rough = Lobe("blender_glossy", inputs)
    return Lobe("filtered", {"sharp": sharp, "rough": rough}) if smooth else rough


def metal(context: Context, closure: Metal, subject: str) -> Lobe:
    inputs = {
        "color": paint.color(context, closure.color, subject),
        "edge_tint": paint.color(context, closure.edge_tint, subject),
        "roughness": paint.number(context, closure.roughness, subject),
        "keeps_energy": closure.multiple_scattering,
        "physical": closure.physical,
        "edge_scale": closure.edge_scale,
        "distribution": closure.distribution,
        **facet_inputs(),
        **direction(context, closure.anisotropy, closure.rotation, closure.tangent, subject),
        **film_inputs(context, closure, subject),
    }
    return Lobe("blender_glossy", inputs)


def glass(
    context: Context,
    colors: tuple[Source, Source],
    closure: Glass | Principled,
    ior: float | Spectrum | Computed,
    subject: str,
    *,
    halves: bool = False,
    specular_tint: Source | None = None,
) -> Lobe:
    """``colors``: of the reflection, and of the transmission. ``specular_tint``: at normal incidence."""
    # with the same index on both sides facets bend no light, as in Cycles
    is_straight = isinstance(ior, (int, float)) and ior == 1.0 and closure.thin_film_thickness == 0
    refracts_only = isinstance(closure, Glass) and not closure.reflects
    smooth = is_straight or is_smooth(closure.roughness, by_size=refracts_only)
    given = (context, colors, closure, ior, subject)
    keeps = closure.multiple_scattering
    if isinstance(closure, Glass):  # the tables are those of GGX that reflects and refracts
        keeps = keeps and closure.reflects and closure.distribution == "ggx"
    made = _glass(given, smooth=smooth, keeps_energy=keeps, halves=halves, tint=specular_tint)
    if is_straight or not (smooth and context.filter_glossy):
        return made
    rough = _glass(given, smooth=False, keeps_energy=False, halves=halves, tint=specular_tint)
    return Lobe("filtered", {"sharp": made, "rough": rough})


def _glass(given: tuple[Any, ...], *, smooth: bool, keeps_energy: bool, halves: bool, tint: Source | None) -> Lobe:
    """Glass of discrete directions (``smooth``) or of facets."""
    context, colors, closure, ior, subject = given
    disperses = isinstance(ior, Spectrum) and context.spectral
    inputs = {
        "reflection_color": colors[0],
        "transmission_color": colors[1],
        "disperses": disperses,
        "smooth": smooth,
        "halves": halves,
        "reflects": getattr(closure, "reflects", True),
        "keeps_energy": keeps_energy,
        **glass_inputs(context, ior, subject, keeps_energy=keeps_energy and not smooth),
        **film_inputs(context, closure, subject, passes=True),
    }
    if tint is not None:
        inputs["specular_tint"] = tint
    if not smooth:
        inputs["distribution"] = getattr(closure, "distribution", "ggx")
        inputs["roughness"] = paint.number(context, closure.roughness, subject)
        if closure.thin_film_thickness != 0:
            inputs |= facet_inputs()
        elif tint is not None and keeps_energy:
            inputs |= facet_inputs() | facing_inputs(passes=True)
    return Lobe("blender_glass", inputs)
