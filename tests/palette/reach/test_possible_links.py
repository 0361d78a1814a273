# SPDX-License-Identifier: GPL-3.0-or-later
"""Possible? where materials match exactly: compared with linear programs in the reflectances of the whole table."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.assemble import programs
from spectral_core.palette.presets import metamer_pair
from spectral_core.palette.reach.possible import possible_colors
from spectral_core.spectra.catalogue import color_matching_functions, illuminant, reflectance
from spectral_core.spectra.color import RGB_FROM_XYZ, lab_from_linear_rgb
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import Reflectance, SpectralGrid

GRID = SpectralGrid.uniform(400, 700, 15)
LIGHTS = [normalized(illuminant(name), luminance=2.0) for name in ("D50", "HP1", "FL2")]
FINE = np.linspace(360, 830, 9401)
CMFS = np.stack([np.interp(FINE, color_matching_functions("cie_1931_2deg")[0], each)
                 for each in color_matching_functions("cie_1931_2deg")[1]])  # fmt: skip
HATS = np.stack([np.interp(FINE, GRID.wavelengths_nm, each, left=0, right=0) for each in np.eye(GRID.size)])
SEEN = [RGB_FROM_XYZ @ (CMFS * np.interp(FINE, light.grid.wavelengths_nm, light.values, left=0, right=0)) * 0.05
        for light in LIGHTS]  # fmt: skip
ROWS = [seen @ HATS.T for seen in SEEN]
FAR = 1e-4
"""Linear RGB within which the fine steps and the library's exact integrals agree."""


def palette(cells, measured=()) -> PaletteProblem:
    items = [PaletteReflectance(f"row {i}", dict(measured).get(i)) for i in range(len(cells))]
    return PaletteProblem(GRID, tuple(map(PaletteLight, LIGHTS)), tuple(items), cells)


def least_miss(problem: PaletteProblem, asked, wanted) -> float:
    """Least largest miss of all exact cells but ``asked``, which has the color ``wanted``; by one linear program."""
    size = GRID.size
    free = [i for i, item in enumerate(problem.reflectances) if item.free]
    total = size * len(free)

    def color(cell) -> tuple[np.ndarray, np.ndarray]:
        found, surface = np.zeros((3, total)), problem.reflectances[cell[0]].spectrum
        if surface is not None:
            return found, SEEN[cell[1]] @ np.interp(FINE, surface.grid.wavelengths_nm, surface.values, left=0, right=0)
        begin = size * free.index(cell[0])
        found[:, begin : begin + size] = ROWS[cell[1]]
        return found, np.zeros(3)

    limits = [(*color(asked), wanted, wanted)]
    for i, line in enumerate(problem.cells):
        for j, cell in enumerate(line):
            if not cell.exact or (i, j) == asked:
                continue
            own, constant = color((i, j))
            if cell.target is not None or cell.mode == "black":
                target = np.zeros(3) if cell.target is None else cell.target
                limits.append((own, constant, target, target))
            for other in cell.others:
                theirs, known = color(other)
                limits.append((own - theirs, constant - known, np.zeros(3), np.zeros(3)))
            if cell.box is not None:
                limits.append((own, constant, *cell.box))
    above = np.concatenate([np.concatenate([rows, -rows]) for rows, *_ in limits])
    ends = np.concatenate([np.concatenate([high - known, known - low]) for _, known, low, high in limits])
    answer = linprog(np.append(np.zeros(total), 1.0), A_ub=np.hstack([above, -np.ones((len(above), 1))]), b_ub=ends,
                     bounds=[(0, 1)] * total + [(0, None)], method="highs-ipm")  # fmt: skip
    return float(answer.fun)


def distance(one: np.ndarray, other: np.ndarray) -> float:
    """Between two colors in CIELAB."""
    return float(np.linalg.norm(lab_from_linear_rgb(one) - lab_from_linear_rgb(other)))


LEAF = reflectance("foliage").at(GRID.wavelengths_nm)
BOX = (ROWS[0] @ LEAF - 0.05, ROWS[0] @ LEAF + 0.05)
EXACT = {
    "a free color of another material": (
        (Cell.free(), Cell.ignore(), Cell.fixed(ROWS[2] @ LEAF, exact=True)),
        (Cell.same_as((0, 0), exact=True), Cell.fixed((0.3, 0.3, 0.1)), Cell.ignore()),
    ),
    "a wanted color that may be missed": (
        (Cell.fixed((0.3, 0.3, 0.3)), Cell.fixed(ROWS[1] @ LEAF, exact=True), Cell.ignore()),
        (Cell.same_as((0, 0), exact=True), Cell.ignore(), Cell.ignore()),
    ),
    "another material that takes its color": (
        (Cell.same_as((1, 0), exact=True), Cell.same_as((1, 1), exact=True), Cell.fixed(ROWS[2] @ LEAF, exact=True)),
        (Cell.free(), Cell.ignore(), Cell.ignore()),
    ),
    "a chain over three materials": (
        (Cell.same_as((1, 0), exact=True), Cell.same_as((2, 1), exact=True), Cell.ignore()),
        (Cell.free(BOX, exact=True), Cell.ignore(), Cell.ignore()),
        (Cell.fixed(ROWS[0] @ LEAF, exact=True), Cell.ignore(), Cell.fixed(ROWS[2] @ LEAF, exact=True)),
    ),
    "a measured material": (
        (Cell.ignore(), Cell.ignore(), Cell.ignore()),
        (Cell.same_as((0, 0), exact=True), Cell.ignore(), Cell.ignore()),
    ),
}


