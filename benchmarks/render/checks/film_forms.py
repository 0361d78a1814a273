# SPDX-License-Identifier: GPL-3.0-or-later
"""Thin films with an answer on paper: the transfer matrix of each layer in complex numbers, per wavelength.

E and H on both sides of a layer are tied by a matrix (Abelès 1950; Macleod 2010, "Thin-Film Optical Filters", section
2.6). The formulas are complete here and share no code with the renderer, which adds waves by Airy's formula.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.render.cases.meshes import at, square
from benchmarks.render.checks.closed_forms import Compared, compared, empty_scene, in_bands, polar
from spectral_core.render.trace.wavelengths import Bands
from spectral_core.scene import Camera, Glass, Instance, Material, Metal, World, gray
from spectral_core.spectra import catalogue

BANDS = Bands.uniform(420, 700, 15)
FINE_NM = 20.0
"""Half width of a band's response, a triangle."""


def thin_film(samples: int) -> Iterator[Compared]:
    """Films on glass from outside and from within, with total reflection and transmission, and films on metals."""
    for thickness, film in ((120.0, 1.38), (400.0, 1.33), (900.0, 2.2)):
        for degrees in (0.0, 30.0, 60.0):
            for inside in (False, True):
                yield from _on_glass(samples, thickness, film, degrees, inside)
        for name, index in (("silver", 0.15 + 3.5j), ("iron", 2.9 + 3.1j)):
            for degrees in (0.0, 60.0):
                yield from _on_metal(samples, (name, index), thickness, film, degrees)


def _on_glass(samples: int, thickness: float, film: float, degrees: float, inside: bool) -> Iterator[Compared]:
    glass = 1.5
    before, behind = (glass, 1.0) if inside else (1.0, glass)
    sine = before * np.sin(np.radians(degrees)) / behind
    passes = sine < 1
    # reflected light comes from 180 - 2 a degrees about the downward direction, transmitted light from less
    bent = abs(degrees - np.degrees(np.arcsin(sine))) if passes else 0.0
    limit = (bent + 180.0 - 2 * degrees) / 2
    share = reflected((before, film, behind), thickness, np.radians(degrees))
    for way, lit in (("off", (limit, 180.0)), ("through", (0.0, limit))):
        if way == "through" and not passes:
            continue
        found = _ratio(samples, Glass(gray(1.0), 0.0, glass, **_film(thickness, film)), degrees, inside, polar(*lit))
        case = f"{thickness:g} nm of {film:g} on glass{' from within' if inside else ''} at {degrees:g}°, {way}"
        yield from _by_band(case, found, share if way == "off" else lambda nm: 1 - share(nm))


def _on_metal(
    samples: int, metal: tuple[str, complex], thickness: float, film: float, degrees: float
) -> Iterator[Compared]:
    name, index = metal
    n, k = index.real, index.imag
    facing = ((n - 1) ** 2 + k * k) / ((n + 1) ** 2 + k * k)
    most, least = (1 + np.sqrt(facing)) / (1 - np.sqrt(facing)), (1 - facing) / (1 + facing)
    color, edge = gray(facing), gray((most - n) / (most - least))  # Gulbrandsen 2014
    surface = Metal(color, edge, 0.0, physical=True, **_film(thickness, film))
    found = _ratio(samples, surface, degrees, False, gray(1.0))
    share = reflected((1.0, film, index), thickness, np.radians(degrees))
    yield from _by_band(f"{thickness:g} nm of {film:g} on {name} at {degrees:g}°", found, share)


def _film(thickness: float, film: float) -> dict[str, Any]:
    return {"thin_film_thickness": thickness, "thin_film_ior": film}


def _ratio(samples: int, surface: Any, degrees: float, inside: bool, world: Any) -> Any:
    """Radiance of a plane that is seen at an angle over that of a world of 1, per band."""
    eye = Camera(world_from_camera=at(0, 0, 60), kind="orthographic", orthographic_scale=0.01)
    placed = at(scale=(500.0, 500.0, 1.0), turn=("x", degrees + (180.0 if inside else 0.0)))
    scene = replace(
        empty_scene(eye, samples),
        meshes=(square(),),
        materials=(Material("face", surface),),
        instances=(Instance("face", "square", placed, ("face",)),),
        world=World(world),
    )
    return in_bands(scene, BANDS) / _bright(samples)


@cache
def _bright(samples: int) -> Any:
    """A world of 1, per band."""
    eye = Camera(world_from_camera=at(0, 0, 60), kind="orthographic", orthographic_scale=0.01)
    return in_bands(replace(empty_scene(eye, samples), world=World(gray(1.0))), BANDS).mean(axis=(0, 1))


def _by_band(case: str, found: Any, expected: Any) -> Iterator[Compared]:
    daylight = catalogue.illuminant("D65")  # of the world, within a band
    for name, part in zip(BANDS.names, np.moveaxis(found, -1, 0), strict=True):
        fine = np.linspace(-FINE_NM, FINE_NM, 81)
        nm = float(name) + fine
        share = np.average(expected(nm), weights=(1 - np.abs(fine) / FINE_NM) * daylight.at(nm))
        yield compared(f"{case}, {float(name):.0f} nm", part, float(share))


def reflected(indices: tuple[complex, complex, complex], thickness: float, angle: float) -> Any:
    """Share of unpolarized light that a layer between two halves of space reflects, as a function of wavelength in nm.

    ``indices``: of refraction of the side that light comes from, of the layer, of the far side; ``angle`` in radians.
    """
    before, layer, behind = (complex(index) for index in indices)
    sine = before * np.sin(angle)
    # cosines of waves that decay behind the face if they are absorbed or evanescent
    cosines = [np.sqrt(1 - (sine / index) ** 2 + 0j) for index in (before, layer, behind)]

    def share(wavelengths: NDArray[np.float64]) -> NDArray[np.float64]:
        total = np.zeros(wavelengths.shape)
        for polarization in ("s", "p"):
            # admittances: H over E along the face
            y0, y1, y2 = (
                index * cosine if polarization == "s" else index / cosine
                for index, cosine in zip((before, layer, behind), cosines, strict=True)
            )
            delay = 2 * np.pi * layer * cosines[1] * thickness / wavelengths
            electric = np.cos(delay) - 1j * np.sin(delay) / y1 * y2
            magnetic = -1j * y1 * np.sin(delay) + np.cos(delay) * y2
            amplitude = (y0 * electric - magnetic) / (y0 * electric + magnetic)
            total += np.abs(amplitude) ** 2 / 2
        return total

    return share
