# SPDX-License-Identifier: GPL-3.0-or-later
"""Participating media inside meshes, and the one that the camera stands in."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.mitsuba_scene import paint
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.trace.wavelengths import WAVELENGTHS_NM
from spectral_core.scene import Color, ScatteringMedium
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import xyz_of
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum
from spectral_core.spectra.upsample import upsampled

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
    extinction = medium.extinction
    sigma_t: Any = float(medium.density)
    if isinstance(extinction, (Color, Spectrum)):
        sigma_t = {"type": "constvolume", "value": _scaled_extinction(context, extinction, medium.density)}
    return context.load(
        {
            "type": "homogeneous",
            "sigma_t": sigma_t,
            "albedo": {"type": "constvolume", "value": paint.reflectance(context, color, subject)},
            "phase": {"type": "hg", "g": float(np.clip(medium.anisotropy, -0.99, 0.99))},
            # a gray extinction lets the integrator skip a weight
            "has_spectral_extinction": extinction is not None,
        }
    )


def _scaled_extinction(context: Context, extinction: Color | Spectrum, density: float) -> Any:
    """Texture of ``density · extinction``, which may exceed 1 per unit of length."""
    if isinstance(extinction, Color):
        rgb = np.maximum(extinction.linear_rgb, 0.0)
        if not context.spectral:
            return context.load({"type": "srgb", "color": [float(v) for v in rgb * density], "unbounded": True})
        size = float(rgb.max())
        values = upsampled(rgb / max(size, 1e-30), WAVELENGTHS_NM) * size
        extinction = Spectrum("extinction", SpectralGrid(WAVELENGTHS_NM), values)
    elif not context.spectral:
        rgb = np.clip(RGB_FROM_XYZ @ xyz_of(paint.white_light(), extinction), 0.0, None)
        return context.load({"type": "srgb", "color": [float(v) for v in rgb * density], "unbounded": True})
    return paint.sampled_spectrum(context, extinction.scaled(density))


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
