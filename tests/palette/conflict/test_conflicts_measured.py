# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact cells that measured spectra exclude, and those that only the designed spectra that were found exclude."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.conflicts import conflicting_cells
from spectral_core.palette.presets import design_grid
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import Illuminant, Reflectance

GRID = design_grid()
GRAY = (0.5, 0.5, 0.5)
"""The color of the measured material under D65, whose white is (1, 1, 1)."""
OTHER = (0.5, 0.5, 0.4)
ANY, WARM = Cell.ignore(), Cell.fixed((0.6, 0.2, 0.05))
CASES = {
    "a color": (((Cell.fixed(OTHER, exact=True), ANY), (WARM, ANY)), (0, 0)),
    "a range": (((Cell.free(((0.0, 0.0, 0.0), OTHER), exact=True), ANY), (WARM, ANY)), (0, 0)),
    "the same under two lamps": (((Cell.same_as((0, 1), exact=True), ANY), (WARM, ANY)), (0, 0)),
    "constant": (((ANY, Cell.constant((0, 0), exact=True)), (WARM, ANY)), (0, 1)),
    "black": (((Cell.black(exact=True), ANY), (WARM, ANY)), (0, 0)),
    "beside cells that hold only in black": (
        ((Cell.fixed((0.5, 0.5, 0.499), exact=True), ANY), (Cell.constant((1, 1), exact=True), ANY)),
        (0, 0),
    ),
    "a designed material whose range excludes the measured color": (
        ((ANY, ANY), (Cell.same_as((0, 0), exact=True, box=((0.0, 0.0, 0.0), OTHER)), ANY)),
        (1, 0),
    ),
}


def palette(rows, *, is_designed: bool = True) -> PaletteProblem:
    lights = tuple(PaletteLight(normalized(illuminant(name))) for name in ("D65", "HP1"))
    gray = Reflectance("gray", GRID, np.full(GRID.size, 0.5))
    second = PaletteReflectance("other", None if is_designed else Reflectance("other", GRID, np.full(GRID.size, 0.2)))
    return PaletteProblem(GRID, lights, (PaletteReflectance("gray", gray), second), rows)


@pytest.mark.parametrize("case", CASES)
def test_a_cell_that_only_measured_spectra_exclude_is_named_alone(case) -> None:
    rows, cell = CASES[case]
    solution = solve_palette(palette(rows))
    assert np.allclose(solution.actual_linear_rgb[0, 0], GRAY, atol=1e-3)
    assert solution.status == "exact_conflict"
    assert conflicting_cells(solution) == (cell,)
    assert "cannot be exact" in solution.remedy
    assert "only in black" not in solution.remedy


def test_the_cells_of_a_wholly_measured_palette_are_explained() -> None:
    """A compromise and a conflict named no cell where nothing is designed."""
    exact = solve_palette(palette(((Cell.fixed(OTHER, exact=True), ANY), (ANY, ANY)), is_designed=False))
    assert exact.status == "exact_conflict"
    assert conflicting_cells(exact) == ((0, 0),)
    soft = solve_palette(palette(((Cell.fixed((0.1, 0.5, 0.1)), ANY), (ANY, ANY)), is_designed=False))
    assert soft.status == "compromise"
    for solution in (exact, soft):
        assert [conflict.cell for conflict in solution.conflicts] == [(0, 0)]
        assert "its material and its light are measured" in solution.remedy


@pytest.mark.parametrize("is_designed", [False, True])
def test_only_the_conflict_of_a_measured_light_is_said_to_be_certain(is_designed) -> None:
    """With a designed light only this light was tested; the cells were said to be impossible all the same."""
    red, blue = (normalized(Illuminant("band", GRID, np.abs(GRID.wavelengths_nm - at) < 15)) for at in (450, 650))
    lamp = PaletteLight(red, free=True, primaries=(red, blue), luminance=1.0) if is_designed else PaletteLight(red)
    green = ((Cell.fixed((0.0, 0.5, 0.0), exact=True),),)
    solution = solve_palette(PaletteProblem(GRID, (lamp,), (PaletteReflectance("paint"),), green))
    assert solution.status == "exact_conflict"
    assert conflicting_cells(solution) == ((0, 0),)
    assert ("with the lights and materials that were found" in solution.remedy) is is_designed
    assert ("No lights and materials were found" in solution.remedy) is is_designed
    assert ("Not all exact cells can hold" in solution.remedy) is not is_designed


def test_other_spectra_are_no_remedy_where_measured_ones_exclude_a_color() -> None:
    """The remedy asked for another start of the lights, which the missed cell does not depend on."""
    red, blue = (normalized(Illuminant("band", GRID, np.abs(GRID.wavelengths_nm - at) < 15)) for at in (450, 650))
    lamp = PaletteLight(red, free=True, primaries=(red, blue))
    rows = ((Cell.fixed(OTHER, exact=True), ANY), (WARM, Cell.fixed((0.2, 0.0, 0.2))))
    problem = palette(rows)
    whole = PaletteProblem(GRID, (problem.lights[0], lamp), problem.reflectances, rows)
    solution = solve_palette(whole, seconds=0.3)
    assert solution.status == "exact_conflict"
    assert "its material and its light are measured" in solution.remedy
    assert "No lights and materials were found" not in solution.remedy
