# SPDX-License-Identifier: GPL-3.0-or-later
"""Possible?: the colors of a cell beside exact cells, compared with linear programs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from spectral_core.errors import InvalidInputError
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.reach.possible import SECTION_LIMIT, possible_colors, section_linear_rgb
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


def feasible(line, *held) -> np.ndarray:
    """Which colors of a line a reflectance has under HP1 beside the exact ones, by two programs."""
    start, along = line[0], line[-1] - line[0]
    places = (line - start) @ along / (along @ along)
    np.testing.assert_allclose(start + places[:, None] * along, line, atol=1e-12)
    equations = np.concatenate([MATRICES[1], *(MATRICES[k] for k in held)])
    equations = np.column_stack([equations, np.append(-along, np.zeros(3 * len(held)))])
    wanted = np.concatenate([start, *(COLORS[k] for k in held)])
    ends = []
    for sign in (1, -1):
        cost = np.append(np.zeros(GRID.size), sign)
        bounds = [(0, 1)] * GRID.size + [(None, None)]
        ends.append(linprog(cost, A_eq=equations, b_eq=wanted, bounds=bounds, method="highs-ds"))
    if any(each.status for each in ends):
        assert all(each.status == 2 for each in ends)
        return np.zeros(len(line), dtype=bool)
    return (places >= ends[0].x[-1]) & (places <= ends[1].x[-1])


@pytest.mark.parametrize("held", [(), (0,), (0, 2)])
def test_sections_and_nearest_colors_agree_with_programs(held) -> None:
    row = [Cell.fixed(COLORS[k], exact=k in held) if k != 1 else Cell.fixed([0.9, 0.1, 0.1]) for k in range(3)]
    found = possible_colors(problem(*row), (0, 1))
    assert [cell for _, cell in found.held] == list(held)
    assert len(found.open) == 2 - len(held)
    lightness = float(lab_from_linear_rgb(COLORS[1])[0])
    inside, colors = found.section(lightness, 23), section_linear_rgb(lightness, 23)
    truth = np.array([feasible(line, *held) for line in colors])
    assert 3 < truth.sum() < 400
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
    found = possible_colors(problem(*row), (0, 1))
    assert found.held == ((0, 2),)
    shown = found.nearest(COLORS[1]).reflectance
    np.testing.assert_allclose(MATRICES[2] @ shown, MATRICES[0] @ shown, atol=1e-5)  # whatever color both have
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
    # a material without any light under D65 has none under sodium light
    assert np.abs(found.nearest([0.5, 0.3, 0.0]).color).max() < 1e-6


@pytest.mark.parametrize("chained", [False, True])
def test_a_cell_that_takes_its_color_from_the_asked_one_follows_it(chained) -> None:
    """Two lamps of one color under which a reflectance has any brightness; no color is a limit."""
    blue = normalized(illuminant("D65"))
    twin = Illuminant("twin", blue.grid, blue.values * (1 + 0.3 * np.cos(blue.grid.wavelengths_nm / 9.0)))
    lights = tuple(PaletteLight(each) for each in (blue, twin, twin))
    rest = Cell.constant((0, 1), exact=True) if chained else Cell.ignore()
    row = (Cell.ignore(), Cell.constant((0, 0), exact=True), rest)
    asked = PaletteProblem(GRID, lights, (PaletteReflectance("leaf"),), (row,))
    solved = solve_palette(asked.with_cell((0, 0), Cell.fixed((0.2, 0.1, 0.1))))
    wanted = solved.actual_linear_rgb[0, 0]
    found = possible_colors(asked, (0, 0))
    assert found.held == (((0, 1), (0, 2)) if chained else ((0, 1),))
    nearest = found.nearest(wanted)
    assert nearest.reachable
    for light in (twin, blue):
        shown = linear_rgb_from_product(light, GRID) @ nearest.reflectance
        np.testing.assert_allclose(shown, wanted, atol=1e-5)
    red = found.nearest((2.0, 0.0, 0.0))
    assert not red.reachable
    for cell, share in found.in_the_way(red):  # released, a cell leaves the color less far away, or as far
        assert cell in found.held and 0 < share <= 1
        assert found.without(cell, (2.0, 0.0, 0.0)) <= red.delta_e_2000 + 0.5
    np.testing.assert_allclose(linear_rgb_from_product(twin, GRID) @ red.reflectance, red.color, atol=1e-5)


def nearest_by_a_general_solver(wanted, rows, lower, upper, bounds=(0, 1)):
    """Least largest distance of a color under HP1 from a wanted one, with limits on rows, by a linear program."""
    size = GRID.size
    up = np.concatenate([MATRICES[1], -MATRICES[1]])
    target = np.concatenate([wanted, -np.asarray(wanted)])
    within = np.concatenate([np.hstack([up, -np.ones((6, 1))]), np.hstack([rows, np.zeros((len(rows), 1))]),
                             np.hstack([-rows, np.zeros((len(rows), 1))])])  # fmt: skip
    right = np.concatenate([target, upper, -np.asarray(lower)])
    limits = [bounds] * size + [(0, None)]
    answer = linprog(np.append(np.zeros(size), 1.0), A_ub=within, b_ub=right, bounds=limits, method="highs-ipm")
    return answer.fun if answer.status == 0 else np.inf


def test_the_range_of_an_exact_free_cell_must_hold() -> None:
    """A range was ignored: colors were called possible that no solve reaches."""
    low, high = COLORS[0] - 0.02, COLORS[0] + 0.02
    found = possible_colors(problem(Cell.free((low, high), exact=True), Cell.ignore(), Cell.ignore()), (0, 1))
    assert found.held == ((0, 0),)
    rng = np.random.default_rng(7)
    possible = 0
    for _ in range(30):
        wanted = MATRICES[1] @ np.clip(VALUES + rng.normal(scale=0.1) + rng.normal(scale=0.1, size=GRID.size), 0, 1)
        nearest = found.nearest(wanted)
        shown = MATRICES[0] @ nearest.reflectance
        assert np.all(shown > low - 1e-6) and np.all(shown < high + 1e-6)
        assert nearest.reachable == (nearest_by_a_general_solver(wanted, MATRICES[0], low, high) < 1e-6)
        possible += nearest.reachable
        if not nearest.reachable:
            assert found.in_the_way(nearest)[0][0] == (0, 0)
            assert found.without((0, 0), wanted) < nearest.delta_e_2000
    assert 3 < possible < 29


def test_a_cell_that_follows_keeps_its_range_and_is_named() -> None:
    row = (Cell.ignore(), Cell.fixed(COLORS[1]), Cell.constant((0, 1), exact=True))
    shared = possible_colors(problem(*row), (0, 1)).nearest(COLORS[1]).color
    low, high = shared - 0.01, shared + 0.01
    boxed = Cell(row[2].mode, others=row[2].others, box=(low, high), exact=True)
    plain, held = possible_colors(problem(*row), (0, 1)), possible_colors(problem(*row[:2], boxed), (0, 1))
    difference = MATRICES[2] - MATRICES[1]
    for wanted in (shared, shared * 0.5, COLORS[1]):
        for found, rows, lower, upper in (
            (plain, difference, np.zeros(3), np.zeros(3)),
            (held, np.concatenate([difference, MATRICES[2]]), [0, 0, 0, *low], [0, 0, 0, *high]),
        ):
            nearest = found.nearest(wanted)
            assert nearest.reachable == (nearest_by_a_general_solver(wanted, rows, lower, upper) < 1e-6)
            if not nearest.reachable:
                assert found.in_the_way(nearest)[0][0] == (0, 2)
                assert found.without((0, 2), wanted) == pytest.approx(found.alone(wanted), abs=1e-6)


@pytest.mark.parametrize("bounds", [(0.1, 0.6), (-np.inf, np.inf), (0.0, np.inf)])
def test_bounds_of_reflectances_are_those_of_the_palette(bounds) -> None:
    """0 to 1 was assumed: with unphysical spectra, colors that a solve meets were called impossible."""
    lights = tuple(PaletteLight(light) for light in LIGHTS)
    row = (Cell.fixed(COLORS[0] + 0.15, exact=True), Cell.ignore(), Cell.ignore())
    asked = PaletteProblem(GRID, lights, (PaletteReflectance("leaf"),), (row,), reflectance_bounds=bounds)
    found = possible_colors(asked, (0, 1))
    limits = tuple(end if np.isfinite(end) else None for end in bounds)
    for wanted in ((0.9, 0.5, 0.1), (0.5, 0.3, 0.05), (2.0, -0.5, 0.1), MATRICES[1] @ np.full(GRID.size, 0.3)):
        nearest = found.nearest(wanted)
        exact = COLORS[0] + 0.15
        assert nearest.reachable == (nearest_by_a_general_solver(wanted, MATRICES[0], exact, exact, limits) < 1e-6)
        assert nearest.reflectance.min() >= bounds[0] - 1e-12 and nearest.reflectance.max() <= bounds[1] + 1e-12
        solved = solve_palette(asked.with_cell((0, 1), Cell.fixed(wanted, exact=True)), explain=False)
        assert nearest.reachable == solved.status.usable
    assert found.section(50.0, 5).all() == np.isinf(bounds[0])


def line(nm: float, width: float) -> Illuminant:
    grid = SpectralGrid(np.array([nm - width, nm, nm + width]))
    return normalized(Illuminant("line", grid, np.array([0.0, 1.0, 0.0])))


@pytest.mark.parametrize("lamp", [line(589.0, 0.01), line(450.0, 5.0), normalized(illuminant("LPS"))])
def test_colors_under_a_line_lamp(lamp: Illuminant) -> None:
    """They are nearly on one ray: the section was an error or most of the plane, and possible ones were not."""
    lights = (PaletteLight(lamp), PaletteLight(LIGHTS[0]))
    asked = PaletteProblem(GRID, lights, (PaletteReflectance("leaf"),), ((Cell.ignore(), Cell.ignore()),))
    found, matrix = possible_colors(asked, (0, 0)), linear_rgb_from_product(lamp, GRID)
    for values in np.random.default_rng(3).uniform(size=(5, GRID.size)):
        assert found.nearest(matrix @ values).reachable
    assert found.section(50.0, 21).sum() <= 2
    assert not found.nearest([0.2, 0.2, 0.2]).reachable


def test_a_light_that_shows_nothing_shows_black() -> None:
    dark = Illuminant("infrared", SpectralGrid(np.array([900.0, 950.0, 1000.0])), np.ones(3))
    asked = PaletteProblem(GRID, (PaletteLight(dark),), (PaletteReflectance("leaf"),), ((Cell.ignore(),),))
    found = possible_colors(asked, (0, 0))
    nearest = found.nearest([0.2, 0.2, 0.2])
    assert not nearest.reachable and not np.any(nearest.color)
    assert not found.section(50.0, 5).any()


def test_a_cell_without_weight_is_not_among_those_that_may_be_missed() -> None:
    row = (Cell.fixed(COLORS[0], weight=0.0), Cell.ignore(), Cell.fixed(COLORS[2]))
    assert possible_colors(problem(*row), (0, 1)).open == ((0, 2),)