@pytest.mark.parametrize("kind", EXACT)
def test_colors_are_possible_where_all_exact_cells_can_hold(kind: str) -> None:
    """Exact cells that refer to others had to keep their present color, and those of other materials did not count."""
    measured = {0: reflectance("orange")} if kind == "a measured material" else {}
    problem, asked = palette(EXACT[kind], measured), (1, 1)
    found = possible_colors(problem, asked)
    rng, counts = np.random.default_rng(5), {True: 0, False: 0}
    for _ in range(24):
        bumps = np.interp(GRID.wavelengths_nm, np.linspace(400, 700, 5), rng.uniform(-0.4, 0.4, 5))
        wanted = ROWS[1] @ np.clip(LEAF + bumps, 0, 1)
        nearest, miss = found.nearest(wanted), least_miss(problem, asked, wanted)
        assert nearest.reachable == (miss < FAR) or FAR / 10 < miss < 10 * FAR
        assert least_miss(problem, asked, nearest.color) < FAR
        counts[nearest.reachable] += 1
        if not nearest.reachable:
            ((row, column), _), *_ = found.in_the_way(nearest)
            assert problem.cells[row][column].exact
            # In CIELAB, in which both are nearest: ΔE2000 may grow.
            released = possible_colors(problem.with_cell((row, column), Cell.ignore()), asked).nearest(wanted)
            assert distance(released.color, wanted) < distance(nearest.color, wanted) + 1e-3
            assert found.without((row, column), wanted) == pytest.approx(released.delta_e_2000, abs=1e-6)
    assert counts[True] and (counts[False] or not kind.startswith("a wanted"))


def test_both_materials_of_a_pair_have_the_same_colors() -> None:
    """One that was solved was called impossible by ΔE 2.7, as the pair had to keep its common color."""
    problem, wanted = metamer_pair(), (0.188, 0.163, 0.026)
    for row in (0, 1):
        assert possible_colors(problem, (row, 0)).nearest(wanted).reachable
        assert solve_palette(problem.with_cell((row, 0), Cell.fixed(wanted))).max_delta_e_2000 < 1.5


def test_many_materials_of_one_color_do_not_make_the_question_larger() -> None:
    """They can have the reflectance that is asked about; of others, each adds its unknowns."""
    rows = [(Cell.free(), Cell.ignore(), Cell.ignore())]
    rows += [(Cell.same_as((0, 0), exact=True), Cell.fixed((0.2, 0.2, 0.1)), Cell.ignore()) for _ in range(12)]
    assert possible_colors(palette(tuple(rows)), (5, 1)).reach.matrix.shape == (3, GRID.size)
    rows[3] = (rows[3][0], Cell.fixed(ROWS[1] @ LEAF, exact=True), Cell.ignore())
    assert possible_colors(palette(tuple(rows)), (5, 1)).reach.matrix.shape == (3, 2 * GRID.size)


def test_the_reflectance_of_the_nearest_color_is_that_of_the_material() -> None:
    nearest = possible_colors(palette(EXACT["a chain over three materials"]), (1, 1)).nearest((0.3, 0.3, 0.1))
    shown = ROWS[1] @ Reflectance("found", GRID, nearest.reflectance).values
    np.testing.assert_allclose(shown, nearest.color, atol=FAR)


@pytest.mark.parametrize("kind", EXACT)
def test_many_materials_have_the_answers_of_few(kind: str, monkeypatch) -> None:
    """Sparse programs, in place of dense ones whose time grows with the cube of the number of materials."""
    problem = palette(EXACT[kind], {0: reflectance("orange")} if kind == "a measured material" else {})
    wanted = ROWS[1] @ LEAF * 1.3
    few = possible_colors(problem, (1, 1)).nearest(wanted)
    monkeypatch.setattr(programs, "LARGEST_DENSE", 1)
    many = possible_colors(problem, (1, 1)).nearest(wanted)
    np.testing.assert_allclose(many.color, few.color, atol=1e-6)
    np.testing.assert_allclose(many.in_the_way, few.in_the_way, rtol=0.02, atol=0.02)
