# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Principled BSDF as the nearest of Mitsuba's BSDFs."""

from __future__ import annotations

from collections.abc import Iterator

from spectral_core.render.mitsuba_export import paints
from spectral_core.render.mitsuba_export import xml_elements as xml
from spectral_core.render.mitsuba_export.draft import Draft
from spectral_core.render.mitsuba_export.reflective import interface, two_sided
from spectral_core.render.mitsuba_scene.closures.principled import gloss_ior
from spectral_core.scene import Principled, gray

_WRITTEN = {
    "base_color", "metallic", "roughness", "ior", "alpha", "specular_level", "anisotropic", "transmission",
    "coat_weight", "sheen_weight", "normal", "emission_color", "emission_strength", "anisotropic_rotation", "tangent",
    "multiple_scattering",
}  # fmt: skip
_OF_WEIGHT = {
    "sheen_weight": {"sheen_roughness", "sheen_tint"},
    "coat_weight": {"coat_roughness", "coat_ior", "coat_tint", "coat_normal"},
    "subsurface_weight": {f"subsurface_{name}" for name in ("radius", "scale", "anisotropy", "ior", "model")},
    "thin_film_thickness": {"thin_film_ior"},
}
"""Inputs without effect where a weight is 0."""


def principled(draft: Draft, closure: Principled, subject: str) -> xml.Element:
    """Mitsuba's dielectric where light only passes through, else its Principled, masked by alpha."""
    idle = {name for weight, names in _OF_WEIGHT.items() if getattr(closure, weight) == 0 for name in names}
    draft.leftover(subject, closure, _WRITTEN | idle)
    made = _body(draft, closure, subject)
    if closure.alpha == 1.0:
        return made
    draft.has_clear_surfaces = True
    return xml.plugin("bsdf", "mask", paints.amount(draft, "opacity", closure.alpha, subject), made)


def _body(draft: Draft, closure: Principled, subject: str) -> xml.Element:
    if closure.transmission == 1.0 and closure.metallic == 0.0 and closure.coat_weight == closure.sheen_weight == 0:
        # light passes two surfaces on its way through a body, so each applies half of the color
        return interface(draft, closure, (gray(1.0), closure.base_color), subject, power=0.5)
    draft.note(
        subject,
        "Principled BSDF is written as Mitsuba's `principled`, which has another diffuse part, sheen and coat, and is "
        "brighter at grazing angles",
    )
    made = xml.plugin("bsdf", "principled", *_inputs(draft, closure, subject))
    return made if closure.transmission != 0 else two_sided(made)


def _inputs(draft: Draft, closure: Principled, subject: str) -> Iterator[xml.Element]:
    yield paints.reflectance(draft, "base_color", closure.base_color, subject)
    yield xml.number("eta", max(gloss_ior(closure), 1.0001))
    names = {
        "roughness": "roughness", "metallic": "metallic", "anisotropic": "anisotropic", "transmission": "spec_trans",
        "coat_weight": "clearcoat", "sheen_weight": "sheen",
    }  # fmt: skip
    for ours, name in names.items():
        value = getattr(closure, ours)
        if value != 0 or ours == "roughness":
            yield paints.amount(draft, name, value, subject)
