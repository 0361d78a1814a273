# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffuse surfaces, fibers, and light below the surface."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.render.mitsuba_scene import paint
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.plugins.closures.sheen import sheen_tables
from spectral_core.render.plugins.surfaces.sources import Albedos, Lobe, Number
from spectral_core.scene import Diffuse, Paint, Scalar


def diffuse(context: Context, closure: Diffuse, subject: str) -> Lobe:
    color = paint.color(context, closure.color, subject, bright=True)
    if closure.roughness == 0:
        return Lobe("diffuse", {"color": color})
    return Lobe("rough_diffuse", {"color": color, "roughness": paint.number(context, closure.roughness, subject)})


def subsurface(
    context: Context, color: Paint, medium: tuple[tuple[float, float, float], Scalar, float], subject: str
) -> Lobe | None:
    """Subsurface scattering (radius, scale, anisotropy); None, with a note, if the integrator does not support it."""
    if not context.walks_below:
        context.note(subject, "light below the surface is shown as diffuse where media or volumes are in the scene")
        return None
    radius, scale, anisotropy = medium
    if max(radius) <= 0 or (isinstance(scale, float) and scale <= 0):
        return None  # light leaves where it entered: as diffuse light
    context.has_subsurface = True
    inputs = {
        "color": paint.color(context, color, subject),
        "scale": paint.number(context, scale, subject),
        "anisotropy": Number(float(np.clip(anisotropy, -0.99, 0.99))),
        **{f"radius_{k}": Number(float(max(value, 0.0))) for k, value in enumerate(radius)},
    }
    return Lobe("subsurface", inputs)


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
