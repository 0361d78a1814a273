# SPDX-License-Identifier: GPL-3.0-or-later
"""The spectrum of a material, assigned to the closures whose color it replaces."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from spectral_core.scene import (
    Computed,
    Diffuse,
    Glass,
    Glossy,
    ImageTexture,
    Metal,
    MixedPaint,
    Principled,
    SpectralImage,
    Surface,
    Toon,
    Translucent,
    Transparent,
    leaves,
    map_leaves,
    values_of,
)
from spectral_core.scene.surface import Closure
from spectral_core.spectra.spectrum import Illuminant, Spectrum

from ..surfaces import BLACK


def with_spectrum(surface: Surface, spectrum: Spectrum) -> Surface:
    """The surface with the spectrum of its material in place of its main color.

    The main color is that of what scatters diffusely (Principled and Diffuse); where nothing does, of every closure
    that reflects or lets through.
    """
    main: tuple[type, ...] = (Principled, Diffuse)
    if not any(isinstance(leaf, main) and leaf is not BLACK for leaf in leaves(surface)):
        main = (Glossy, Metal, Glass, Translucent, Toon, Transparent)

    def change(leaf: Closure) -> Surface:
        name = "base_color" if isinstance(leaf, Principled) else "color"
        # a node's own spectrum, or spectra, come before its material's
        own = (Illuminant, Spectrum, SpectralImage)
        if leaf is BLACK or not isinstance(leaf, main) or isinstance(getattr(leaf, name), own):
            return leaf
        changes: dict[str, Any] = {name: spectrum}
        return replace(leaf, **changes)

    return map_leaves(surface, change)


def covers_texture(surface: Surface, spectrum: Spectrum) -> bool:
    """True if ``spectrum`` stands where the surface has an image or a pattern, as ``with_spectrum`` puts it."""
    held = {id(value) for value in values_of(with_spectrum(surface, spectrum))}
    lost = (value for value in values_of(surface) if id(value) not in held)
    return any(isinstance(value, (ImageTexture, MixedPaint, Computed)) for value in lost)
