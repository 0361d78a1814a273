# SPDX-License-Identifier: GPL-3.0-or-later
"""Error of omitting the thin films of a scene: the reflection of each surface with and without its film."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.mitsuba_scene.paint import white_light
from spectral_core.render.plan.decision import LATER_BOUNCES, MOST_ERROR
from spectral_core.scene import Color, Glass, Material, Metal, Principled, leaves, nominal_ior
from spectral_core.spectra.color import RGB_FROM_XYZ, delta_e_2000, lab_from_linear_rgb, luminance_from_linear_rgb
from spectral_core.spectra.metal import index_of_metal
from spectral_core.spectra.observer import STANDARD, observer, xyz_of
from spectral_core.spectra.spectrum import WAVELENGTHS_NM, Illuminant, Reflectance, SpectralGrid, Spectrum

Array = NDArray[np.float64]
Filmed = Glass | Metal | Principled
Indices = tuple[float, complex]

ANGLES_DEG = (0.0, 45.0, 75.0)
USUAL_NM = (100.0, 200.0, 300.0, 450.0, 600.0, 900.0)
"""Thicknesses that are tried where an image gives them."""
USUAL_IOR = (1.33, 1.8)
"""Indices of the film that are tried where an image gives them: that of what lies below hides the film."""
KNOTS_NM: Array = WAVELENGTHS_NM[::5]


def filmed(material: Material) -> list[Filmed]:
    """Closures of a material that have a film."""
    kinds = (Glass, Metal, Principled)
    return [leaf for leaf in leaves(material.surface) if isinstance(leaf, kinds) and leaf.thin_film_thickness != 0]


def error_without_films(materials: list[Material]) -> float:
    """Largest ΔE2000 of a light that a film reflects, at the brightness where it is white without the film."""
    worst = 0.0
    for indices, thickness in (
        layer for material in materials for closure in filmed(material) for layer in layers_of(closure)
    ):
        for cosine in np.cos(np.radians(ANGLES_DEG)):
            bare = _color(reflectance(indices, float(cosine), 0.0))
            scale = max(float(luminance_from_linear_rgb(bare)), 1e-6)
            shown = _color(reflectance(indices, float(cosine), thickness))
            pair = (lab_from_linear_rgb(np.maximum(rgb / scale, 0.0)) for rgb in (bare, shown))
            worst = max(worst, float(delta_e_2000(*pair)))
    return min(LATER_BOUNCES * worst, MOST_ERROR)


def film_surfaces(materials: list[Material]) -> list[tuple[Array, Any, bool]]:
    """What films reflect, as RGB transport has it and by wavelength; none of it is measured."""
    found: list[tuple[Array, Any, bool]] = []
    viewer = observer(STANDARD)
    sums = RGB_FROM_XYZ @ np.stack([np.interp(KNOTS_NM, viewer.wavelengths_nm, row) for row in viewer.cmfs])
    for indices, thickness in (
        layer for material in materials for closure in filmed(material) for layer in layers_of(closure)
    ):
        values = reflectance(indices, 1.0, thickness)
        rgb = np.clip(sums @ values / sums.sum(axis=1), 0.0, 1.0)
        found.append((rgb, lambda points, values=values: np.interp(points, KNOTS_NM, values), False))
    return found


def reflectance(indices: Indices, cosine: float, thickness_nm: float) -> Array:
    """Share of light (n,) that a facet reflects at ``KNOTS_NM``: Airy's formula in complex numbers, without color.

    ``indices``: of refraction of the film, and of what lies below it.
    """
    film, base = indices
    along = [np.sqrt(complex(n) ** 2 - (1 - cosine**2)) for n in (1.0, film, base)]
    phase = np.exp(4j * np.pi * thickness_nm * along[1] / KNOTS_NM)
    total = np.zeros(KNOTS_NM.size)
    for weights in ((1.0, 1.0, 1.0), (1.0, film**2, base**2)):  # across: q; along: q / n²
        waves = [q / weight for q, weight in zip(along, weights, strict=True)]
        first, second = ((a - b) / (a + b) for a, b in pairwise(waves))
        total += np.abs((first + second * phase) / (1 + first * second * phase)) ** 2 / 2
    return np.asarray(np.clip(total, 0.0, 1.0))


def layers_of(closure: Filmed) -> Iterator[tuple[Indices, float]]:
    """Indices of refraction and thicknesses (nm) that a closure's film may have."""
    film = closure.thin_film_ior
    films = (float(film),) if isinstance(film, (int, float)) else USUAL_IOR
    yield from (((each, base), thickness) for base in _bases(closure) for each in films
                for thickness in _thicknesses(closure))  # fmt: skip


def _bases(closure: Filmed) -> Iterator[complex]:
    """Indices of refraction of what lies below the film, of metals at their mean color; both of a part metal."""
    if isinstance(closure, Metal):
        yield _index(_mean(closure.color, 0.6), _mean(closure.edge_tint, 0.7) * closure.edge_scale)
        return
    metallic = closure.metallic if isinstance(closure, Principled) else 0.0
    if isinstance(closure, Principled) and metallic != 0.0:
        yield _index(_mean(closure.base_color, 0.8), 1.0)
    if not isinstance(metallic, (int, float)) or metallic < 1.0:
        yield complex(nominal_ior(closure.ior))


def _index(facing: float, edge: float) -> complex:
    index, extinction = index_of_metal(facing, edge)
    return complex(float(index), float(extinction))


def _mean(paint: Any, otherwise: float) -> float:
    if isinstance(paint, Color):
        return float(np.clip(np.mean(paint.linear_rgb), 0.0, 1.0))
    return float(np.clip(paint.values.mean(), 0.0, 1.0)) if isinstance(paint, Spectrum) else otherwise


def _thicknesses(closure: Filmed) -> tuple[float, ...]:
    value = closure.thin_film_thickness
    return (float(value),) if isinstance(value, (int, float)) else USUAL_NM


def _color(values: Array) -> Array:
    light: Illuminant = white_light()
    return np.asarray(RGB_FROM_XYZ @ xyz_of(light, Reflectance("film", SpectralGrid(KNOTS_NM), values)))
