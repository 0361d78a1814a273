# SPDX-License-Identifier: GPL-3.0-or-later
"""The scalar variants' stand-ins for our own plugins: Mitsuba's nearest built-in ones.

Traced ray by ray, a plugin written in Python would take a hundred times as long. The stand-ins differ in what each
row of ``STAND_INS`` says; paints stay exact.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Description = dict[str, Any]

STAND_INS = {
    "blender_ball": "balls light without Blender's soft falloff and without a cone",
    "blender_spot": "the soft edge of spots falls off linearly",
    "blender_area": "emitting surfaces emit from their front only, area lights without spread",
    "rough_diffuse": "rough diffuse surfaces are smooth",
    "blender_glossy": "rough reflections lose what bounces between facets",
    "blender_principled": "Principled surfaces follow Disney's formulas",
    "closures": "mixes by an image are mixed half and half, sums above 1 are scaled down",
    "blender_glass": "rough glass loses what bounces between facets, and nothing disperses",
}


def stand_in(mitsuba: Any, description: Description) -> Description:
    """``description`` with Mitsuba's nearest plugin where its own has one; else as it is."""
    make = _MAKERS.get(description["type"])
    return description if make is None else make(mitsuba, description)


def _number(mitsuba: Any, texture: Any) -> float:
    """Value of a constant texture; the middle where it varies."""
    if isinstance(texture, float | int):
        return float(texture)
    parameters = mitsuba.traverse(texture)
    return float(parameters["value"]) if "value" in parameters else 0.5


def _two_sided(description: Description) -> Description:
    return {"type": "twosided", "bsdf": description}


def _emitter(mitsuba: Any, description: Description) -> Description:
    return {"type": "area", "radiance": description["radiance"]}


def _spot(mitsuba: Any, description: Description) -> Description:
    center, axis = np.array(description["center"]), np.array(description["axis"])
    up = np.eye(3)[int(np.argmin(np.abs(axis)))]
    transform = mitsuba.ScalarTransform4f().look_at(
        origin=[float(v) for v in center], target=[float(v) for v in center + axis], up=[float(v) for v in up]
    )
    half = float(np.degrees(np.arccos(np.clip(description["cosine"], -1, 1))))
    inner = 1 - (1 - description["cosine"]) * (1 - description["blend"])
    return {
        "type": "spot",
        "intensity": description["intensity"],
        "to_world": transform,
        "cutoff_angle": min(half, 89.9),
        "beam_width": min(float(np.degrees(np.arccos(np.clip(inner, -1, 1)))), half * 0.999, 89.8),
    }


def _rough_diffuse(mitsuba: Any, description: Description) -> Description:
    return _two_sided({"type": "diffuse", "reflectance": description["color"]})


def _glossy(mitsuba: Any, description: Description) -> Description:
    alpha = max(_number(mitsuba, description["roughness"]) ** 2, 1e-3)
    rough = {"type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": alpha}
    return _two_sided({**rough, "specular_reflectance": description["color"]})


def _principled(mitsuba: Any, description: Description) -> Description:
    names = ("base_color", "metallic", "roughness")
    coat = float(description["coat_weight"])
    layers = {"clearcoat": coat, "clearcoat_gloss": 1 - float(description["coat_roughness"])} if coat > 0 else {}
    ior = max(float(description["ior"]), 1.001)
    return _two_sided({"type": "principled", "eta": ior, **{name: description[name] for name in names}, **layers})


def _glass(mitsuba: Any, description: Description) -> Description:
    glass: Description = {
        "type": "dielectric" if description["smooth"] else "roughdielectric",
        "int_ior": float(description["nominal_ior"]),
        "ext_ior": 1.0,
        "specular_reflectance": description["reflection_color"],
        "specular_transmittance": description["transmission_color"],
    }
    if not description["smooth"]:
        alpha = max(_number(mitsuba, description["roughness"]) ** 2, 1e-3)
        glass |= {"distribution": "ggx", "alpha": alpha}
    return glass


def _closures(mitsuba: Any, description: Description) -> Description:
    """A chain of two-way blends; what the weights lack to 1 is black."""
    count = description["count"]
    weights = [_number(mitsuba, description[f"weight_{k}"]) for k in range(count)]
    total = max(1.0, sum(weights))
    chain: Any = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.0}}
    below = total - sum(weights)
    for k, weight in enumerate(weights):
        below += weight
        if weight >= below:
            chain = description[f"bsdf_{k}"]
        elif weight > 0:
            chain = {"type": "blendbsdf", "weight": weight / below, "a": chain, "b": description[f"bsdf_{k}"]}
    return chain if isinstance(chain, dict) else {"type": "blendbsdf", "weight": 0.0, "a": chain, "b": chain}


_MAKERS: dict[str, Callable[[Any, Description], Description]] = {
    "blender_ball": _emitter,
    "blender_spot": _spot,
    "blender_area": _emitter,
    "rough_diffuse": _rough_diffuse,
    "blender_glossy": _glossy,
    "blender_principled": _principled,
    "blender_glass": _glass,
    "closures": _closures,
}
