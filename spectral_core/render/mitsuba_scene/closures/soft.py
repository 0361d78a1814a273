# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffuse surfaces, fibers, and light below the surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from spectral_core.render.mitsuba_scene import paint
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.plugins.closures.sheen import sheen_tables
from spectral_core.render.plugins.surfaces.sources import Albedos, Lobe, Number, Source
from spectral_core.scene import Computed, Diffuse, Paint, Scalar, SubsurfaceModel


def diffuse(context: Context, closure: Diffuse, subject: str) -> Lobe:
    color = paint.color(context, closure.color, subject, bright=True)
    if closure.roughness == 0:
        return Lobe("diffuse", {"color": color})
    return Lobe("rough_diffuse", {"color": color, "roughness": paint.number(context, closure.roughness, subject)})


@dataclass(frozen=True, slots=True, eq=False)
class Below:
    """The medium below a surface; ``squares``: True if the alpha of the facets is the roughness squared."""

    color: Paint
    radius: tuple[float, float, float] | Computed
    scale: Scalar
    anisotropy: Scalar
    ior: Scalar
    roughness: Scalar
    model: SubsurfaceModel
    squares: bool = False


def subsurface(context: Context, below: Below, subject: str) -> Lobe | None:
    """Subsurface scattering; None if light leaves where it entered."""
    radius: dict[str, Source] = {}
    if isinstance(below.radius, Computed):
        radius["radius"] = paint.vector(below.radius.program)
    else:
        if max(below.radius) <= 0 or (isinstance(below.scale, float) and below.scale <= 0):
            return None
        radius = {f"radius_{k}": Number(float(max(value, 0.0))) for k, value in enumerate(below.radius)}
    context.has_subsurface = True
    context.has_disks |= below.model == "burley"
    numbers = {name: getattr(below, name) for name in ("scale", "anisotropy", "ior", "roughness")}
    return Lobe(
        "subsurface",
        {
            "color": paint.color(context, below.color, subject),
            **radius,
            **{name: paint.number(context, value, subject) for name, value in numbers.items()},
            "model": below.model,
            "squares": below.squares,
        },
    )


def sheen(context: Context, made_of: tuple[Paint, Scalar, bool], subject: str) -> Lobe:
    color, roughness, microfiber = made_of
    inputs: dict[str, Any] = {
        "color": paint.color(context, color, subject),
        "roughness": paint.number(context, roughness, subject),
        "ashikhmin": not microfiber,
    }
    if microfiber:
        inputs |= {name: Albedos(values) for name, values in sheen_tables().items()}
    return Lobe("blender_sheen", inputs)
