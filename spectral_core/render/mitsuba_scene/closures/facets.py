# SPDX-License-Identifier: GPL-3.0-or-later
"""Mirrors, metals and glass, smooth or of microfacets."""

from __future__ import annotations

from typing import Any

from spectral_core.render.mitsuba_scene import paint
from spectral_core.render.mitsuba_scene.closures.dielectric import facet_inputs, film_inputs, glass_inputs
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.plugins.surfaces.sources import Lobe, Source
from spectral_core.scene import Glass, Glossy, Metal, Principled, Scalar
from spectral_core.spectra.spectrum import Spectrum

MIRROR_ROUGHNESS = 0.03
"""Roughness from which Cycles treats a surface as rough; below it, it is a perfect mirror (alpha² under 5e-7)."""


def is_smooth(roughness: Scalar) -> bool:
    return isinstance(roughness, (int, float)) and roughness < MIRROR_ROUGHNESS


def direction(context: Context, anisotropy: Scalar, rotation: Scalar, tangent: Any, subject: str) -> dict[str, Any]:
    """Inputs of an anisotropic lobe; none for an isotropic one."""
    if anisotropy == 0 or tangent is None:
        return {}
    return {
        "anisotropy": paint.number(context, anisotropy, subject),
        "rotation": paint.number(context, rotation, subject),
        "tangent": paint.vector(tangent.program),
    }


def glossy(context: Context, closure: Glossy, subject: str) -> Lobe:
    color = paint.color(context, closure.color, subject)
    if is_smooth(closure.roughness):
        return Lobe("mirror", {"color": color})
    inputs = {
        "color": color,
        "roughness": paint.number(context, closure.roughness, subject),
        "keeps_energy": closure.multiple_scattering,
        "distribution": closure.distribution,
        **facet_inputs(),
        **direction(context, closure.anisotropy, closure.rotation, closure.tangent, subject),
    }
    return Lobe("blender_glossy", inputs)


def metal(context: Context, closure: Metal, subject: str) -> Lobe:
    inputs = {
        "color": paint.color(context, closure.color, subject),
        "edge_tint": paint.color(context, closure.edge_tint, subject),
        "roughness": paint.number(context, closure.roughness, subject),
        "keeps_energy": closure.multiple_scattering,
        "physical": closure.physical,
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
    ior: float | Spectrum,
    subject: str,
    *,
    halves: bool = False,
    specular_tint: Source | None = None,
) -> Lobe:
    """``colors``: of the reflection, and of the transmission. ``specular_tint``: at normal incidence."""
    roughness = closure.roughness
    smooth = is_smooth(roughness)
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
        **film_inputs(context, closure, subject, passes=True),
    }
    if specular_tint is not None:
        inputs["specular_tint"] = specular_tint
    if not smooth:
        inputs["distribution"] = getattr(closure, "distribution", "ggx")
        inputs["facet_color"] = colors[1]
        inputs["roughness"] = paint.number(context, roughness, subject)
        if closure.thin_film_thickness != 0:
            inputs |= facet_inputs()
    return Lobe("blender_glass", inputs)
