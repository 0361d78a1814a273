# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes with extreme numbers: the remedy names the cells or lights, what was given, what is expected, what to do."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, PaletteStatus, solve_palette
from spectral_core.palette.assemble.state import initial_state
from spectral_core.palette.inaccurate import excluded_pair, extreme_number
from spectral_core.spectra.observer import linear_rgb_from_product
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

GRID = SpectralGrid(np.linspace(400.0, 700.0, 31))
LAMP = Illuminant("lamp", GRID, np.full(31, 0.01))


def palette(*cells: Cell, lights: tuple[PaletteLight, ...] = ()) -> PaletteProblem:
    """One material under as many lamps as cells."""
    return PaletteProblem(
        GRID, lights or (PaletteLight(LAMP),) * len(cells), (PaletteReflectance("paint"),), (tuple(cells),)
    )


@pytest.mark.parametrize("gap", [1e-5, 1e-7, 1e-8])
def test_exact_cells_that_exclude_each_other_are_named_however_near_they_are(gap: float) -> None:
    """A difference of 1e-7 had been called inaccurate, with advice about weights."""
    color = np.array([0.3, 0.3, 0.3])
    solution = solve_palette(palette(Cell.fixed(color, exact=True), Cell.fixed(color + gap, exact=True)))
    assert solution.status is PaletteStatus.EXACT_CONFLICT
    assert "“paint” under “lamp” (1) and “paint” under “lamp” (2) must be exact" in solution.remedy
    assert f"differ by {gap:.2g} in linear RGB" in solution.remedy
    assert "differ by 0 at most" in solution.remedy
    assert "Give both cells one color" in solution.remedy


def test_pairs_that_lights_can_show_exclude_nothing() -> None:
    other = Illuminant("other", GRID, np.linspace(0.005, 0.015, 31))
    cells = Cell.fixed([0.3] * 3, exact=True), Cell.fixed([0.31] * 3, exact=True)
    near = palette(*cells, lights=(PaletteLight(LAMP), PaletteLight(other)))
    assert excluded_pair(near, initial_state(near)) == ""
    free = palette(*cells, lights=(PaletteLight(LAMP), PaletteLight(LAMP, free=True)))
    assert excluded_pair(free, initial_state(free)) == ""
    soft = palette(cells[0], Cell.fixed([0.5] * 3))
    assert excluded_pair(soft, initial_state(soft)) == ""


def test_a_color_of_a_trillion_is_named_with_what_is_expected() -> None:
    solution = solve_palette(palette(Cell.fixed([1e12] * 3), lights=(PaletteLight(LAMP, free=True),)), seconds=0.2)
    assert not solution.status.trusted
    assert "“paint” under “lamp” has the color 1e+12 in linear RGB, where white is 1" in solution.remedy
    assert "Expected are colors up to 1000" in solution.remedy
    assert "multiply the power of the light" in solution.remedy


@pytest.mark.parametrize("size", [1e6, 1e8, 1e12])
def test_exact_cells_of_extreme_size_that_hold_are_no_conflict(size: float) -> None:
    """They miss by the rounding of large numbers; a conflict was reported for 35 of 40 palettes at 1e8."""
    rng = np.random.default_rng(4)
    warm = Illuminant("warm", GRID, np.linspace(0.002, 0.018, 31))
    lights = tuple(PaletteLight(lamp.scaled(size)) for lamp in (LAMP, warm))
    for _ in range(4):
        paint = 0.1 + 0.8 * rng.random(31)
        shown = [linear_rgb_from_product(light.spectrum, GRID) @ paint for light in lights]
        solution = solve_palette(palette(*(Cell.fixed(color, exact=True) for color in shown), lights=lights))
        assert solution.status is not PaletteStatus.EXACT_CONFLICT
        assert solution.status.trusted or "where white is 1" in solution.remedy


@pytest.mark.parametrize("size", [1.0, 1e6, 1e12])
def test_a_conflict_of_extreme_size_is_still_one(size: float) -> None:
    """No reflectance up to 1 is brighter than white, and none is green under a lamp of one narrow red line."""
    red = Illuminant("red", SpectralGrid([600.0, 630.0, 631.0, 632.0, 660.0]), [0.0, 0.0, 1.0, 0.0, 0.0])
    for lamp, color in ((LAMP, (2.0, 2.0, 2.0)), (red, (0.01, 0.2, 0.01))):
        light = PaletteLight(lamp.scaled(size))
        solution = solve_palette(palette(Cell.fixed(size * np.array(color), exact=True), lights=(light,)))
        assert solution.status is PaletteStatus.EXACT_CONFLICT


def test_lights_of_far_apart_power_are_named() -> None:
    dim = Illuminant("dim", GRID, np.full(31, 1e-9))
    given = palette(Cell.fixed([0.1] * 3), Cell.fixed([0.2] * 3), lights=(PaletteLight(LAMP), PaletteLight(dim)))
    text = extreme_number(given, initial_state(given))
    assert "under “lamp” and " in text
    assert "under “dim”; a ratio up to 1e+06 is expected" in text
    ordinary = palette(Cell.fixed([0.1] * 3))
    assert extreme_number(ordinary, initial_state(ordinary)) == ""


def test_a_material_that_exact_cells_make_black_is_reported():
    """Its reflectance is a rounding error, which only a light of far more power would show."""
    from benchmarks.palette.cases.hard import hard_problem

    solution = solve_palette(hard_problem(1926)[0])
    assert solution.status == "invisible"
    assert any("is black under every light" in note for note in solution.notes)
    assert "not exact" in solution.remedy


@pytest.mark.parametrize("exact", [False, True])
def test_a_color_under_a_light_that_no_observer_sees_is_reported_as_such(exact: bool) -> None:
    """If the cell was exact, the message asked for a release of cells that do not conflict with it."""
    infrared = PaletteLight(Illuminant("infrared", SpectralGrid.uniform(800, 900, 10), np.ones(11)))
    cells = (Cell.fixed([0.2] * 3, exact=True), Cell.fixed([0.1] * 3, exact=exact))
    solution = solve_palette(palette(*cells, lights=(PaletteLight(LAMP), infrared)))
    assert solution.status == "invisible"
    assert "Give the light power between 380 and 780 nm" in solution.remedy
    assert "light 'infrared' gives no color" in solution.notes


def test_exact_cells_that_exclude_each_other_beside_such_a_light_conflict() -> None:
    infrared = PaletteLight(Illuminant("infrared", SpectralGrid.uniform(800, 900, 10), np.ones(11)))
    cells = tuple(Cell.fixed([level] * 3, exact=True) for level in (0.2, 0.4, 0.1))
    lights = (PaletteLight(LAMP), PaletteLight(Illuminant("twin", LAMP.grid, LAMP.values)), infrared)
    assert solve_palette(palette(*cells, lights=lights)).status == "exact_conflict"
