# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces as Mitsuba's BSDFs, and what they emit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from spectral_core.render.mitsuba_export import paints
from spectral_core.render.mitsuba_export import xml_elements as xml
from spectral_core.render.mitsuba_export.draft import Draft
from spectral_core.render.mitsuba_export.principled import principled
from spectral_core.render.mitsuba_export.reflective import clear, glass, glossy, metal, two_sided
from spectral_core.scene import (
    AddSurface,
    Color,
    Diffuse,
    EllipseHair,
    Emission,
    Fluorescent,
    Glass,
    Glossy,
    Hair,
    HairLobe,
    Holdout,
    Metal,
    MixSurface,
    Principled,
    RayPortal,
    Sheen,
    Subsurface,
    SumSurface,
    Surface,
    Toon,
    Translucent,
    Transparent,
    Weight,
    gray,
    weighted_leaves,
)
from spectral_core.spectra.spectrum import Spectrum

DEEPEST_MIX = 64
"""Mixes inside each other that are written; Mitsuba loads nested BSDFs recursively."""


def bsdf(draft: Draft, surface: Surface | None, subject: str) -> xml.Element:
    """The BSDF of a surface; one that light passes unchanged for None."""
    if surface is None:
        draft.has_clear_surfaces = True
        return xml.plugin("bsdf", "null")
    return _surface(draft, surface, subject, 0)


def emitter(draft: Draft, surface: Surface | None, subject: str) -> xml.Element | None:
    """The emitter of a shape with a surface; None if the surface is dark."""
    terms: list[tuple[Any, float]] = []
    for weight, leaf in weighted_leaves(surface):
        if isinstance(leaf, Emission):
            color, strength = leaf.color, leaf.strength
        elif isinstance(leaf, Principled) and leaf.emission_strength != 0:
            color, strength = leaf.emission_color, leaf.emission_strength
            weight = weight.times(leaf.alpha)
        else:
            continue
        if not isinstance(strength, (int, float)) or weight.varying:
            draft.note(subject, "emits light of a strength that varies over the surface; its mean is written")
        factor = _mean_weight(weight) * _mean(strength)
        if factor > 0:
            terms.append((color, factor))
    if not terms:
        return None
    draft.note(subject, "emits light from the front of its faces only; Blender's surfaces emit from both sides")
    return xml.plugin("emitter", "area", _radiance(draft, terms, subject))


def _mean_weight(weight: Weight) -> float:
    factor = float(weight.constant)
    for value, complement in weight.varying:
        factor *= 1 - _mean(value) if complement else _mean(value)
    return factor


def _mean(value: Any) -> float:
    if isinstance(value, (int, float)):
        return float(value)
    return float(np.mean(value.typical)) if hasattr(value, "typical") else float(paints.color_pixels(value).mean())


def _radiance(draft: Draft, terms: list[tuple[Any, float]], subject: str) -> xml.Element:
    if len(terms) == 1:
        return paints.emission(draft, "radiance", terms[0][0], terms[0][1], subject)
    if all(isinstance(color, (Color, Spectrum)) for color, _ in terms):
        total = sum(paints.emitted_rgb(color) * factor for color, factor in terms)
        if not all(isinstance(color, Color) for color, _ in terms):
            draft.note(subject, "adds emissions of several spectra; their color is written")
        return paints.emission(draft, "radiance", Color(np.asarray(total)), 1.0, subject)
    draft.note(subject, "adds several emissions with images; the strongest is written")
    color, factor = max(terms, key=lambda term: term[1])
    return paints.emission(draft, "radiance", color, factor, subject)


def _surface(draft: Draft, surface: Surface, subject: str, depth: int) -> xml.Element:
    if depth > DEEPEST_MIX:
        draft.note(subject, f"mixes more than {DEEPEST_MIX} surfaces inside each other; deeper ones are left out")
        return _black(draft)
    if isinstance(surface, MixSurface):
        return _mix(draft, surface, subject, depth)
    if isinstance(surface, AddSurface):
        return _sum(draft, surface, subject, depth)
    if isinstance(surface, SumSurface):
        shares = [(_mean_weight(weight), part) for weight, part in surface.parts if not isinstance(part, Emission)]
        draft.note(subject, "adds surfaces with weights; the means of their weights, with a sum of 1, are written")
        return _shares(draft, [share for share in shares if share[0] > 0], subject, depth)
    if getattr(surface, "normal", None) is not None:
        draft.note(subject, "its bump or normal map is left out; Mitsuba's need an image of heights or normals")
    return CLOSURES[type(surface)](draft, surface, subject)


