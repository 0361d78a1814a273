# SPDX-License-Identifier: GPL-3.0-or-later
"""Possible?: the colors of a cell beside exact cells, compared with linear programs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from spectral_core.errors import InvalidInputError
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.possible import SECTION_LIMIT, possible_colors, section_linear_rgb
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.observer import linear_rgb_from_product, normalized
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

GRID = SpectralGrid.uniform(400, 700, 10)
LIGHTS = [normalized(illuminant(name), luminance=level) for name, level in (("D65", 2.0), ("HP1", 1.0), ("A", 3.0))]
MATRICES = [linear_rgb_from_product(light, GRID) for light in LIGHTS]
VALUES = reflectance("foliage").at(GRID.wavelengths_nm)
COLORS = [matrix @ VALUES for matrix in MATRICES]


def problem(*row: Cell, measured=None) -> PaletteProblem:
    lights = tuple(PaletteLight(light) for light in LIGHTS)
    return PaletteProblem(GRID, lights, (PaletteReflectance("leaf", measured),), (row,))


def feasible(color, *held) -> bool:
    """True if a reflectance has ``color`` under HP1 and the exact colors, by one linear program."""
    equations = np.concatenate([MATRICES[1], *(MATRICES[k] for k in held)])
    wanted = np.concatenate([color, *(COLORS[k] for k in held)])
    return linprog(np.zeros(GRID.size), A_eq=equations, b_eq=wanted, bounds=(0, 1), method="highs-ipm").status == 0


@pytest.mark.parametrize("held", [(), (0,), (0, 2)])
def test_sections_and_nearest_colors_agree_with_programs(held) -> None:
    row = [Cell.fixed(COLORS[k], exact=k in held) if k != 1 else Cell.fixed([0.9, 0.1, 0.1]) for k in range(3)]
    found = possible_colors(problem(*row), (0, 1))
    assert [cell for _, cell in found.held] == list(held)
    assert len(found.open) == 2 - len(held)
    lightness = float(lab_from_linear_rgb(COLORS[1])[0])
    inside, colors = found.section(lightness, 23), section_linear_rgb(lightness, 23)
    truth = np.array([[feasible(color, *held) for color in line] for line in colors])
    assert not np.any(truth & ~inside)  # no possible color is missing
    grown = truth.copy()
    for axis in (0, 1):
        for step in (-1, 1):
            grown |= np.roll(truth, step, axis)
    assert not np.any(inside & ~grown)  # and the excess is less than a cell of 10 units
    nearest = found.nearest([0.9, 0.1, 0.1])
    shown = MATRICES[1] @ nearest.reflectance
    np.testing.assert_allclose(shown, nearest.color, atol=1e-6)
    for k in held:
        np.testing.assert_allclose(MATRICES[k] @ nearest.reflectance, COLORS[k], atol=1e-6)
    assert not nearest.reachable
    shares = found.in_the_way(nearest)
    assert sum(share for _, share in shares) == pytest.approx(1.0 if held else 0.0, abs=0.05)


def test_the_cell_with_the_largest_relief_is_listed_first() -> None:
    row = (Cell.fixed(COLORS[0], exact=True), Cell.fixed([0.2, 0.8, 0.1]), Cell.fixed(COLORS[2], exact=True))
    found = possible_colors(problem(*row), (0, 1))
    nearest = found.nearest([0.2, 0.8, 0.1])
    first = found.in_the_way(nearest)[0][0][1]
    released = {
        k: possible_colors(problem(*(Cell.ignore() if i == k else c for i, c in enumerate(row))), (0, 1))
        .nearest([0.2, 0.8, 0.1])
        .delta_e_2000
        for k in (0, 2)
    }
    assert released[first] <= min(released.values()) + 1.0


def test_designed_lights_and_cells_with_references() -> None:
    row = (Cell.fixed(COLORS[0]), Cell.fixed(COLORS[1]), Cell.constant((0, 0), exact=True))
    with pytest.raises(InvalidInputError, match="solve it"):
        possible_colors(problem(*row), (0, 1))
    found = possible_colors(problem(*row), (0, 1), actual=[[COLORS[0], COLORS[1], COLORS[2]]])
    assert found.held == ((0, 2),)
    other = [LIGHTS[0], LIGHTS[2], LIGHTS[2]]
    color = possible_colors(problem(*row[:2], Cell.ignore()), (0, 1), lights=other).nearest(COLORS[2])
    assert color.reachable
    assert delta_e_2000(lab_from_linear_rgb(color.color), lab_from_linear_rgb(COLORS[2])) < 1e-3


def test_a_measured_material_has_one_color() -> None:
    measured = problem(*[Cell.ignore()] * 3, measured=reflectance("foliage"))
    with pytest.raises(InvalidInputError, match="it shows the one color that it has"):
        possible_colors(measured, (0, 1))
    assert SECTION_LIMIT > 100


@pytest.mark.parametrize("lightness", [3.0, 40.0, 90.0])
def test_a_section_is_a_square_of_cielab(lightness: float) -> None:
    """a* in columns and b* upward in rows, also where the cube root ends; against colors by the library's CIELAB."""
    size = 7
    lab = lab_from_linear_rgb(section_linear_rgb(lightness, size))
    axis = np.linspace(-SECTION_LIMIT, SECTION_LIMIT, size)
    np.testing.assert_allclose(lab[..., 0], lightness, atol=1e-6)
    np.testing.assert_allclose(lab[..., 1], np.broadcast_to(axis, (size, size)), atol=1e-6)
    np.testing.assert_allclose(lab[..., 2], np.broadcast_to(axis[:, None], (size, size)), atol=1e-6)


