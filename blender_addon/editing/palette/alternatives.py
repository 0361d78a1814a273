# SPDX-License-Identifier: GPL-3.0-or-later
"""Alternative solutions of the palette: found by the core, stored in the file, selected by the artist."""

from __future__ import annotations

import json

import numpy as np
from bpy.types import PropertyGroup, Scene

from spectral_core.errors import InvalidInputError
from spectral_core.palette.alternatives import alternatives
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import display_rgb_from_linear
from spectral_core.spectra.observer import linear_rgb_from_product, normalized
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid

from ...translate.palette.problem import palette_problem
from ...translate.spectra.stored import spectrum_of, store_spectrum
from .possible import solved_state
from .solve import forget_solutions


def find(scene: Scene, seed: int = 0) -> int:
    """Find and store alternative solutions; returns their number. Raises InvalidInputError if nothing is free."""
    palette = scene.spectral.palette
    if palette.use_tints or any(len(material.dyes) for material in palette.materials):
        raise InvalidInputError("alternatives do not support tints and dyes; switch them off")
    problem = palette_problem(palette)
    locked = {}
    for row, material in enumerate(palette.materials):
        if material.locked and material.design == "DESIGNED":
            kept = spectrum_of(material, "result")
            if kept is None:
                raise InvalidInputError(f"{material.name!r} is locked but was never solved; solve the palette first")
            locked[row] = Reflectance(material.name, kept.grid, kept.values)
    found = alternatives(problem, count=palette.alternative_count, locked=locked, seed=seed)
    palette.alternatives.clear()
    for each in found:
        entry = palette.alternatives.add()
        entry.apart = each.apart
        items = each.solution.reflectances
        entry.spectra = json.dumps(
            {
                str(material.uid): {
                    "nm": item.grid.wavelengths_nm.tolist(),
                    "values": np.round(item.values, 6).tolist(),
                }
                for material, item in zip(palette.materials, items, strict=True)
                if material.design == "DESIGNED"
            }
        )
        lamps = {light.name: Illuminant(light.name, light.grid, light.values) for light in each.solution.illuminants}
        lights = [lamps[name] if name in lamps else normalized(illuminant(name)) for name in each.seen_under]
        colors = [[linear_rgb_from_product(light, item.grid) @ item.values for light in lights] for item in items]
        entry.colors = json.dumps(np.clip(display_rgb_from_linear(np.array(colors)), 0, 1).round(4).tolist())
        entry.lamps = ", ".join(each.seen_under)
    return len(found)


def take(scene: Scene, index: int) -> None:
    """Make an alternative the palette's solution: spectra, and the colors of the cells."""
    palette = scene.spectral.palette
    if not 0 <= index < len(palette.alternatives):
        raise InvalidInputError(
            f"there is no alternative {index}; there are {len(palette.alternatives)}, counted from 0"
        )
    spectra = json.loads(palette.alternatives[index].spectra)
    lights, _ = solved_state(palette)
    if lights is None:
        raise InvalidInputError("the palette is not solved; solve it, and find alternatives again")
    for material in palette.materials:
        stored = spectra.get(str(material.uid))
        if stored is not None:
            reflectance = Reflectance(material.name, SpectralGrid(stored["nm"]), np.clip(stored["values"], 0, 1))
            _show(material, reflectance, lights)
    forget_solutions()


def _show(material: PropertyGroup, reflectance: Reflectance, lights: list[Illuminant]) -> None:
    store_spectrum(material.result, reflectance)
    for cell, light in zip(material.cells, lights, strict=True):
        cell.actual_linear = linear_rgb_from_product(light, reflectance.grid) @ reflectance.values
        cell.actual_display = display_rgb_from_linear(cell.actual_linear)
