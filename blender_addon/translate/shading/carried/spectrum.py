# SPDX-License-Identifier: GPL-3.0-or-later
"""The spectrum of a material, assigned to the closures whose color it replaces."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from spectral_core.scene import (
    Computed,
    Diffuse,
    EllipseHair,
    Glass,
    Glossy,
    Hair,
    HairLobe,
    ImageTexture,
    Metal,
    MixedPaint,
    Principled,
    Sheen,
    SpectralImage,
    Subsurface,
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

DIFFUSE: tuple[type, ...] = (Principled, Diffuse, Subsurface)
OTHERS: tuple[type, ...] = (
    Glossy, Metal, Glass, Translucent, Toon, Transparent, Sheen, Hair, EllipseHair, HairLobe,
)  # fmt: skip
"""Closures with a main color: those that scatter diffusely, and those that reflect or transmit otherwise."""


def with_spectrum(surface: Surface, spectrum: Spectrum) -> Surface:
    """The surface with the spectrum of its material in place of its main color.

    The main color belongs to the closures that scatter diffusely; without these, to every closure that reflects or
    transmits. Hair has the color of a coat of many fibers then, also in place of pigments.
    """
    main = DIFFUSE
    if not any(isinstance(leaf, main) and leaf is not BLACK for leaf in leaves(surface)):
        main = OTHERS

    def change(leaf: Closure) -> Surface:
        name = "base_color" if isinstance(leaf, Principled) else "color"
        # a node's spectra have precedence over its material's
        own = (Illuminant, Spectrum, SpectralImage)
        if leaf is BLACK or not isinstance(leaf, main) or isinstance(getattr(leaf, name), own):
            return leaf
        changes: dict[str, Any] = {name: spectrum}
        if isinstance(leaf, (Hair, EllipseHair)):
            changes |= {"is_fur": True, "depth": 1.0}
        return replace(leaf, **changes)

    return map_leaves(surface, change)


def has_main_color(surface: Surface) -> bool:
    """True if a closure of the surface has a main color."""
    return any(isinstance(leaf, DIFFUSE + OTHERS) and leaf is not BLACK for leaf in leaves(surface))


def covers_texture(surface: Surface, spectrum: Spectrum) -> bool:
    """True if ``spectrum`` replaces an image or a pattern of the surface in ``with_spectrum``."""
    held = {id(value) for value in values_of(with_spectrum(surface, spectrum))}
    lost = (value for value in values_of(surface) if id(value) not in held)
    return any(isinstance(value, (ImageTexture, MixedPaint, Computed)) for value in lost)
