# SPDX-License-Identifier: GPL-3.0-or-later
"""Recipes for spectra that can be made: read the panel, call the core, store the recipe's text and spectrum."""

from __future__ import annotations

import json
import operator
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.types import ID, PropertyGroup, Scene

from spectral_core.errors import InvalidInputError
from spectral_core.files.guarded import is_file, no_file
from spectral_core.palette.recipe.lamp import LampQuality, lamp_recipe
from spectral_core.palette.recipe.library import led_channels, paint_chips
from spectral_core.palette.recipe.material import MOST_COLORANTS, Colorants, material_recipe
from spectral_core.palette.recipe.missed import missed_requests
from spectral_core.spectra import catalogue
from spectral_core.spectra.files import read_spectra
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, Spectrum, common_grid, told_apart

from ..translate.spectra.stored import spectrum_of, store_spectrum


@dataclass(frozen=True)
class Found:
    """A recipe: its ``text``, its ``spectrum``, if all requirements are ``met``, and the ``kind`` of what it makes."""

    text: str
    spectrum: Spectrum
    met: bool
    kind: str


def search(scene: Scene, call: Callable[..., Any] = operator.call) -> Callable[[], Found]:
    """The search for the recipe that the panel requests, which reads nothing from Blender any more. ``call``: calls the
    core's part.

    The previous result is removed, even if this one fails. Raises InvalidInputError.
    """
    recipe = scene.spectral.recipe
    recipe.text, recipe.spectrum = "", ""
    spectra, kind, most = _library(recipe), recipe.kind, recipe.most
    if kind != "LAMP":
        if most > MOST_COLORANTS:
            raise InvalidInputError(f"Most Parts is {most}; a recipe has 1 to {MOST_COLORANTS}, lower it")
        wanted, lights, grams = _wanted(scene), _lights(scene), recipe.grams
        colorants, note = _colorants(recipe, spectra, wanted)

        def mixed() -> Found:
            found = call(partial(material_recipe, colorants, wanted, lights, most_colorants=most))
            return Found(f"{found.text(grams)}\n{note}".strip(), found.reflectance, True, kind)

        return mixed
    quality = LampQuality(
        recipe.cri if recipe.use_cri else None,
        recipe.fidelity if recipe.use_fidelity else None,
        (recipe.gamut_low, recipe.gamut_high) if recipe.use_gamut else None,
    )
    channels = [Illuminant(each.name, each.grid, each.values) for each in spectra]
    if most < 3:
        raise InvalidInputError(f"a white takes three channels or more; Most Channels is {most}, make it 3")
    cct, duv = recipe.cct, recipe.duv
    # The library's channels have one watt each; those of a file are as bright as the file says.
    full = "one watt of radiation" if not recipe.reads_file else "the channel as in the file"

    def driven() -> Found:
        most_channels = min(most, len(channels))
        lamp = call(partial(lamp_recipe, channels, cct, duv=duv, quality=quality, most_channels=most_channels))
        lines = [lamp.text(), f"100 % is {full}", *missed_requests(lamp, quality)]
        return Found("\n".join(lines), lamp.lamp, bool(lamp.met), kind)

    return driven


RESULT = ("text", "met", "found_kind", "spectrum")
"""Properties of the panel that hold the last recipe."""


def result_of(scene: Scene) -> dict[str, Any]:
    """The last recipe, for ``put_back``."""
    return {name: getattr(scene.spectral.recipe, name) for name in RESULT}


def put_back(scene: Scene, result: dict[str, Any]) -> None:
    """Show an earlier recipe again, which a search that was stopped has removed."""
    for name, value in result.items():
        setattr(scene.spectral.recipe, name, value)


def store(scene: Scene, found: Found) -> None:
    """Store a recipe for the panel."""
    recipe, made = scene.spectral.recipe, found.spectrum
    recipe.text, recipe.met, recipe.found_kind = found.text, found.met, found.kind
    recipe.spectrum = json.dumps(
        {"name": made.name, "nm": made.grid.wavelengths_nm.tolist(), "values": made.values.tolist()}
    )


def _library(recipe: PropertyGroup) -> list[Spectrum]:
    if recipe.reads_file:
        path = Path(bpy.path.abspath(recipe.filepath, library=recipe.id_data.library))
        if not recipe.filepath or not is_file(path):
            why = "" if recipe.library == "FILE" else f"{recipe.kind.lower()} differ from maker to maker, and "
            remedy = "choose one with a column per component"
            lack = no_file(path, remedy) if recipe.filepath else f"no file of spectra is chosen; {remedy}"
            raise InvalidInputError(why + lack)
        return told_apart(read_spectra(path, kind="illuminant" if recipe.kind == "LAMP" else "reflectance"))
    if recipe.kind == "LAMP":
        return list(led_channels())
    # Without the wanted chip itself, which would be the whole recipe.
    itself = recipe.surface if recipe.wanted == "NAMED" else ""
    return [chip for chip in paint_chips() if chip.name != itself]


def _colorants(recipe: PropertyGroup, spectra: list[Spectrum], wanted: Reflectance) -> tuple[Colorants, str]:
    """The colorants, and a note where those of a file, or what is wanted, were measured over different ranges."""
    grid, note = common_grid([*spectra, wanted], "The recipe")
    is_narrower = any(np.ptp(grid.wavelengths_nm) < np.ptp(each.grid.wavelengths_nm) for each in spectra)
    if not (recipe.reads_file and is_narrower):
        note = ""
    values = np.stack([each.at(grid.wavelengths_nm) for each in spectra])
    kind = {"PAINTS": "paints", "INKS": "inks", "FILTERS": "filters"}[recipe.kind]
    names = tuple(each.name for each in spectra)
    return Colorants(kind, names, grid, values, dot_gain_n=recipe.dot_gain), note  # type: ignore[arg-type]


def _wanted(scene: Scene) -> Reflectance:
    recipe, palette = scene.spectral.recipe, scene.spectral.palette
    if recipe.wanted == "NAMED":
        return catalogue.reflectance(recipe.surface)
    if palette.active_row >= len(palette.materials):
        raise InvalidInputError("the palette has no material; add one, or choose a named surface")
    material = palette.materials[palette.active_row]
    found = spectrum_of(material, "result") if len(material.result.samples) else None
    if found is None:
        raise InvalidInputError(f"{material.name!r} has no spectrum yet; solve the palette first")
    return Reflectance(material.name, found.grid, np.clip(found.values, 0, 1))


def _lights(scene: Scene) -> list[Illuminant]:
    """The lights of the palette's solution, else daylight and tungsten."""
    palette = scene.spectral.palette
    found = [spectrum_of(light, "result") for light in palette.lights if len(light.result.samples)]
    lights = [Illuminant(each.name, each.grid, each.values) for each in found if each is not None]
    if scene.spectral.recipe.wanted == "PALETTE" and lights:
        return lights
    return [catalogue.illuminant("D65"), catalogue.illuminant("A")]


def give(scene: Scene, target: ID) -> None:
    """Give the spectrum of the recipe to a light or a material. Raises InvalidInputError for the wrong type."""
    recipe = scene.spectral.recipe
    if not recipe.spectrum or recipe.found_kind != recipe.kind:
        raise InvalidInputError("there is no recipe yet; press Find Recipe first")
    stored = json.loads(recipe.spectrum)
    kind = Illuminant if recipe.kind == "LAMP" else Reflectance
    store_spectrum(target.spectral, kind(stored["name"], SpectralGrid(stored["nm"]), stored["values"]))
