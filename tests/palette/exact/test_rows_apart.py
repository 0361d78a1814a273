# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact cells that share no color with those in conflict hold to the last digits, in a solve and in a live edit."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, PaletteSession, solve_palette
from spectral_core.palette.presets import design_grid
from spectral_core.palette.solution import PaletteStatus
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import linear_rgb_from_product, normalized

DAY, LINE, BULB = (normalized(illuminant(name)) for name in ("D65", "LPS", "A"))
HELD = (0.3, 0.25, 0.2)
NONE = Cell.ignore()


def palette(pair: tuple[Cell, ...], mate: tuple[Cell, ...], weight: float) -> PaletteProblem:
    """Two materials with cells to choose, and one that has an exact color by day and a color beyond it under a bulb."""
    return PaletteProblem(
        design_grid(),
        tuple(PaletteLight(light) for light in (DAY, LINE, BULB)),
        tuple(PaletteReflectance(name) for name in ("pair", "mate", "other")),
        (pair, mate, (Cell.fixed(HELD, exact=True), NONE, Cell.fixed((0.0, 0.6, 0.1), weight=weight))),
    )


def miss(reflectance: np.ndarray) -> float:
    shown = linear_rgb_from_product(DAY, design_grid()) @ reflectance
    return float(np.abs(shown - HELD).max())


@pytest.mark.parametrize("weight", [1.0, 50.0])
def test_a_conflict_of_two_materials_leaves_a_third_its_exact_color(weight: float) -> None:
    """It missed its color by up to 3e-3 in linear RGB."""
    pair = (Cell.fixed((0.1, 0.2, 0.6), exact=True), NONE, NONE)
    problem = palette(pair, (NONE, Cell.same_as((0, 0), exact=True), NONE), weight)
    solution = solve_palette(problem)
    assert solution.status is PaletteStatus.EXACT_CONFLICT
    assert miss(solution.reflectances[2].values) < 1e-9
    session = PaletteSession(problem)
    for green in (0.5, 0.55, 0.6):
        answer = session.edit((2, 2), Cell.fixed((0.0, green, 0.1), weight=weight))
        assert miss(answer.state.reflectances[2]) < 1e-9
        assert session.solution().status is PaletteStatus.EXACT_CONFLICT


def test_a_material_that_only_black_makes_exact_leaves_a_third_its_exact_color() -> None:
    """The third material missed its color by ΔE 15."""
    pair = (Cell.fixed((0.2, 0.2, 0.2)), Cell.same_as((0, 2), exact=True), NONE)
    solution = solve_palette(palette(pair, (Cell.fixed((0.1, 0.1, 0.1)), NONE, NONE), 50.0))
    assert solution.status is PaletteStatus.EXACT_CONFLICT and "can be exact only in black" in solution.remedy
    assert miss(solution.reflectances[2].values) < 1e-9
    np.testing.assert_allclose(solution.actual_linear_rgb[0, 1], solution.actual_linear_rgb[0, 2], atol=1e-3)
