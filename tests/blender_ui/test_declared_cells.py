# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's table keeps every field of a cell and of a light."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.translate.palette.load import store_problem
from blender_addon.translate.palette.problem import palette_problem
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

GRID = SpectralGrid.uniform(400, 700, 10)
COLOR = (0.2, 0.3, 0.4)
CELLS = {
    "mode": Cell.black(),
    "target": Cell.fixed(COLOR),
    "others": Cell.same_as((0, 1)),
    "box": Cell.free(((0.1, 0.2, 0.3), (0.4, 0.5, 0.6))),
    "weight": Cell.fixed(COLOR, weight=7.5),
    "exact": Cell.fixed(COLOR, exact=True),
}


def problem_with(cell: Cell) -> PaletteProblem:
    lamp = Illuminant("lamp", GRID, np.linspace(0.3, 0.6, GRID.size))
    return PaletteProblem(
        GRID,
        (PaletteLight(lamp, free=True), PaletteLight(Illuminant("other", GRID, np.full(GRID.size, 0.4)))),
        (PaletteReflectance("a"), PaletteReflectance("b")),
        ((Cell.fixed((0.3, 0.3, 0.3)), Cell.ignore()), (cell, Cell.ignore())),
    )


def test_every_field_of_a_cell_has_a_case():
    assert set(CELLS) == {each.name for each in fields(Cell)}


@pytest.mark.parametrize("name", CELLS)
def test_the_table_keeps_each_field_of_a_cell(blender, name):
    palette = blender.context.scene.spectral.palette
    palette.live = False
    wanted = CELLS[name]
    store_problem(palette, problem_with(wanted))
    got = palette_problem(palette)
    assert [light.free for light in got.lights] == [True, False]
    cell = got.cells[1][0]
    assert cell.weight == pytest.approx(wanted.weight)
    assert (cell.mode, cell.others, cell.exact) == (wanted.mode, wanted.others, wanted.exact)
    for mine, theirs in ((cell.target, wanted.target), (cell.box, wanted.box)):
        assert (mine is None) == (theirs is None)
        if theirs is not None:
            np.testing.assert_allclose(mine, theirs, atol=1e-6)
