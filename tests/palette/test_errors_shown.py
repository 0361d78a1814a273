# SPDX-License-Identifier: GPL-3.0-or-later
"""Displayed errors and statuses: every cell is compared with its own request."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.errors import SpectralError
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.conflicts import conflicting_cells
from spectral_core.palette.live.session import PaletteSession
from spectral_core.palette.presets import design_grid
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.color import RGB_FROM_XYZ, WHITE_XYZ, delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.observer import normalized, observer, xyz_of
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

GRID = design_grid()
D65, LED, HP1 = (normalized(illuminant(name)) for name in ("D65", "LED-B1", "HP1"))


def table(lights, *rows, **settings) -> PaletteProblem:
    columns = tuple(each if isinstance(each, PaletteLight) else PaletteLight(each) for each in lights)
    surfaces = tuple(PaletteReflectance(f"r{i}") for i in range(len(rows)))
    return PaletteProblem(GRID, columns, surfaces, rows, **settings)


def apart(one, other) -> float:
    return float(delta_e_2000(lab_from_linear_rgb(one), lab_from_linear_rgb(other)))


def test_a_constant_cell_shows_the_full_shift_under_the_other_light():
    problem = table((D65, LED), (Cell.fixed((0.1, 0.3, 0.35)), Cell.constant((0, 0))))
    solution = solve_palette(problem, explain=False)
    shift = apart(*solution.actual_linear_rgb[0])
    assert shift > 3
    assert solution.delta_e_2000[0, 1] == pytest.approx(shift, abs=1e-9)
    np.testing.assert_allclose(solution.target_linear_rgb[0, 1], solution.actual_linear_rgb[0, 0], rtol=1e-12)
    assert solution.status == "compromise"
    assert PaletteSession(problem).refine().delta_e_2000[0, 1] == pytest.approx(shift, abs=1e-3)


def test_the_worst_pair_of_a_group_decides_the_status():
    colors = [(0.30, 0.30, 0.30), (0.38, 0.30, 0.30), (0.30, 0.30, 0.38)]
    lights = (D65, Illuminant("twin", D65.grid, D65.values))
    rows = [(Cell.same_as((0, 0)) if i else Cell.free(), Cell.fixed(color, weight=5)) for i, color in enumerate(colors)]
    solution = solve_palette(table(lights, *rows), explain=False)
    shown = solution.actual_linear_rgb[:, 0]
    pairs = [apart(shown[a], shown[b]) for a, b in ((0, 1), (0, 2), (1, 2))]
    assert solution.delta_e_2000[1, 0] == pytest.approx(pairs[0], abs=1e-9)
    assert solution.delta_e_2000[0, 0] == pytest.approx(max(pairs[:2]), abs=1e-9)
    assert solution.max_delta_e_2000 == pytest.approx(max(pairs), abs=1e-9)


def test_a_boxed_cell_is_compared_with_the_nearest_color_of_its_box():
    box = ((0.6, 0.0, 0.0), (0.9, 0.1, 0.1))
    solution = solve_palette(table((HP1,), (Cell.free(box),)), explain=False)
    shown = solution.actual_linear_rgb[0, 0]
    inside = np.clip(shown, *np.array(box))
    np.testing.assert_allclose(solution.target_linear_rgb[0, 0], inside, atol=1e-12)
    assert solution.delta_e_2000[0, 0] == pytest.approx(apart(shown, inside), abs=1e-9)


def test_the_status_is_that_of_all_observers_and_variants():
    rows = [
        (Cell.fixed((0.25, 0.24, 0.2)), Cell.fixed((1, 0.25, 0))),
        (Cell.same_as((0, 0)), Cell.fixed((0.4, 0.1, 0))),
    ]
    lights = (PaletteLight(D65, variants=(normalized(illuminant("A")),)), HP1)
    problem = table(lights, *rows, observers=("cie_1931_2deg", "cie_1964_10deg"), robust_weight=1e-3)
    solution = solve_palette(problem, explain=False)
    viewers = [observer(name) for name in problem.observers]
    differences = []
    for viewer in viewers:
        scale = viewers[0].cmfs[1].sum() / viewer.cmfs[1].sum()
        for light in (D65, *lights[0].variants):
            colors = [scale * RGB_FROM_XYZ @ xyz_of(light, each, viewer) for each in solution.reflectances]
            differences.append(apart(*colors))
    assert differences[0] < 1 < max(differences)
    assert solution.delta_e_2000[1, 0] == pytest.approx(max(differences), rel=1e-3)
    assert solution.max_delta_e_2000 >= max(differences) - 0.01
    assert (solution.status == "compromise") == (solution.max_delta_e_2000 > 3)


def test_a_cell_of_weight_0_has_no_request():
    cells = (Cell.fixed((0.2, 0.2, 0.2)), Cell.fixed((0, 0.9, 0.9), weight=0.0))
    solution = solve_palette(table((D65, HP1), cells))
    assert solution.status == "solved"
    assert np.isnan(solution.delta_e_2000[0, 1])
    same = (Cell.fixed((0.2, 0.2, 0.2)), Cell.constant((0, 0), weight=0.0))
    assert np.isnan(solve_palette(table((D65, HP1), same)).delta_e_2000[0, 1])


@pytest.mark.parametrize("luminance", [None, 1.0])
def test_an_unreachable_white_has_a_separate_remedy(luminance):
    waves = np.array([400.0, 449, 450, 451, 469, 470, 471, 700])
    grid = SpectralGrid(waves)
    lasers = tuple(
        normalized(Illuminant(f"{at} nm", grid, (np.abs(waves - at) < 0.5).astype(float))) for at in (450, 470)
    )
    light = PaletteLight(lasers[0], free=True, primaries=lasers, white_xyz=WHITE_XYZ, luminance=luminance)
    surface = PaletteReflectance("skin", reflectance("light skin"))
    solution = solve_palette(PaletteProblem(GRID, (light,), (surface,), ((Cell.fixed((0.4, 0.3, 0.2)),),)))
    assert solution.status == "exact_conflict"
    assert "cannot make the white" in solution.remedy
    assert "380 and 780 nm" not in solution.remedy
    # It named the cell as the cause, too, and advised another color or less smoothness.
    assert not solution.conflicts
    assert "no other cell" not in solution.remedy
    exact = replace(solution.problem, cells=((Cell.fixed((0.4, 0.3, 0.2), exact=True),),))
    assert not conflicting_cells(solve_palette(exact))


def test_a_white_outside_of_all_lights_has_a_remedy_without_primaries() -> None:
    start = Illuminant("new", GRID, np.ones(GRID.size))
    light = PaletteLight(start, free=True, white_xyz=np.array([0.05, 0.05, 1.0]), luminance=1.0)
    solution = solve_palette(table((D65, light), (Cell.fixed((0.3,) * 3), Cell.fixed((0.3,) * 3))))
    assert solution.status == "exact_conflict"
    assert "No light has the white" in solution.remedy
    assert "primaries" not in solution.remedy


def test_conflicts_distinguish_equal_names():
    cells = (Cell.fixed((0.2, 0.2, 0.2), exact=True), Cell.fixed((0.4, 0.2, 0.2), exact=True))
    solution = solve_palette(table((D65, D65), cells))
    assert "“D65” (1)" in solution.conflicts[0].text or "“D65” (2)" in solution.conflicts[0].text


def test_a_perfect_white_is_white_for_the_only_observer():
    viewer = "cie_1964_10deg"
    light = normalized(illuminant("D65"), observer(viewer))
    white = Cell.fixed(RGB_FROM_XYZ @ xyz_of(light, None, observer(viewer)))
    solution = solve_palette(table((light,), (white,), observers=(viewer,), smoothness=0.0), explain=False)
    assert solution.max_delta_e_2000 < 0.05
    assert (np.linalg.inv(RGB_FROM_XYZ) @ solution.actual_linear_rgb[0, 0])[1] == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Cell.fixed("red"),
        lambda: Cell.fixed(None),
        lambda: Cell.fixed((0.1, 0.1, 0.1), weight="x"),
        lambda: Cell.fixed((0.1, 0.1, 0.1), exact="yes"),
        lambda: Cell.same_as(3),
        lambda: Cell.same_as((0.0, 0.0)),
        lambda: Cell.free((1, 2, 3)),
        lambda: Cell.free(((np.nan, 0, 0), (1, 1, 1))),
        lambda: Cell("nothing"),
        lambda: table((D65,), (Cell.ignore(),), rounds=2.5),
        lambda: table((D65,), (Cell.ignore(),), smoothness="much"),
        lambda: table((D65,), (None,)),
        lambda: table((D65,), ((0.1, 0.1, 0.1),)),
        lambda: PaletteProblem(GRID, (D65,), (PaletteReflectance("r"),), ((Cell.ignore(),),)),
        lambda: PaletteProblem(GRID, (PaletteLight(D65),), ("r",), ((Cell.ignore(),),)),
        lambda: PaletteProblem(GRID, (PaletteLight(D65),), "r", ((Cell.ignore(),),)),
        lambda: PaletteProblem(GRID, (PaletteLight(D65),), (PaletteReflectance("r"),), None),
        lambda: PaletteReflectance("r", "red"),
        lambda: PaletteLight("D65"),
    ],
)
def test_wrong_types_raise_errors_of_this_library(make):
    with pytest.raises(SpectralError):
        make()


def test_a_half_open_box_is_kept():
    box = ((-np.inf, 0.1, -np.inf), (np.inf, np.inf, 0.05))
    shown = solve_palette(table((D65,), (Cell.free(box),)), explain=False).actual_linear_rgb[0, 0]
    assert shown[1] >= 0.1 - 1e-3
    assert shown[2] <= 0.05 + 1e-3


def test_two_cells_that_refer_to_the_same_one_are_compared_with_each_other_too():
    """Each is near the common reference, on opposite sides; an observer compares the two cells."""
    twin = Illuminant("twin", D65.grid, D65.values)
    rows = [
        (Cell.fixed((0.3, 0.3, 0.3), weight=50), Cell.ignore()),
        (Cell.same_as((0, 0)), Cell.fixed((0.335, 0.3, 0.28))),
        (Cell.same_as((0, 0)), Cell.fixed((0.265, 0.3, 0.32))),
    ]
    solution = solve_palette(table((D65, twin), *rows), explain=False)
    pair = apart(*solution.actual_linear_rgb[1:, 0])
    assert np.nanmax(solution.delta_e_2000) < 3 < pair
    assert solution.residuals["worst_pair_delta_e_2000"] == pytest.approx(pair, abs=1e-9)
    assert solution.max_delta_e_2000 == pytest.approx(pair, abs=1e-9)
    assert solution.status == "compromise"


def test_the_box_of_a_cell_of_weight_0_holds_for_no_cell_that_refers_to_it() -> None:
    """Such a cell asks nothing; another cell should look like it, whatever its color."""
    white, black = ((0.9, 0.9, 0.9), (1.0, 1.0, 1.0)), ((0.0, 0.0, 0.0), (0.1, 0.1, 0.1))
    cells = (
        (Cell.free(white, weight=0.0),),
        (Cell.same_as((0, 0), box=black),),
    )
    materials = (PaletteReflectance("a"), PaletteReflectance("b"))
    solution = solve_palette(PaletteProblem(GRID, (PaletteLight(D65),), materials, cells))
    assert solution.status == "solved"
    assert solution.max_delta_e_2000 < 0.1
    assert solution.actual_linear_rgb.max() <= 0.1 + 1e-6
