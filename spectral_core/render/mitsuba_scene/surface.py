# SPDX-License-Identifier: GPL-3.0-or-later
"""Closures as Mitsuba BSDFs, and what a surface emits."""

from __future__ import annotations

from typing import Any

from spectral_core.render.mitsuba_scene import paint
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.scene import Diffuse, Surface


def bsdf(context: Context, surface: Surface | None, subject: str) -> Any:
    """Mitsuba BSDF of what a surface scatters; a surface that only emits is black."""
    if isinstance(surface, Diffuse):
        return _two_sided(
            context, {"type": "diffuse", "reflectance": paint.reflectance(context, surface.color, subject)}
        )
    raise NotImplementedError(type(surface))


def _two_sided(context: Context, description: dict[str, Any]) -> Any:
    return context.load({"type": "twosided", "bsdf": description})
