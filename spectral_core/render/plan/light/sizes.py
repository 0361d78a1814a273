# SPDX-License-Identifier: GPL-3.0-or-later
"""Largest values of paints, lights and reflectances: what bounds are made of."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np

from spectral_core.errors import InvalidInputError
from spectral_core.render.mitsuba_scene.paint import emitted_rgb
from spectral_core.scene import (
    Color,
    Computed,
    Diffuse,
    DrawnPattern,
    Fluorescent,
    Glossy,
    ImageTexture,
    Metal,
    MixedPaint,
    Principled,
    Sheen,
    SpectralImage,
    Subsurface,
    Toon,
    Translucent,
)
from spectral_core.scene.paint import some_colors
from spectral_core.scene.surface import Closure
from spectral_core.spectra.spectrum import Spectrum

_DIFFUSE = (Diffuse, Sheen, Subsurface, Toon, Translucent)
"""Closures that reflect or transmit light in many directions; those of mirrors and glass have bounces of their own."""
MOST_REFLECTANCE = 0.98
"""Largest share of light that a surface is taken to keep; a series of bounces at 1 would not end."""


def in_a_room(reflectance: Any, most: int) -> Any:
    """Light on the surfaces of a closed room of one reflectance, an array, after up to ``most`` reflections, 1 for the
    first.
    """
    kept = np.clip(MOST_REFLECTANCE * reflectance, 0.0, MOST_REFLECTANCE)
    return (1 - kept**most) / (1 - kept)


def paint_parts(paint: Any) -> Iterator[Any]:
    """The components of a mixed paint, or the paint itself."""
    if isinstance(paint, MixedPaint):
        for part in (paint.factor, paint.first, paint.second):
            yield from paint_parts(part)
    else:
        yield paint


def largest_size(paint: Any) -> float:
    """Largest magnitude of a paint in any channel or at any wavelength; at least 1 for a program."""
    if isinstance(paint, MixedPaint):
        return max(map(largest_size, paint_parts(paint)))
    if isinstance(paint, Color):
        return float(np.abs(paint.linear_rgb).max())
    if isinstance(paint, Spectrum):
        return float(paint.values.max())
    if isinstance(paint, ImageTexture) and paint.pixels.dtype != np.uint8:
        least = 1.0 if isinstance(paint, DrawnPattern) else 0.0  # its details may be brighter than its pixels
        return float(np.max(np.abs(paint.pixels[..., :3]), initial=least))
    if isinstance(paint, Computed):
        return max(1.0, float(np.abs(paint.typical).max()))
    return 1.0 if isinstance(paint, (Computed, ImageTexture, SpectralImage)) else 0.0


def largest_light(paint: Any) -> float:
    """Largest magnitude of the light that a paint of strength 1 emits, in any channel.

    A spectrum is emitted with Y = 1 whatever the unit of its values.
    """
    if isinstance(paint, MixedPaint):
        return max(map(largest_light, paint_parts(paint)))
    return _largest_channel(paint) if isinstance(paint, Spectrum) else largest_size(paint)


@lru_cache(256)
def _largest_channel(light: Spectrum) -> float:
    """The same of a spectrum; many lamps have one in common. 0 for one without luminance, which no renderer takes."""
    try:
        return float(np.abs(emitted_rgb(light)).max())
    except InvalidInputError:
        return 0.0


def largest_reflectance(closure: Closure) -> float:
    """Largest share of light that a closure scatters in many directions."""
    if isinstance(closure, Fluorescent):
        return 1.0
    return max(map(_share, paint_parts(closure.color))) if isinstance(closure, _DIFFUSE) else 0.0


def largest_share(closure: Closure) -> float:
    """Largest share of light that a closure sends back, by mirrors too; clear glass and holes let it pass."""
    if isinstance(closure, Principled):
        return 0.0 if closure.transmission == 1.0 else _share(closure.base_color)
    if isinstance(closure, (Glossy, Metal)):
        return max(map(_share, paint_parts(closure.color)))
    return largest_reflectance(closure)


def _share(paint: Any) -> float:
    if isinstance(paint, ImageTexture):  # an even white one reflects more than most
        return min(max(0.9, float(some_colors(paint.pixels, paint.color_space).max(axis=1).mean())), 1.0)
    varies = isinstance(paint, (Computed, SpectralImage))
    return min(max(0.9, float(np.max(getattr(paint, "typical", 0.9)))) if varies else largest_size(paint), 1.0)
