# SPDX-License-Identifier: GPL-3.0-or-later
"""Designed lights that no cell needs: they become black, and a note says so."""

from __future__ import annotations

import pytest

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, PaletteSession, solve_palette
from spectral_core.palette.presets import design_grid
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import WHITE_XYZ
from spectral_core.spectra.observer import normalized, xyz_of


def with_spare_light(cell: Cell, **requests) -> PaletteProblem:
    day = PaletteLight(normalized(illuminant("D65"), luminance=2))
    spare = PaletteLight(normalized(illuminant("A"), luminance=2).resampled(design_grid()), free=True, **requests)
    return PaletteProblem(
        design_grid(), (day, spare), (PaletteReflectance("a"),), ((Cell.fixed((0.3, 0.3, 0.1)), cell),)
    )


@pytest.mark.parametrize("cell", [Cell.ignore(), Cell.free(), Cell.black()], ids=["ignore", "free", "black"])
@pytest.mark.parametrize("white", [None, WHITE_XYZ], ids=["any", "white"])
def test_a_black_light_is_noted(cell, white) -> None:
    """It was solved without a word, although the light was required to look white."""
    solution = solve_palette(with_spare_light(cell, white_xyz=white))
    assert xyz_of(solution.illuminants[1]).max() < 1e-3
    noted = [note for note in solution.notes if "light 'A' is black" in note]
    assert len(noted) == 1
    assert ("required white" in noted[0]) == (white is not None)


@pytest.mark.parametrize("cell", [Cell.ignore(), Cell.free(), Cell.fixed((0.2, 0.2, 0.2), weight=0), Cell.black()])
def test_a_light_without_a_request_takes_no_descent(cell) -> None:
    """One designed light over one material took hundreds of steps, to the end of the time budget, to become black."""
    light = PaletteLight(normalized(illuminant("D65")).resampled(design_grid()), free=True)
    problem = PaletteProblem(design_grid(), (light,), (PaletteReflectance("a"),), ((cell,),))
    solution = solve_palette(problem)
    assert solution.status == "solved"
    assert solution.rounds < 10
    assert cell.mode == "black" or solve_palette(with_spare_light(cell)).rounds < 10


def test_a_light_that_is_needed_or_keeps_its_luminance_has_no_note() -> None:
    needed = solve_palette(with_spare_light(Cell.fixed((0.5, 0.1, 0.1)), white_xyz=WHITE_XYZ), seconds=0.3)
    held = solve_palette(with_spare_light(Cell.ignore(), white_xyz=WHITE_XYZ, luminance=2.0), seconds=0.3)
    assert xyz_of(needed.illuminants[1])[1] > 0.1
    assert xyz_of(held.illuminants[1])[1] == pytest.approx(2.0, rel=1e-4)
    assert not [note for each in (needed, held) for note in each.notes if "black" in note]


def test_reading_a_live_solution_again_does_not_repeat_its_notes() -> None:
    live = PaletteSession(with_spare_light(Cell.ignore()))
    live.edit((0, 0), Cell.fixed((0.2, 0.3, 0.1)))
    first, second = live.solution(), live.solution()
    assert len([note for note in first.notes if "is black" in note]) == 1
    assert second.notes == first.notes


def test_a_material_that_nothing_asks_for_a_color_is_noted() -> None:
    lights = [PaletteLight(normalized(illuminant(name))) for name in ("A", "D65")]
    rows = (
        (Cell.fixed((0.3, 0.2, 0.1)), Cell.ignore()),
        (Cell.same_as((1, 1)), Cell.free()),
        (Cell.black(), Cell.black()),
    )
    materials = tuple(PaletteReflectance(name) for name in "abc")
    notes = solve_palette(PaletteProblem(design_grid(), tuple(lights), materials, rows)).notes
    assert [note[:20] for note in notes] == ["material 'b' is blac"]


def test_many_materials_that_nothing_asks_for_a_color_have_one_note() -> None:
    """A table whose cells are all free printed a note for each of its rows."""
    lights = tuple(PaletteLight(normalized(illuminant(name))) for name in ("A", "D65"))
    materials = tuple(PaletteReflectance(f"row {number}") for number in range(12))
    problem = PaletteProblem(design_grid(), lights, materials, ((Cell.free(), Cell.free()),) * 12)
    (note,) = solve_palette(problem).notes
    assert note.startswith("12 materials are black, which meets all their requests: material 'row 0', material 'row 1'")
    assert "and 8 more; give" in note and "row 4" not in note
