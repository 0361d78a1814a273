# SPDX-License-Identifier: GPL-3.0-or-later
"""Alternative solutions of the palette: found by the core, stored in the file, selected by the artist."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
from bpy.types import PropertyGroup, Scene

from spectral_core.errors import InvalidInputError
from spectral_core.palette.alternatives import Alternative, alternatives
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import display_rgb_from_linear
from spectral_core.spectra.observer import linear_rgb_from_product, normalized
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid

from ...translate.palette.problem import palette_problem
from ...translate.spectra.stored import spectrum_of, store_spectrum
from .possible import solved_state
from .solve import forget_solutions

Found = list[dict[str, Any]]
"""Values of ``palette.alternatives``, one dict for each."""


def search(scene: Scene, seed: int = 0) -> Callable[[], Found]:
    """The search for alternative solutions, which reads nothing from Blender any more.

    Raises InvalidInputError if nothing is free.
    """
    palette = scene.spectral.palette
    if palette.use_tints or any(len(material.dyes) for material in palette.materials):
        raise InvalidInputError("alternatives do not support tints and dyes; switch them off")
    problem, count = palette_problem(palette), palette.alternative_count
    locked = {}
    for row, material in enumerate(palette.materials):
        if material.locked and material.design == "DESIGNED":
            kept = spectrum_of(material, "result")
            if kept is None:
                raise InvalidInputError(f"{material.name!r} is locked but was never solved; solve the palette first")
            locked[row] = Reflectance(material.name, kept.grid, kept.values)
    designed = [material.uid if material.design == "DESIGNED" else None for material in palette.materials]
    return lambda: [_told(each, designed) for each in alternatives(problem, count=count, locked=locked, seed=seed)]


def _told(found: Alternative, designed: list[int | None]) -> dict[str, Any]:
    """The values to store. ``designed``: numbers of the materials, None for those that are given."""
    items = found.solution.reflectances
    spectra = {
        str(uid): {"nm": item.grid.wavelengths_nm.tolist(), "values": np.round(item.values, 6).tolist()}
        for uid, item in zip(designed, items, strict=True)
        if uid is not None
    }
    lamps = {light.name: Illuminant(light.name, light.grid, light.values) for light in found.solution.illuminants}
    lights = [lamps[name] if name in lamps else normalized(illuminant(name)) for name in found.seen_under]
    colors = [[linear_rgb_from_product(light, item.grid) @ item.values for light in lights] for item in items]
    shown = np.clip(display_rgb_from_linear(np.array(colors)), 0, 1).round(4).tolist()
    lamp_names = ", ".join(found.seen_under)
    return {"apart": found.apart, "spectra": json.dumps(spectra), "colors": json.dumps(shown), "lamps": lamp_names}


def store(scene: Scene, found: Found) -> None:
    """Store what a search has found."""
    entries = scene.spectral.palette.alternatives
    entries.clear()
    for values in found:
        entry = entries.add()
        for name, value in values.items():
            setattr(entry, name, value)


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
