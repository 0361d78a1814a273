# SPDX-License-Identifier: GPL-3.0-or-later
"""Documents keep every field of a cell and of a light; a missing field is detected."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spectral_core.documents.schema import Schema
from spectral_core.errors import SpectralError
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.palette.files import document as documents
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid
from tests.palette_cases import CELLS, GRID, LIGHTS, lamp

DOCUMENT_CELL = {"target": "color"}
"""Names in documents that differ from the field's name."""


def problem_with(cell: Cell | None = None, light: PaletteLight | None = None) -> PaletteProblem:
    cells = [[Cell.fixed((0.3, 0.3, 0.3)), Cell.ignore()], [cell or Cell.ignore(), Cell.ignore()]]
    return PaletteProblem(
        GRID,
        (light or PaletteLight(lamp("first")), PaletteLight(illuminant("D65"))),
        (PaletteReflectance("a"), PaletteReflectance("b")),
        tuple(map(tuple, cells)),
    )


def comparable(value: Any) -> Any:
    """A value that is equal for equal fields: numbers, names, spectra by their values."""
    if isinstance(value, Illuminant):
        return value.name, *np.round(value.values, 9).tolist()
    if isinstance(value, tuple):
        return tuple(comparable(each) for each in value)
    return np.round(value, 9).tolist() if isinstance(value, np.ndarray) else value


def kept(problem: PaletteProblem, table: dict[str, Any] | None = None) -> bool:
    """True if a document keeps every field of the first light and of the first cell in the second row."""
    try:
        got = documents.problem_of(documents.document_of(problem) if table is None else table, Path())
    except SpectralError:
        return False
    pairs = ((got.lights[0], problem.lights[0]), (got.cells[1][0], problem.cells[1][0]))
    return all(
        comparable(getattr(mine, each.name)) == comparable(getattr(theirs, each.name))
        for mine, theirs in pairs
        for each in fields(theirs)
    )


def test_every_field_has_a_case() -> None:
    assert set(CELLS) == {each.name for each in fields(Cell)}
    assert set(LIGHTS) == {each.name for each in fields(PaletteLight)}


@pytest.mark.parametrize("name", CELLS)
def test_a_field_of_a_cell_is_kept_and_its_absence_is_detected(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = problem_with(cell=CELLS[name])
    assert kept(problem)
    table, word = documents.document_of(problem), DOCUMENT_CELL.get(name, name)
    (stated,) = (each for each in table["cells"] if each["reflectance"] == "b")
    del stated[word]
    assert not kept(problem, table)
    monkeypatch.setattr(Schema, "content", lacking("cell", word))
    assert not kept(problem)


@pytest.mark.parametrize("name", LIGHTS)
def test_a_field_of_a_light_is_kept_and_its_absence_is_detected(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = problem_with(light=LIGHTS[name])
    assert kept(problem)
    table = documents.document_of(problem)
    del table["lights"][0][name]
    assert not kept(problem, table)
    monkeypatch.setattr(Schema, "content", lacking("light", name))
    assert not kept(problem)


def lacking(kind: str, word: str) -> dict[str, Any]:
    """The palette's schema without one property of a cell or a light."""
    known = documents.PALETTE_SCHEMA.content
    stated = known["$defs"][kind]
    properties = {key: value for key, value in stated["properties"].items() if key != word}
    return {**known, "$defs": {**known["$defs"], kind: {**stated, "properties": properties}}}


GRIDS = {
    "start_nm": SpectralGrid.uniform(390, 700, 10),
    "stop_nm": SpectralGrid.uniform(400, 710, 10),
    "step_nm": SpectralGrid.uniform(400, 700, 5),
    "wavelengths_nm": SpectralGrid(np.array([400.0, 450.0, 460.0, 700.0])),
    "interpolation": SpectralGrid.uniform(400, 700, 10, interpolation="sampled"),
}
"""By entry of a document's grid, a grid that needs it."""


def grid_kept(grid: SpectralGrid, without: str = "") -> bool:
    """True if a document keeps the grid of a palette; ``without``: an entry that the document lacks."""
    problem = PaletteProblem(grid, (PaletteLight(illuminant("D65")),), (PaletteReflectance("a"),), ((Cell.ignore(),),))
    table = documents.document_of(problem)
    table["grid"] = {key: value for key, value in table["grid"].items() if key != without}
    try:
        return documents.problem_of(table, Path()).grid.same_as(grid)
    except SpectralError:
        return False


@pytest.mark.parametrize("name", GRIDS)
def test_an_entry_of_the_grid_is_kept_and_its_absence_is_detected(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert grid_kept(GRIDS[name])
    assert not grid_kept(GRIDS[name], without=name)
    monkeypatch.setattr(Schema, "content", lacking("grid", name))
    assert not grid_kept(GRIDS[name])


def test_every_entry_of_the_grid_has_a_case() -> None:
    assert set(GRIDS) == set(documents.PALETTE_SCHEMA.content["$defs"]["grid"]["properties"])
