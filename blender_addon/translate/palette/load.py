# SPDX-License-Identifier: GPL-3.0-or-later
"""A palette problem (a preset, a file) written to the table, so that solving the table solves that problem."""

import numpy as np
from bpy.types import PropertyGroup

from spectral_core.palette import Cell, PaletteLight, PaletteProblem
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import WHITE_XYZ, display_rgb_from_linear
from spectral_core.spectra.observer import xyz_of
from spectral_core.spectra.spectrum import Illuminant

from ...properties.palette.cell import WEIGHT_LIMIT
from ..spectra.stored import store_spectrum
from .settings import require_storable, store_settings
from .table import add_lamp, add_light, add_material, clear, paused, set_references

OPEN = 100.0
"""sRGB of an open side of a range of colors."""
NOTED = 1e-3
"""Relative change of a luminance from which it is reported."""


def store_problem(palette: PropertyGroup, problem: PaletteProblem) -> list[str]:
    """Replace the table by ``problem``; returns a text on the losses.

    Raises InvalidInputError, with the table unchanged, if the problem has requests that the table cannot represent.
    """
    require_storable(problem)
    with paused():
        clear(palette)
        notes = store_settings(palette, problem)
        luminances = [_luminance(light) for light in problem.lights]
        palette.brightness = luminances[0]
        for light, luminance in zip(problem.lights, luminances, strict=True):
            notes += _store_light(palette, light, luminance)
        for item in problem.reflectances:
            material = add_material(palette, item.name)
            material.design = "DESIGNED" if item.free else "MEASURED"
            if item.spectrum is not None:
                store_spectrum(material.spectral, item.spectrum)
        for row, cells in enumerate(problem.cells):
            for column, cell in enumerate(cells):
                notes += _store_cell(palette, (row, column), cell)
    return notes


def _luminance(light: PaletteLight) -> float:
    """The luminance that a light must keep, else that of its spectrum."""
    return float(xyz_of(light.spectrum)[1]) if light.luminance is None else light.luminance


def _store_light(palette: PropertyGroup, light: PaletteLight, luminance: float) -> list[str]:
    column = add_light(palette, light.name)
    column.design = "DESIGNED" if light.free else "MEASURED"
    column.intensity = luminance / palette.brightness
    _store_lamp(column.spectral, light.spectrum)
    column.use_primaries = bool(light.primaries)
    for name, lamps in (("primaries", light.primaries), ("variants", light.variants)):
        for lamp in lamps:
            _store_lamp(add_lamp(getattr(column, name), lamp.name).spectral, lamp)
    column.looks_white = light.white_xyz is not None
    if light.white_xyz is not None:
        column.white_xyz = np.asarray(light.white_xyz) / light.white_xyz[1] * WHITE_XYZ[1]
    column.keeps_luminance = light.luminance is not None
    kept = palette.brightness * column.intensity
    notes = []
    if not np.isclose(kept, luminance, rtol=NOTED):
        notes.append(f"{light.name}: luminance {luminance:g} became {kept:g}, which is the limit of the table")
    for lamp in light.variants:
        own = float(xyz_of(lamp)[1])
        if not np.isclose(own, luminance, rtol=NOTED):
            notes.append(f"{light.name}: its variant {lamp.name} of luminance {own:g} counts at the light's, {kept:g}")
    return notes


def _store_lamp(spectral: PropertyGroup, spectrum: Illuminant) -> None:
    """By its name if the catalogue has exactly this spectrum, else by its values."""
    if spectrum.name in catalogue.illuminant_names():
        known = catalogue.illuminant(spectrum.name)
        if known.grid.same_as(spectrum.grid):
            ratio = spectrum.values.sum() / known.values.sum()
            if np.allclose(spectrum.values, ratio * known.values, rtol=1e-9):
                spectral.source = "CATALOGUE"
                spectral.catalogue_name = spectrum.name
                return
    store_spectrum(spectral, spectrum)


def _store_cell(palette: PropertyGroup, place: tuple[int, int], asked: Cell) -> list[str]:
    material, light = palette.materials[place[0]], palette.lights[place[1]]
    cell = material.cells[place[1]]
    cell.mode = asked.mode.upper()
    if asked.target is not None:
        cell.target = display_rgb_from_linear(asked.target)
    set_references(palette, cell, list(asked.others))
    notes = []
    name = f"{material.name} under {light.name}"
    cell.use_box = asked.box is not None
    if asked.box is not None:
        ends = [np.clip(display_rgb_from_linear(np.clip(end, -1e6, 1e6)), -OPEN, OPEN) for end in asked.box]
        cell.box_low, cell.box_high = ends
        if not np.isfinite(asked.box).all():
            notes.append(f"{name}: the open side of its range became {OPEN:g}, beyond any color")
    cell.weight = min(asked.weight, WEIGHT_LIMIT)
    cell.exact = asked.exact
    if asked.weight > WEIGHT_LIMIT:
        notes.append(
            f"{name}: weight {asked.weight:g} became {WEIGHT_LIMIT:g}, the most that solvers bear; make the cell exact "
            "to enforce it"
        )
    return notes
