# SPDX-License-Identifier: GPL-3.0-or-later
"""Mirrors, metals, glass and clear surfaces as Mitsuba's BSDFs."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.render.mitsuba_export import paints
from spectral_core.render.mitsuba_export import xml_elements as xml
from spectral_core.render.mitsuba_export.draft import Draft
from spectral_core.render.mitsuba_scene.closures.facets import is_smooth
from spectral_core.scene import Color, Computed, Glass, Glossy, Metal, Scalar, Transparent, nominal_ior
from spectral_core.scene.surface import SODIUM_NM
from spectral_core.spectra.metal import index_of_metal
from spectral_core.spectra.spectrum import WAVELENGTHS_NM, SpectralGrid, Spectrum
from spectral_core.spectra.upsample import upsampled

_METAL_NM = WAVELENGTHS_NM[::5]


def two_sided(made: xml.Element) -> xml.Element:
    """A reflective BSDF that both sides of a surface have, as in Blender."""
    return xml.plugin("bsdf", "twosided", made)


def glossy(draft: Draft, closure: Glossy, subject: str) -> xml.Element:
    """A mirror that reflects its color at every angle."""
    draft.leftover(
        subject, closure, {"color", "roughness", "normal", "multiple_scattering", "distribution", "rotation", "tangent"}
    )
    color = paints.reflectance(draft, "specular_reflectance", closure.color, subject)
    mirror = (xml.string("material", "none"), color)
    if is_smooth(closure.roughness):
        return two_sided(xml.plugin("bsdf", "conductor", *mirror))
    if closure.distribution == "ashikhmin":
        draft.note(subject, "the distribution Ashikhmin-Shirley has no counterpart in Mitsuba; GGX is written")
    return two_sided(xml.plugin("bsdf", "roughconductor", *mirror, *_facets(draft, closure, subject)))


def metal(draft: Draft, closure: Metal, subject: str) -> xml.Element:
    """A metal by its index and extinction where it has them, else by Mitsuba's Principled."""
    used = {"color", "roughness", "normal", "multiple_scattering", "distribution", "rotation", "tangent", "physical"}
    draft.leftover(subject, closure, used | {"edge_tint", "edge_scale", "thin_film_ior"})
    color, edge = closure.color, closure.edge_tint
    if closure.physical and isinstance(color, (Color, Spectrum)) and isinstance(edge, (Color, Spectrum)):
        indices = _indices(draft, color, (edge, closure.edge_scale), subject)
        if is_smooth(closure.roughness):
            return two_sided(xml.plugin("bsdf", "conductor", *indices))
        return two_sided(xml.plugin("bsdf", "roughconductor", *indices, *_facets(draft, closure, subject)))
    draft.note(subject, "Mitsuba's metal reflects white at grazing angles; the edge tint is left out")
    return two_sided(
        xml.plugin(
            "bsdf",
            "principled",
            paints.reflectance(draft, "base_color", color, subject),
            xml.number("metallic", 1.0),
            paints.amount(draft, "roughness", closure.roughness, subject),
        )
    )


def glass(draft: Draft, closure: Glass, subject: str) -> xml.Element:
    """A dielectric."""
    draft.leftover(
        subject, closure,
        {"color", "roughness", "ior", "normal", "reflects", "multiple_scattering", "distribution", "thin_film_ior"},
    )  # fmt: skip
    if not closure.reflects:
        draft.note(subject, "Refraction BSDF transmits all light; Mitsuba's dielectric loses what it would reflect")
    reflected = Color(np.full(3, float(closure.reflects)))
    colors = (closure.color if closure.reflects else reflected, closure.color)
    return interface(draft, closure, (colors[0], colors[1]), subject)


def interface(draft: Draft, closure: Any, colors: tuple[Any, Any], subject: str, power: float = 1.0) -> xml.Element:
    """A dielectric with colors of its reflection and, raised to ``power``, of its transmission."""
    index = closure.ior
    if isinstance(index, Spectrum):
        draft.note(subject, f"its dispersion is left out; the index at {SODIUM_NM:g} nm is written")
    elif isinstance(index, Computed):
        draft.note(subject, "its index of refraction varies; the mean is written")
    index = nominal_ior(index)
    tints = (
        paints.reflectance(draft, "specular_reflectance", colors[0], subject),
        paints.reflectance(draft, "specular_transmittance", colors[1], subject, power),
    )
    indices = (xml.number("int_ior", float(index)), xml.number("ext_ior", 1.0))
    if abs(index - 1) < 1e-4:  # no interface
        return _passing(draft, tints[1])
    if is_smooth(closure.roughness):
        return xml.plugin("bsdf", "dielectric", *indices, *tints)
    return xml.plugin("bsdf", "roughdielectric", *indices, *tints, *_facets(draft, closure, subject))


def clear(draft: Draft, closure: Transparent, subject: str) -> xml.Element:
    """A surface that light passes straight on."""
    if isinstance(closure.color, Color) and np.all(closure.color.linear_rgb == 1):
        draft.has_clear_surfaces = True
        return xml.plugin("bsdf", "null")
    return _passing(draft, paints.reflectance(draft, "specular_transmittance", closure.color, subject))


def _passing(draft: Draft, color: xml.Element) -> xml.Element:
    draft.has_clear_surfaces = True
    return xml.plugin("bsdf", "thindielectric", xml.number("int_ior", 1.0), xml.number("ext_ior", 1.0), color)


def _facets(draft: Draft, closure: Any, subject: str) -> list[xml.Element]:
    """Roughness and distribution of microfacets; alpha is the square of Blender's roughness."""
    if getattr(closure, "multiple_scattering", False):
        draft.note(subject, "light that bounces between facets is left out, which darkens rough surfaces")
    kind = "beckmann" if getattr(closure, "distribution", "ggx") == "beckmann" else "ggx"
    roughness: Scalar = closure.roughness
    return [paints.amount(draft, "alpha", roughness, subject, 2.0), xml.string("distribution", kind)]


def _indices(draft: Draft, color: Any, edge: tuple[Any, float], subject: str) -> list[xml.Element]:
    """Index and extinction by Gulbrandsen 2014 of the reflectance and the edge tint with its scale, per wavelength."""
    index, extinction = index_of_metal(_sampled(color), np.clip(_sampled(edge[0]), 0.0, 1.0) * edge[1])
    grid, made = SpectralGrid(_METAL_NM), []
    for name, values in (("eta", index), ("k", np.maximum(extinction, 1e-6))):
        made.append(xml.spectrum(name, paints.spectrum_file(draft, Spectrum(f"{subject} {name}", grid, values))))
    return made


def _sampled(value: Color | Spectrum) -> Any:
    if isinstance(value, Spectrum):
        return value.at(_METAL_NM)
    return upsampled(np.clip(value.linear_rgb, 0.0, 1.0), _METAL_NM)
