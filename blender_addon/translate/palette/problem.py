# SPDX-License-Identifier: GPL-3.0-or-later
"""From the palette's properties to the problem that the core solves."""

from functools import lru_cache

import numpy as np
from bpy.types import PropertyGroup

from spectral_core.errors import InvalidInputError
from spectral_core.palette import Cell, CellMode, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.spectra.color import linear_from_display_rgb
from spectral_core.spectra.observer import STANDARD, normalized
from spectral_core.spectra.spectrum import Illuminant, Interpolation, Reflectance, SpectralGrid, Spectrum

from ...properties.palette.cell import BOXED, REFERRING
from ..context import finite
from ..spectra.stored import spectrum_of
from .paint import has_paint
from .settings import settings_of
from .table import places, references


def palette_problem(palette: PropertyGroup) -> PaletteProblem:
    """The table as a problem. Raises InvalidInputError that names the invalid row, column or cell."""
    if not len(palette.lights) or not len(palette.materials):
        raise InvalidInputError("the table is empty; add a light and a material, or choose a preset")
    settings = settings_of(palette)
    return PaletteProblem(
        lights=tuple(_light(palette, light, settings["grid"]) for light in palette.lights),
        reflectances=tuple(_reflectance(material) for material in palette.materials),
        cells=tuple(tuple(_cell(palette, m, c) for c in range(len(m.cells))) for m in palette.materials),
        **settings,
    )


def takes_seconds(palette: PropertyGroup) -> bool:
    """True if this table needs a solver that is too slow for dragging a slider."""
    lamps = any(len(light.variants) for light in palette.lights if light.design == "MEASURED")
    several = lamps or bool(palette.observers - {STANDARD})  # the standard one always counts
    distinct = any(cell.mode == "DISTINCT" and cell.weight > 0 for _, cell in places(palette))
    return distinct or has_paint(palette) or (palette.robustness == "worst_case" and several)


def _illuminant(holder: PropertyGroup, luminance: float, name: str) -> Illuminant:
    found = spectrum_of(holder)
    if found is None:
        raise InvalidInputError(f"light {name!r} has no spectrum; choose one from the catalogue or a file")
    return _with_luminance(name, found, luminance)


def _with_luminance(name: str, light: Spectrum, luminance: float) -> Illuminant:
    grid = light.grid
    return _normalized(
        name, grid.interpolation, grid.wavelengths_nm.tobytes(), light.values.tobytes(), light.source, luminance
    )


@lru_cache(maxsize=64)
def _normalized(
    name: str, interpolation: Interpolation, wavelengths_nm: bytes, values: bytes, source: str, luminance: float
) -> Illuminant:
    """A light of this luminance. Kept, because a dragged color reads the same lights again and again."""
    grid = SpectralGrid(np.frombuffer(wavelengths_nm), interpolation)
    return normalized(Illuminant(name, grid, np.frombuffer(values), source=source), luminance=luminance)


def _light(palette: PropertyGroup, light: PropertyGroup, grid: SpectralGrid) -> PaletteLight:
    luminance = finite(palette, "brightness", "of the table") * finite(light, "intensity", f"of light {light.name!r}")
    start = _illuminant(light, luminance, light.name)
    if light.design == "MEASURED":
        variants = tuple(_illuminant(each, luminance, _lamp_name(each)) for each in light.variants)
        return PaletteLight(start, variants=variants)
    primaries: tuple[Illuminant, ...] = ()
    if light.use_primaries:
        if not len(light.primaries):
            raise InvalidInputError(
                f"light {light.name!r} is mixed from lamps, but its list of lamps is empty; add some"
            )
        primaries = tuple(_illuminant(each, luminance, _lamp_name(each)) for each in light.primaries)
    return PaletteLight(
        start if primaries else _with_luminance(start.name, _on_grid(start, grid), luminance),
        free=True,
        primaries=primaries,
        white_xyz=np.array(light.white_xyz) if light.looks_white else None,
        luminance=luminance if light.keeps_luminance else None,
    )


def _on_grid(start: Illuminant, grid: SpectralGrid) -> Illuminant:
    """The start of a design, averaged over cells so that no line is lost; unchanged if it is already on this grid."""
    known = start.grid.wavelengths_nm
    if known.size == grid.size and np.allclose(known, grid.wavelengths_nm, rtol=0, atol=1e-3):
        return Illuminant(start.name, grid, start.values, source=start.source)
    return start.resampled(grid, average=True)


def _lamp_name(lamp: PropertyGroup) -> str:
    return lamp.spectral.spectrum_name or lamp.spectral.catalogue_name or "lamp"


def _reflectance(material: PropertyGroup) -> PaletteReflectance:
    if material.design == "DESIGNED":
        return PaletteReflectance(material.name)
    found = spectrum_of(material)
    if found is None:
        raise InvalidInputError(
            f"material {material.name!r} is measured but has no spectrum; choose one, or let it be designed"
        )
    return PaletteReflectance(material.name, Reflectance(material.name, found.grid, found.values, source=found.source))


def _cell(palette: PropertyGroup, material: PropertyGroup, column: int) -> Cell:
    cell = material.cells[column]
    mode = CellMode(cell.mode.lower())
    if mode is CellMode.IGNORE:
        return Cell.ignore()
    others = references(palette, cell) if cell.mode in REFERRING else []
    if cell.mode in REFERRING and not others:
        raise InvalidInputError(
            f"{material.name!r} under {palette.lights[column].name!r} refers to no other cell yet; choose one"
        )
    box = None
    if cell.use_box and cell.mode in BOXED:
        box = (linear_from_display_rgb(cell.box_low), linear_from_display_rgb(cell.box_high))
    try:
        return Cell(
            mode,
            target=linear_from_display_rgb(cell.target) if mode is CellMode.FIXED else None,
            others=tuple(others),
            box=box,
            weight=cell.weight,
            exact=cell.exact and mode is not CellMode.DISTINCT,
        )
    except InvalidInputError as error:
        raise InvalidInputError(f"{material.name!r} under {palette.lights[column].name!r}: {error}") from error
