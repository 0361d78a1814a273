# SPDX-License-Identifier: GPL-3.0-or-later
"""``PaletteProblem`` as a plain document and back, for TOML and JSON files."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.documents.codecs import (
    SpectrumFiles,
    decoded_color,
    decoded_grid,
    decoded_spectrum,
    encoded_grid,
    encoded_spectrum,
)
from spectral_core.documents.schema import Schema
from spectral_core.errors import FileFormatError, InvalidInputError, UnknownNameError
from spectral_core.palette.problem import (
    Cell,
    CellIndex,
    CellMode,
    PaletteLight,
    PaletteProblem,
    PaletteReflectance,
    SubspaceCriterion,
)
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid

FORMAT = "spectral-scene palette"
VERSION = 1
PALETTE_SCHEMA = Schema("spectral_core.palette.files", "palette.schema.json")
MOST_CELLS, MOST_SAMPLES = 100_000, 20_000_000
"""Of a palette: lights times reflectances, and the numbers of all its spectra."""
BOUNDS = ("reflectance_bounds", "light_bounds")


def document_of(problem: PaletteProblem) -> dict[str, Any]:
    """The problem as strings, numbers, lists and tables, without entries that have their default."""
    rows, columns = [r.name for r in problem.reflectances], [light.name for light in problem.lights]
    cells = [
        _encoded_cell(cell, (i, j), (rows, columns))
        for i, row in enumerate(problem.cells)
        for j, cell in enumerate(row)
        if cell.mode is not CellMode.IGNORE
    ]
    return {
        "format": FORMAT,
        "version": VERSION,
        "grid": encoded_grid(problem.grid),
        "settings": _encoded_settings(problem),
        "lights": [_encoded_light(light, problem.grid) for light in problem.lights],
        "reflectances": [_encoded_reflectance(item, problem.grid) for item in problem.reflectances],
        "cells": cells,
    }


def problem_of(document: dict[str, Any], folder: Path) -> PaletteProblem:
    """The problem that a document states; spectrum files are sought in ``folder``.

    Raises InvalidInputError that names the place in the document.
    """
    PALETTE_SCHEMA.require_valid(document)
    grid, files = _placed("grid", decoded_grid, document["grid"]), SpectrumFiles(folder)
    _require_bounded(document, grid)
    lights = [_placed(f"lights[{k}]", _decoded_light, each, grid, files) for k, each in enumerate(document["lights"])]
    reflectances = [
        _placed(f"reflectances[{k}]", _decoded_reflectance, each, grid, files)
        for k, each in enumerate(document["reflectances"])
    ]
    names = [item.name for item in reflectances], [light.name for light in lights]
    cells = [[Cell.ignore() for _ in lights] for _ in reflectances]
    stated: dict[CellIndex, int] = {}
    for number, table in enumerate(document.get("cells", [])):
        (i, j), cell = _placed(f"cells[{number}]", _decoded_cell, table, names)
        if (i, j) in stated:
            raise InvalidInputError(f"cells[{number}] is the same cell as cells[{stated[i, j]}]; state each once")
        stated[i, j] = number
        cells[i][j] = cell
    settings = _placed("settings", _decoded_settings, document.get("settings", {}))
    return PaletteProblem(grid, tuple(lights), tuple(reflectances), tuple(map(tuple, cells)), **settings)


def _require_bounded(document: dict[str, Any], grid: SpectralGrid) -> None:
    """A few thousand short names may define a table that does not fit into memory."""
    rows, columns = len(document["reflectances"]), len(document["lights"])
    if rows * columns > MOST_CELLS or (rows + columns) * grid.size > MOST_SAMPLES:
        raise FileFormatError(
            f"{rows} reflectances and {columns} lights on {grid.size} wavelengths; expected at most {MOST_CELLS:,} "
            f"cells and {MOST_SAMPLES:,} samples"
        )


def _placed(place: str, decode: Any, *arguments: Any) -> Any:
    try:
        return decode(*arguments)
    except InvalidInputError as error:
        raise type(error)(f"{place}: {error}") from error


def _encoded_settings(problem: PaletteProblem) -> dict[str, Any]:
    settings: dict[str, Any] = {}
    for each in fields(problem):
        value = getattr(problem, each.name)
        if each.default is MISSING or value == each.default:
            continue
        if isinstance(value, SubspaceCriterion):
            criterion = {"weight": float(value.weight), "componentwise": bool(value.componentwise)}
            value = {"basis": value.basis.tolist(), **criterion}
        elif each.name in BOUNDS:
            value = _encoded_ends(value)
        value = value.item() if isinstance(value, np.generic) else value
        settings[each.name] = list(value) if isinstance(value, tuple) else value
    return settings


def _decoded_settings(table: dict[str, Any]) -> dict[str, Any]:
    settings = dict(table)
    for name in BOUNDS:
        if name in settings:
            settings[name] = tuple(float(end) for end in settings[name])
    if "observers" in settings:
        settings["observers"] = tuple(settings["observers"])
    if "subspace" in settings:
        settings["subspace"] = SubspaceCriterion(**settings["subspace"])
    return settings


def _encoded_ends(ends: Iterable[float]) -> list[float | str]:
    """Infinity as a string: JSON has no number for it."""
    return [float(end) if np.isfinite(end) else "inf" if end > 0 else "-inf" for end in ends]


def _decoded_end(given: list[float | str] | str) -> NDArray[np.float64]:
    """An end of a box: a color, or linear RGB with "inf" for an open side; ``Cell`` checks it."""
    return decoded_color(given) if isinstance(given, str) else np.array([float(channel) for channel in given])


def _encoded_light(light: PaletteLight, grid: SpectralGrid) -> dict[str, Any]:
    table: dict[str, Any] = {"spectrum": encoded_spectrum(light.spectrum, grid)}
    if light.free:
        table["free"] = True
    for name in ("primaries", "variants"):
        if getattr(light, name):
            table[name] = [encoded_spectrum(each, grid) for each in getattr(light, name)]
    if light.white_xyz is not None:
        table["white_xyz"] = light.white_xyz.tolist()
    if light.luminance is not None:
        table["luminance"] = float(light.luminance)
    return table


def _decoded_light(table: dict[str, Any], grid: SpectralGrid, files: SpectrumFiles) -> PaletteLight:
    def light_of(each: Any) -> Illuminant:
        found = decoded_spectrum(each, "illuminant", grid, files)
        assert isinstance(found, Illuminant)
        return found

    spectrum = light_of(table["spectrum"])
    free = table.get("free", False)
    primaries = tuple(light_of(each) for each in table.get("primaries", ()))
    if free and not primaries and not spectrum.grid.same_as(grid):
        # A measured lamp as the start of a design: its values at the design's knots.
        spectrum = spectrum.resampled(grid, average=True)
    if "name" in table:
        spectrum = Illuminant(table["name"], spectrum.grid, spectrum.values, source=spectrum.source)
    return PaletteLight(
        spectrum,
        free,
        primaries,
        np.array(table["white_xyz"]) if "white_xyz" in table else None,
        table.get("luminance"),
        tuple(light_of(each) for each in table.get("variants", ())),
    )


def _encoded_reflectance(item: PaletteReflectance, grid: SpectralGrid) -> dict[str, Any]:
    return {"name": item.name, **({} if item.spectrum is None else {"spectrum": encoded_spectrum(item.spectrum, grid)})}


def _decoded_reflectance(table: dict[str, Any], grid: SpectralGrid, files: SpectrumFiles) -> PaletteReflectance:
    if "spectrum" not in table:
        return PaletteReflectance(table["name"])
    spectrum = decoded_spectrum(table["spectrum"], "reflectance", grid, files)
    if not isinstance(spectrum, Reflectance):
        raise InvalidInputError(
            f"the spectrum {spectrum.name!r} is a light; expected a reflectance, so leave sine_nm to the lights"
        )
    return PaletteReflectance(table["name"], spectrum)


Names = tuple[list[str], list[str]]
"""Names of the reflectances, and of the lights."""


def _encoded_cell(cell: Cell, at: CellIndex, names: Names) -> dict[str, Any]:
    row, column = _encoded_place(at, names)
    table: dict[str, Any] = {"reflectance": row, "light": column, "mode": str(cell.mode)}
    if cell.target is not None:
        table["color"] = cell.target.tolist()
    if cell.others:
        table["others"] = [_encoded_place(other, names) for other in cell.others]
    if cell.box is not None:
        table["box"] = [_encoded_ends(end) for end in cell.box]
    if cell.weight != 1.0:
        table["weight"] = float(cell.weight)
    if cell.exact:
        table["exact"] = True
    return table


def _decoded_cell(table: dict[str, Any], names: Names) -> tuple[CellIndex, Cell]:
    at = _decoded_place([table["reflectance"], table["light"]], names)
    box = table.get("box")
    cell = Cell(
        CellMode(table["mode"]),
        decoded_color(table["color"]) if "color" in table else None,
        tuple(_decoded_place(other, names) for other in table.get("others", ())),
        None if box is None else (_decoded_end(box[0]), _decoded_end(box[1])),
        float(table.get("weight", 1.0)),
        table.get("exact", False),
    )
    return at, cell


def _encoded_place(at: CellIndex, names: Names) -> list[str | int]:
    """[reflectance, light] by name, by number if several share a name."""
    return [known[index] if known.count(known[index]) == 1 else index for index, known in zip(at, names, strict=True)]


def _decoded_place(given: list[str | int], names: Names) -> CellIndex:
    found = []
    for word, known, kind in zip(given, names, ("reflectance", "light"), strict=True):
        if isinstance(word, str):
            if word not in known:
                raise UnknownNameError.among(kind, word, known)
            if known.count(word) > 1:
                raise InvalidInputError(f"{known.count(word)} {kind}s are named {word!r}; use its number, from 0")
            word = known.index(word)
        if not 0 <= word < len(known):
            raise InvalidInputError(f"{kind} number {word}; expected 0 to {len(known) - 1}")
        found.append(word)
    return found[0], found[1]