def _mix(draft: Draft, surface: MixSurface, subject: str, depth: int) -> xml.Element:
    if isinstance(surface.factor, (int, float)) and surface.factor in (0, 1):
        return _surface(draft, surface.second if surface.factor else surface.first, subject, depth)
    for part, other, is_second in (
        (surface.first, surface.second, False),
        (surface.second, surface.first, True),
    ):
        if _is_clear(part):  # as a mask, through which shadow rays pass
            draft.has_clear_surfaces = True
            opacity = paints.amount(draft, "opacity", surface.factor, subject, complement=is_second)
            return xml.plugin("bsdf", "mask", opacity, _surface(draft, other, subject, depth + 1))
    parts = (_surface(draft, part, subject, depth + 1) for part in (surface.first, surface.second))
    return xml.plugin("bsdf", "blendbsdf", paints.amount(draft, "weight", surface.factor, subject), *parts)


def _is_clear(surface: Surface) -> bool:
    return isinstance(surface, Transparent) and _is_white(surface.color)


def _is_white(color: Any) -> bool:
    return isinstance(color, Color) and bool(np.all(color.linear_rgb == 1))


def _sum(draft: Draft, surface: AddSurface, subject: str, depth: int) -> xml.Element:
    lit = [part for part in (surface.first, surface.second) if not isinstance(part, Emission)]
    if len(lit) < 2:  # the emitter of the shape has the other
        return _surface(draft, lit[0], subject, depth + 1) if lit else _black(draft)
    draft.note(subject, "adds two surfaces; Mitsuba mixes only, so half of each is written")
    parts = (_surface(draft, part, subject, depth + 1) for part in lit)
    return xml.plugin("bsdf", "blendbsdf", xml.number("weight", 0.5), *parts)


def _shares(draft: Draft, shares: list[tuple[float, Surface]], subject: str, depth: int) -> xml.Element:
    """A blend of surfaces in proportion to their shares, halved until each is alone."""
    if len(shares) < 2:
        return _surface(draft, shares[0][1], subject, depth + 1) if shares else _black(draft)
    ends = shares[: len(shares) // 2], shares[len(shares) // 2 :]
    first, second = (sum(share for share, _ in end) for end in ends)
    parts = (_shares(draft, end, subject, depth + 1) for end in ends)
    return xml.plugin("bsdf", "blendbsdf", xml.number("weight", second / (first + second)), *parts)


def _diffuse(draft: Draft, closure: Any, subject: str) -> xml.Element:
    if isinstance(closure, Diffuse):
        draft.leftover(subject, closure, {"color", "normal"})
    return two_sided(xml.plugin("bsdf", "diffuse", paints.reflectance(draft, "reflectance", closure.color, subject)))


def _black(draft: Draft, *_: Any) -> xml.Element:
    return _diffuse(draft, Diffuse(gray(0.0)), "")


def _nearest_diffuse(name: str) -> Callable[[Draft, Any, str], xml.Element]:
    def convert(draft: Draft, closure: Any, subject: str) -> xml.Element:
        draft.note(subject, f"{name} has no counterpart in Mitsuba; a diffuse surface of its color is written")
        return _diffuse(draft, replace(Diffuse(), color=closure.color), subject)

    return convert


def _translucent(draft: Draft, closure: Translucent, subject: str) -> xml.Element:
    """Mitsuba's thin Principled, which transmits diffusely, without its reflection."""
    color = paints.reflectance(draft, "base_color", closure.color, subject)
    return xml.plugin(
        "bsdf", "principledthin", color, xml.number("diff_trans", 2.0), xml.number("eta", 1.0001),
        xml.number("roughness", 1.0), xml.number("spec_trans", 0.0),
    )  # fmt: skip


def _holdout(draft: Draft, _closure: Holdout, subject: str) -> xml.Element:
    draft.note(subject, "Holdout has no counterpart in Mitsuba; a black surface is written")
    return _black(draft)


def _portal(draft: Draft, _closure: RayPortal, subject: str) -> xml.Element:
    draft.note(subject, "Ray Portal has no counterpart in Mitsuba; a black surface is written")
    return _black(draft)


CLOSURES: dict[type, Callable[[Draft, Any, str], xml.Element]] = {
    Diffuse: _diffuse,
    Emission: _black,
    Fluorescent: _nearest_diffuse("a fluorescent surface"),
    Glass: glass,
    Glossy: glossy,
    EllipseHair: _nearest_diffuse("the scattering of hair"),
    Hair: _nearest_diffuse("the scattering of hair"),
    HairLobe: _nearest_diffuse("the scattering of hair"),
    Holdout: _holdout,
    Metal: metal,
    Principled: principled,
    RayPortal: _portal,
    Sheen: _nearest_diffuse("Sheen BSDF"),
    Subsurface: _nearest_diffuse("light below the surface"),
    Toon: _nearest_diffuse("Toon BSDF"),
    Translucent: _translucent,
    Transparent: clear,
}
