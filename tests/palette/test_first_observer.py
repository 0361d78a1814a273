# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes whose first observer is not that of 1931: tools beside the solution use that observer."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.alternatives import alternatives
from spectral_core.palette.paint.mixtures import tint_differences
from spectral_core.palette.paint.tints import solve_with_tints
from spectral_core.palette.presets import design_grid
from spectral_core.palette.reach.possible import possible_colors
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import normalized

OTHER = "cie_1964_10deg"
LIGHTS = [normalized(illuminant(name), luminance=2.0) for name in ("D65", "HP1")]
GRID = design_grid()


def color_10deg(light, values) -> np.ndarray:
    """Linear sRGB by sums at 0.05 nm over colour-science's table of the 10° observer."""
    colour = pytest.importorskip("colour")
    table = colour.MSDS_CMFS["CIE 1964 10 Degree Standard Observer"]
    nm = np.arange(380.0, 780.001, 0.05)
    cmfs = np.stack([np.interp(nm, table.wavelengths, table.values[:, k]) for k in range(3)])
    power = light.at(nm) * np.interp(nm, GRID.wavelengths_nm, values) * 0.05
    power[[0, -1]] /= 2
    return colour.RGB_COLOURSPACES["sRGB"].matrix_XYZ_to_RGB @ (cmfs @ power)


def problem(*rows: tuple[Cell, ...], observers: tuple[str, ...] = (OTHER,)) -> PaletteProblem:
    materials = tuple(PaletteReflectance(f"m{k}") for k in range(len(rows)))
    return PaletteProblem(GRID, tuple(map(PaletteLight, LIGHTS)), materials, rows, observers=observers)


def test_possible_colors_are_those_of_the_first_observer() -> None:
    """They were those of 1931: a nearest color that the solution then missed by ΔE 10."""
    asked = problem((Cell.fixed((0.3, 0.25, 0.2), exact=True), Cell.fixed((0.1, 0.3, 0.3))))
    found = possible_colors(asked, (0, 1))
    nearest = found.nearest((0.1, 0.3, 0.3))
    assert not nearest.reachable
    np.testing.assert_allclose(color_10deg(LIGHTS[0], nearest.reflectance), (0.3, 0.25, 0.2), atol=2e-4)
    np.testing.assert_allclose(color_10deg(LIGHTS[1], nearest.reflectance), nearest.color, atol=2e-4)
    solution = solve_palette(asked.with_cell((0, 1), Cell.fixed(nearest.color, weight=100.0)))
    assert solution.delta_e_2000[0, 1] < 0.2
    inside = [color_10deg(LIGHTS[1], np.full(GRID.size, level)) for level in (0.0, 0.5, 1.0)]
    free = possible_colors(problem((Cell.ignore(), Cell.free())), (0, 1))
    for toward in product((-1.0, 1.0), repeat=3):
        assert free.reach.extent(toward)[0] > max(np.array(toward) @ color for color in inside) - 2e-4
    held = found.held[0]
    assert found.without(held, (0.1, 0.3, 0.3)) == pytest.approx(found.alone((0.1, 0.3, 0.3)), abs=1e-6)
    assert found.without(held, inside[1]) < 0.01


def test_tints_match_for_the_first_observer() -> None:
    """They were designed for it, but the difference was that for the observer of 1931."""
    day, night = Cell.fixed((0.4, 0.3, 0.2), exact=True), (Cell.fixed((0.5, 0.3, 0.02)), Cell.fixed((0.3, 0.25, 0.02)))
    asked = problem((day, night[0]), (Cell.same_as((0, 0), exact=True), night[1]))
    solution = solve_with_tints(asked)
    assert solution.residuals["tint_delta_e_2000"] < 0.5
    assert tint_differences(solution, [(0, 1)])[0, 0, 0] < 0.5
    assert not any("first observer" in note for note in solution.notes)
    several = solve_with_tints(problem(*asked.cells, observers=(OTHER, "cie_1931_2deg")), iterations=1)
    assert any("tints are matched for the first observer" in note for note in several.notes)


def test_alternatives_are_apart_for_the_first_observer() -> None:
    asked = problem((Cell.fixed((0.3, 0.25, 0.2), exact=True), Cell.ignore()))
    plain, *others = alternatives(asked, count=3)
    assert others
    for each in others:
        (surface,) = each.solution.reflectances
        np.testing.assert_allclose(color_10deg(LIGHTS[0], surface.values), (0.3, 0.25, 0.2), atol=2e-4)
        shown = [colour_lab(color_10deg(LIGHTS[1], item.values)) for item in (surface, plain.solution.reflectances[0])]
        assert each.apart == pytest.approx(delta_e(*shown), abs=0.05)


def colour_lab(rgb: np.ndarray) -> np.ndarray:
    colour = pytest.importorskip("colour")
    white = colour.xy_to_XYZ(colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"]["D65"])
    xyz = np.linalg.inv(colour.RGB_COLOURSPACES["sRGB"].matrix_XYZ_to_RGB) @ rgb
    share = xyz / white
    f = np.where(share > (6 / 29) ** 3, np.cbrt(share), share * (29 / 6) ** 2 / 3 + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def delta_e(one: np.ndarray, other: np.ndarray) -> float:
    return float(pytest.importorskip("colour").delta_E(one, other, method="CIE 2000"))
