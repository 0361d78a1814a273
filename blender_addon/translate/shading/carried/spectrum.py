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

    The main color belongs to the closures that scatter diffusely (Principled and Diffuse); without these, to every
    closure that reflects or transmits.
    """
    main: tuple[type, ...] = (Principled, Diffuse)
    if not any(isinstance(leaf, main) and leaf is not BLACK for leaf in leaves(surface)):
        main = (Glossy, Metal, Glass, Translucent, Toon, Transparent)

    def change(leaf: Closure) -> Surface:
        name = "base_color" if isinstance(leaf, Principled) else "color"
        # a node's spectra have precedence over its material's
        own = (Illuminant, Spectrum, SpectralImage)
        if leaf is BLACK or not isinstance(leaf, main) or isinstance(getattr(leaf, name), own):
            return leaf
        changes: dict[str, Any] = {name: spectrum}
        return replace(leaf, **changes)

    return map_leaves(surface, change)


def covers_texture(surface: Surface, spectrum: Spectrum) -> bool:
    """True if ``spectrum`` replaces an image or a pattern of the surface in ``with_spectrum``."""
    held = {id(value) for value in values_of(with_spectrum(surface, spectrum))}
    lost = (value for value in values_of(surface) if id(value) not in held)
    return any(isinstance(value, (ImageTexture, MixedPaint, Computed)) for value in lost)