def test_a_released_cell_leaves_the_distance_of_the_palette_without_it() -> None:
    row = (Cell.fixed(COLORS[0], exact=True), Cell.fixed([0.2, 0.8, 0.1]), Cell.fixed(COLORS[2], exact=True))
    found = possible_colors(problem(*row), (0, 1))
    for k in (0, 2):
        alone = possible_colors(problem(*(Cell.ignore() if i == k else c for i, c in enumerate(row))), (0, 1))
        expected = alone.nearest([0.2, 0.8, 0.1]).delta_e_2000
        assert found.without((0, k), [0.2, 0.8, 0.1]) == pytest.approx(expected, abs=1e-6)


def test_black_and_ignored_cells_hold_black_and_nothing() -> None:
    row = (Cell.black(exact=True), Cell.fixed([0.2, 0.8, 0.1]), Cell.fixed(COLORS[2], weight=3.0))
    found = possible_colors(problem(*row), (0, 1))
    assert found.held == ((0, 0),) and found.open == ((0, 2),)
    ((light, color),) = found.exact
    assert light is LIGHTS[0] and not np.any(color)
    # a material without any light under D65 has none under sodium light
    assert np.abs(found.nearest([0.5, 0.3, 0.0]).color).max() < 1e-6


@pytest.mark.parametrize("chained", [False, True])
def test_a_cell_that_takes_its_color_from_the_asked_one_follows_it(chained) -> None:
    """Two lamps of one color under which a reflectance has any brightness; the present color is no limit."""
    blue = normalized(illuminant("D65"))
    twin = Illuminant("twin", blue.grid, blue.values * (1 + 0.3 * np.cos(blue.grid.wavelengths_nm / 9.0)))
    lights = tuple(PaletteLight(each) for each in (blue, twin, twin))
    rest = Cell.constant((0, 1), exact=True) if chained else Cell.ignore()
    row = (Cell.ignore(), Cell.constant((0, 0), exact=True), rest)
    asked = PaletteProblem(GRID, lights, (PaletteReflectance("leaf"),), (row,))
    solved = solve_palette(asked.with_cell((0, 0), Cell.fixed((0.2, 0.1, 0.1))))
    wanted = solved.actual_linear_rgb[0, 0]
    present = 0.5 * solved.actual_linear_rgb
    found = possible_colors(asked, (0, 0), actual=present)
    assert found.held == ()
    nearest = found.nearest(wanted)
    assert nearest.reachable
    for light in (twin, blue):
        shown = linear_rgb_from_product(light, GRID) @ nearest.reflectance
        np.testing.assert_allclose(shown, wanted, atol=1e-5)
    red = found.nearest((2.0, 0.0, 0.0))
    assert not red.reachable
    assert found.in_the_way(red) == ()
    np.testing.assert_allclose(linear_rgb_from_product(twin, GRID) @ red.reflectance, red.color, atol=1e-5)
