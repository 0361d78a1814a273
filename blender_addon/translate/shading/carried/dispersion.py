# SPDX-License-Identifier: GPL-3.0-or-later
"""The dispersion of a material, in the closures that refract light."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from spectral_core.scene import IOR, Computed, Glass, Principled, Surface, leaves, map_leaves, nominal_ior
from spectral_core.scene.surface import Closure
from spectral_core.spectra.refraction import bubble_in, index_by_abbe, named_index
from spectral_core.spectra.spectrum import Spectrum

from ...context import Translation


def with_dispersion(translation: Translation, surface: Surface | None, material: Any) -> Surface | None:
    """The surface with indices of refraction that vary with wavelength in Glass, Refraction and in Principled with
    transmission. A shader's index below 1 is that of a bubble in a named material.

    A note says so if there is no such shader, or if an index varies over the surface, which has no Abbe number.
    """
    spectral = getattr(material, "spectral", None)
    chosen = None if spectral is None else spectral.dispersion
    if chosen is None or chosen.source == "NONE":
        return surface
    if surface is None or not any(_refracts(leaf) for leaf in leaves(surface)):
        translation.note(
            material.name, "has dispersion, but no Glass or Refraction shader, and no Principled one with transmission"
        )
        return surface
    named = named_index(chosen.material) if chosen.source == "NAMED" else None

    def change(leaf: Closure) -> Surface:
        if not isinstance(leaf, (Glass, Principled)) or not _refracts(leaf):
            return leaf
        varies = isinstance(leaf.ior, Computed)
        if named is not None:
            is_bubble = not varies and nominal_ior(leaf.ior) < 1.0
            return replace(leaf, ior=bubble_in(named) if is_bubble else named)
        if varies:
            translation.note(
                material.name, "its index of refraction varies over the surface, so its dispersion is left out; "
                "unlink IOR, or choose a named material",
            )  # fmt: skip
            return leaf
        index = nominal_ior(leaf.ior)
        # an index of 1 refracts nothing at any wavelength
        return leaf if index == 1.0 else replace(leaf, ior=_within(index_by_abbe(index, chosen.abbe_number)))

    return map_leaves(surface, change)


def _within(index: Spectrum) -> Spectrum:
    """An index of refraction within the limits of a shader's, at all wavelengths."""
    return replace(index, values=np.clip(index.values, *IOR))


def _refracts(leaf: Closure) -> bool:
    if isinstance(leaf, Principled):
        return not isinstance(leaf.transmission, float) or leaf.transmission > 0  # a texture, or a number
    return isinstance(leaf, Glass)
