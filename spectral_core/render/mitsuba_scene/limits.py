# SPDX-License-Identifier: GPL-3.0-or-later
"""Reflectances outside the range that a surface can have: they are rendered at the limit, with a note."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.scene import Color
from spectral_core.spectra.spectrum import Reflectance, Spectrum
from spectral_core.spectra.upsample import distance_from_light, is_outside

Array = NDArray[np.float64]
_UNLIKE = 0.05
"""Least error of a channel that is noted: the primaries of ACEScg have up to 0.03."""


def held(context: Context, rgb: Array, subject: str) -> Array:
    """Linear sRGB (3,) of a reflectance; values outside 0 to 1 are clipped, with a note under ``subject``."""
    if rgb.min() < 0 or rgb.max() > 1:
        context.note(subject, "has a color outside 0 to 1, which no surface reflects; it is rendered at the limit")
    return np.clip(rgb, 0.0, 1.0)


def without_negative(context: Context, rgb: Any, subject: str, what: str = "has a color") -> Any:
    """Linear sRGB (..., 3) without the negative channels of a color outside of sRGB, with a note under ``subject``."""
    if is_outside(rgb):
        text = "outside of sRGB; negative channels are rendered as 0, which lowers the saturation"
        context.note(subject, f"{what} {text}")
    return np.maximum(rgb, 0.0)


def note_unlike_light(context: Context, paint: Any, white: Spectrum, subject: str) -> None:
    """Note an emitted color that no light has, such as one beyond the purples; it is rendered as the nearest."""
    if context.spectral and isinstance(paint, Color) and distance_from_light(paint.linear_rgb, white) > _UNLIKE:
        context.note(subject, "emits a color that no light has; the nearest color of a light is rendered")


def held_spectrum(context: Context, paint: Spectrum, subject: str, *, bright: bool = False) -> Spectrum:
    """A reflectance given as a spectrum; values outside 0 to 1 are clipped, with a note under ``subject``.

    ``bright``: True if values above 1 are allowed.
    """
    low, high = float(paint.values.min()), float(paint.values.max())
    most = max(high, 1.0) if bright else 1.0
    if low >= 0 and high <= most:
        return paint
    if low < -Reflectance.TOLERANCE or high > most + Reflectance.TOLERANCE:
        text = "has a reflectance outside 0 to 1 at some wavelengths, where it is rendered at the limit"
        context.note(subject, text)
    return replace(paint, values=np.clip(paint.values, 0.0, most))
