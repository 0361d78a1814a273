# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that the layers of Principled above its base take from fluorescent dyes in it: gloss, film, coat and sheen.

A dye emits evenly, so that each layer counts with its mean over the hemisphere; numbers that vary count with theirs.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Color, ImageTexture, Principled, Scalar, nominal_ior, specular_ior
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.spectrum import Spectrum
from spectral_core.spectra.upsample import upsampled

Array = NDArray[np.float64]
Dyes = tuple[FluorescentDye, ...]
_COSINES: Array = (np.arange(512) + 0.5) / 512


def below_layers(leaf: Principled, dyes: Dyes) -> tuple[Dyes, list[float]]:
    """Dyes as they look below the layers of ``leaf``, and factors on their amounts."""
    weight = _typical(leaf.coat_weight)
    lost = weight * mean_reflectance(float(leaf.coat_ior))
    if leaf.sheen_weight != 0:
        tint = leaf.sheen_tint
        brightest = float(np.clip(tint.linear_rgb, 0.0, 1.0).max()) if isinstance(tint, Color) else 1.0
        lost = 1.0 - (1.0 - lost) * (1.0 - _typical(leaf.sheen_weight) * brightest * _share_of_sheen(leaf))
    factors = [(1.0 - lost) * (1.0 - _gloss(leaf))] * len(dyes)
    if weight == 0 or (isinstance(leaf.coat_tint, Color) and np.all(leaf.coat_tint.linear_rgb == 1)):
        return dyes, factors
    tinted = [_below_tint(dye, leaf, weight) for dye in dyes]
    return tuple(dye for dye, _ in tinted), [a * b for a, (_, b) in zip(factors, tinted, strict=True)]


def mean_reflectance(ior: float) -> float:
    """Share of even light that a smooth surface with an index of refraction reflects, over all angles (Fresnel)."""
    index = max(ior, 1.0)
    inside = _inside(index)
    across = (_COSINES - index * inside) / (_COSINES + index * inside)
    along = (index * _COSINES - inside) / (index * _COSINES + inside)
    return float(np.mean((across**2 + along**2) * _COSINES))


def _inside(index: float) -> Array:
    """Cosines of the refracted directions."""
    return np.asarray(np.sqrt(np.maximum(1 - (1 - _COSINES**2) / index**2, 0.0)))


def _gloss(leaf: Principled) -> float:
    """Share that the gloss above the base reflects, with its film if it has one."""
    index = specular_ior(nominal_ior(leaf.ior), _typical(leaf.specular_level))
    thickness = _typical(leaf.thin_film_thickness)
    if thickness == 0:
        return mean_reflectance(index)
    from spectral_core.render.plan.errors.thin_film import reflectance  # of the renderer, which takes long to import

    layers = (_typical(leaf.thin_film_ior), complex(index))
    means = [float(reflectance(layers, float(cosine), thickness).mean()) * cosine for cosine in _COSINES[::16]]
    return float(2 * np.mean(means))


def _share_of_sheen(leaf: Principled) -> float:
    """Share of even light that the fibers take from what lies below them, at a weight of 1."""
    from spectral_core.render.plugins.closures.sheen import mean_share

    return mean_share(_typical(leaf.sheen_roughness))


def _below_tint(dye: FluorescentDye, leaf: Principled, weight: float) -> tuple[FluorescentDye, float]:
    """A dye below the coat's tint, of which light takes a half on its way in and a half on its way out; and the factor
    on its amount.
    """
    # the path through the coat is longer than its thickness by 1 / cosine, as for the surface's own color
    ways = 0.5 / np.maximum(_inside(float(leaf.coat_ior)), 1e-3)

    def passed(spectrum: Spectrum) -> Spectrum:
        nm = spectrum.grid.wavelengths_nm
        once = np.mean(2 * _COSINES * np.maximum(_tint(leaf.coat_tint, nm)[:, None], 1e-6) ** ways, axis=1)
        return replace(spectrum, values=spectrum.values * (1.0 - weight + weight * once))

    taken, sent = passed(dye.excitation), passed(dye.emission)
    changed = replace(dye, excitation=taken)  # the factor holds what the tint takes of the emission
    factor = FluorescentDye(dye.name, dye.excitation, sent).emission_area / dye.emission_area
    return replace(changed, emission=sent), factor


def _tint(paint: Any, nm: Array) -> Array:
    """Transmittance (n,) of a coat's tint; white for one that varies."""
    if isinstance(paint, Spectrum):
        return np.clip(paint.at(nm), 0.0, 1.0)
    rgb = np.clip(paint.linear_rgb if isinstance(paint, Color) else np.ones(3), 0.0, 1.0)
    return np.asarray(np.full(nm.shape, float(rgb[0])) if np.ptp(rgb) == 0 else upsampled(rgb, nm))


def _typical(value: Scalar) -> float:
    """A number, or the mean of one that varies."""
    if isinstance(value, ImageTexture):
        return 0.5
    return float(value) if isinstance(value, (int, float)) else float(np.mean(value.typical))
