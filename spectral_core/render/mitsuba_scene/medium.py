# SPDX-License-Identifier: GPL-3.0-or-later
"""Participating media inside meshes, and the one that the camera stands in."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.mitsuba_scene import paint
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.scene import Color, ScatteringMedium
from spectral_core.spectra.spectrum import Spectrum

MOST_SURFACES = 256


def medium_object(context: Context, medium: ScatteringMedium, subject: str) -> Any | None:
    """Mitsuba's homogeneous medium; None where there is nothing in it."""
    if medium.emission_strength != 0:
        context.note(subject, "has a glowing volume; its glow is left out")
    if medium.density <= 0:
        return None
    color = medium.color
    if not isinstance(color, (Color, Spectrum)):
        context.note(subject, "has a volume whose color varies; it is rendered gray")
        color = Color(np.full(3, 0.5))
    return context.load(
        {
            "type": "homogeneous",
            "sigma_t": float(medium.density),
            "albedo": {"type": "constvolume", "value": paint.reflectance(context, color, subject)},
            "phase": {"type": "hg", "g": float(np.clip(medium.anisotropy, -0.99, 0.99))},
            "has_spectral_extinction": False,  # extinction is gray, which lets the integrator skip a weight
        }
    )


def medium_around(mitsuba: Any, scene: Any, media: Sequence[Any], point: NDArray[np.float64]) -> Any | None:
    """Which of ``media`` is at ``point`` (3,): behind the first boundary that a ray from there meets."""
    import drjit

    position = mitsuba.Point3f(*(float(value) for value in point))
    direction = drjit.normalize(mitsuba.Vector3f(0.3, 0.9, -0.33))  # any, but along no edge of a box
    ray = mitsuba.Ray3f(position, direction)
    for _ in range(MOST_SURFACES):
        hit = scene.ray_intersect(ray)
        if not np.any(hit.is_valid()):
            return None
        if np.any(hit.is_medium_transition()):
            leaves = np.any(drjit.dot(hit.n, direction) > 0)
            if not leaves:
                return None
            inside = hit.shape.interior_medium()
            return next((medium for medium in media if np.any(inside == medium)), None)
        ray = hit.spawn_ray(direction)
    return None
