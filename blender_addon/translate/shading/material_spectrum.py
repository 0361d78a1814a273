# SPDX-License-Identifier: GPL-3.0-or-later
"""The spectrum of a material, assigned to the closures whose color it replaces."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from spectral_core.scene import (
    Diffuse,
    Glass,
    Glossy,
    Metal,
    Principled,
    Surface,
    Toon,
    Translucent,
    Transparent,
    leaves,
    map_leaves,
)
from spectral_core.scene.surface import Closure
from spectral_core.spectra.spectrum import Illuminant, Spectrum

from .surfaces import BLACK


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
        # a node's own spectrum comes before its material's
        if leaf is BLACK or not isinstance(leaf, main) or isinstance(getattr(leaf, name), (Illuminant, Spectrum)):
            return leaf
        changes: dict[str, Any] = {name: spectrum}
        return replace(leaf, **changes)

    return map_leaves(surface, change)
