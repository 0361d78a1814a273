# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's table keeps every field of a cell and of a light."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.translate.palette.load import store_problem
from blender_addon.translate.palette.problem import palette_problem
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import normalized, xyz_of
from spectral_core.spectra.spectrum import Illuminant, Reflectance
from tests.palette_cases import CELLS, COLOR, GRID, LIGHTS, lamp


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


LIGHTS_AND_LAMPS = LIGHTS | {
    "source": PaletteLight(replace(lamp(), source="measured in the kitchen")),
    "source of a start": PaletteLight(replace(lamp(), source="measured in the kitchen"), free=True),
    "of the catalogue": PaletteLight(normalized(illuminant("FL2"), luminance=3.0)),
}


def test_every_field_of_a_light_has_a_case():
    assert {each.name for each in fields(PaletteLight)} <= set(LIGHTS)


@pytest.mark.parametrize("name", LIGHTS_AND_LAMPS)
def test_the_table_keeps_each_field_of_a_light(blender, name):
    palette = blender.context.scene.spectral.palette
    palette.live = False
    wanted = LIGHTS_AND_LAMPS[name]
    painted = PaletteReflectance("tile", Reflectance("tile", GRID, np.linspace(0.1, 0.7, GRID.size)))
    store_problem(
        palette,
        PaletteProblem(
            GRID, (PaletteLight(lamp("first", 0.2)), wanted), (PaletteReflectance("a"), painted),
            ((Cell.fixed(COLOR), Cell.ignore()), (Cell.ignore(), Cell.ignore())),
        ),
    )  # fmt: skip
    problem = palette_problem(palette)
    got = problem.lights[1]
    assert (got.name, got.free) == (wanted.name, wanted.free)
    assert got.spectrum.source == wanted.spectrum.source
    np.testing.assert_allclose(got.spectrum.values, wanted.spectrum.values, rtol=1e-5)
    assert got.luminance == (None if wanted.luminance is None else pytest.approx(wanted.luminance, rel=1e-5))
    assert (got.white_xyz is None) == (wanted.white_xyz is None)
    if wanted.white_xyz is not None:  # a chromaticity: its scale is free
        np.testing.assert_allclose(got.white_xyz / got.white_xyz[1], wanted.white_xyz / wanted.white_xyz[1], rtol=1e-5)
    for mine, theirs in ((got.primaries, wanted.primaries), (got.variants, wanted.variants)):
        assert [each.name for each in mine] == [each.name for each in theirs]
        for one, other in zip(mine, theirs, strict=True):
            shape = one.values / one.values.sum()
            np.testing.assert_allclose(shape, other.values / other.values.sum(), rtol=1e-5)
    np.testing.assert_allclose(xyz_of(problem.lights[0].spectrum)[1], xyz_of(lamp("first", 0.2))[1], rtol=1e-5)
    assert problem.reflectances[0].free and not problem.reflectances[1].free
    np.testing.assert_allclose(problem.reflectances[1].spectrum.values, painted.spectrum.values, rtol=1e-6)
    assert (palette.lights[1].spectral.source == "CATALOGUE") == (name == "of the catalogue")
