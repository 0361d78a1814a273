# SPDX-License-Identifier: GPL-3.0-or-later
"""A palette's file keeps every field of every spectrum, and names the spectra of the catalogue."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from spectral_core.documents import document
from spectral_core.documents.codecs import decoded_grid, encoded_grid
from spectral_core.errors import InvalidInputError
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.palette.files import read_palette, write_palette
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, Spectrum
from spectral_core.spectra.start_lights import sine_light
from tests.settings_walk import fingerprint

GRID = SpectralGrid.uniform(400, 700, 10)
UNEVEN = np.array([390.0, 401.5, 470.25, 640.0, 705.0])
VALUES = np.linspace(0.2, 0.6, GRID.size)
PLAIN = Illuminant("plain", GRID, VALUES)
LIGHTS = {
    "name": replace(PLAIN, name="ünusual 'name'"),
    "grid": Illuminant("uneven", SpectralGrid(UNEVEN), VALUES[:5]),
    "grid.interpolation": Illuminant("sampled", SpectralGrid(UNEVEN, "sampled"), VALUES[:5]),
    "grid.interpolation alone": Illuminant("sampled here", replace(GRID, interpolation="sampled"), VALUES),
    "values": replace(PLAIN, values=VALUES**2),
    "source": replace(PLAIN, source="measured in the kitchen"),
    "catalogue": illuminant("FL2"),
    "catalogue, luminance": normalized(illuminant("HP1"), luminance=2.5),
    "sine": sine_light(550.0, GRID, luminance=1.0),
    "sine, luminance": sine_light(480.0, GRID, luminance=3.0),
}
SURFACES = {
    "values": Reflectance("tile", GRID, VALUES),
    "source": Reflectance("tile", GRID, VALUES, source="spectrophotometer"),
    "grid": Reflectance("tile", SpectralGrid(UNEVEN), VALUES[:5]),
    "catalogue": reflectance("foliage"),
}
IN_SHORT = {
    "catalogue": '{catalogue = "FL2"}', "catalogue, luminance": '{catalogue = "HP1", luminance = 2.5}',
    "sine": '{sine_nm = 550.0, luminance = 1.0}', "sine, luminance": '{sine_nm = 480.0, luminance = 3.0}',
}  # fmt: skip
"""Lights that a file names instead of listing their values."""


def problem_with(light: Illuminant, surface: Reflectance | None = None, grid: SpectralGrid = GRID) -> PaletteProblem:
    return PaletteProblem(
        grid, (PaletteLight(light), PaletteLight(PLAIN)),
        (PaletteReflectance("designed"), PaletteReflectance("measured", surface or SURFACES["values"])),
        ((Cell.fixed((0.3, 0.2, 0.1)), Cell.free()), (Cell.ignore(), Cell.ignore())),
    )  # fmt: skip


def test_every_field_of_a_spectrum_has_a_case() -> None:
    assert {each.name for each in fields(Spectrum)} <= {name.partition(".")[0] for name in LIGHTS}


@pytest.mark.parametrize("ending", ["toml", "json"])
@pytest.mark.parametrize(
    "problem",
    [problem_with(light) for light in LIGHTS.values()]
    + [problem_with(PLAIN, surface) for surface in SURFACES.values()]
    + [problem_with(PLAIN, grid=grid) for grid in (SpectralGrid(UNEVEN), replace(GRID, interpolation="sampled"))],
    ids=[*LIGHTS, *(f"surface, {name}" for name in SURFACES), "uneven palette", "sampled palette"],
)
def test_a_file_keeps_it(problem: PaletteProblem, ending: str, tmp_path: Path) -> None:
    file = tmp_path / f"palette.{ending}"
    write_palette(file, problem)
    assert fingerprint(read_palette(file)) == fingerprint(problem)


@pytest.mark.parametrize("name", IN_SHORT)
def test_known_spectra_are_named(name: str, tmp_path: Path) -> None:
    file = tmp_path / "palette.toml"
    write_palette(file, problem_with(LIGHTS[name], SURFACES["catalogue"]))
    text = file.read_text("utf-8")
    assert f"spectrum = {IN_SHORT[name]}" in text
    assert 'spectrum = {catalogue = "foliage"}' in text


@pytest.mark.parametrize("step", [0.0005, 1e-5 * 16, 10.0])
def test_a_grid_of_any_step_is_read_again(step: float) -> None:
    """A step below 0.001 nm, and one of more than 100,000 steps, was written and then refused."""
    grid = SpectralGrid.uniform(400.0, 400.0 + step * 120_000 if step < 1 else 700.0, step)
    assert decoded_grid(encoded_grid(grid)).same_as(grid)


def test_a_palette_that_toml_cannot_hold_is_refused_before_it_is_written(tmp_path: Path, monkeypatch) -> None:
    """It was written, over the earlier file, and could not be read again."""
    monkeypatch.setattr(document, "MOST_TOML_BYTES", 1 << 20)
    grid = SpectralGrid(np.linspace(400.0, 700.0, 30_000))
    problem = problem_with(Illuminant("fine", grid, np.full(grid.size, 1 / 3)))
    (tmp_path / "fine.toml").write_text("earlier", "utf-8")
    with pytest.raises(InvalidInputError, match=r"fine\.toml would have [0-9.]+ MiB.*name it \.json"):
        write_palette(tmp_path / "fine.toml", problem)
    assert (tmp_path / "fine.toml").read_text("utf-8") == "earlier"
    write_palette(tmp_path / "fine.json", problem)
    assert read_palette(tmp_path / "fine.json").lights[0].spectrum.grid.same_as(grid)
