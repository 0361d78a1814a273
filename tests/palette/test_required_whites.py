# SPDX-License-Identifier: GPL-3.0-or-later
"""Whites that a designed light must have, at the ends of what can be stated."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

GRID = SpectralGrid.uniform(400, 700, 10)
START = Illuminant("start", GRID, np.full(GRID.size, 0.01))


@pytest.mark.parametrize("white", [(1e308, 1.0, 1.0), (1.0, 1e-300, 1.0), (1.0, 1.0, 2e4)])
def test_a_white_almost_without_luminance_is_refused(white: tuple[float, float, float]) -> None:
    """The solve ended in an error of a linear program."""
    with pytest.raises(InvalidInputError, match=r"X and Z of at most 10000 times Y.*violet light"):
        PaletteLight(START, free=True, white_xyz=np.array(white))


@pytest.mark.parametrize("size", [1e-300, 1.0, 1e300])
def test_a_white_may_have_any_luminance(size: float) -> None:
    light = PaletteLight(START, free=True, white_xyz=size * np.array([0.9505, 1.0, 1.089]))
    cells = ((Cell.fixed((0.3, 0.2, 0.1)),),)
    solution = solve_palette(PaletteProblem(GRID, (light,), (PaletteReflectance("a"),), cells), seconds=1)
    assert solution.status in ("solved", "still_improving")
    assert solution.max_delta_e_2000 < 0.01


@pytest.mark.parametrize("bounds", [(0.0, 1e-3), (0.5, np.inf)])
def test_bounds_that_exclude_a_luminance_are_the_cause_that_is_named(bounds: tuple[float, float]) -> None:
    """The remedy was to change exact cells, of which the palette has none."""
    light = PaletteLight(START, free=True, luminance=1.0)
    cells = ((Cell.fixed((0.3, 0.2, 0.1)),),)
    problem = PaletteProblem(GRID, (light,), (PaletteReflectance("a"),), cells, light_bounds=bounds)
    solution = solve_palette(problem, seconds=1)
    assert solution.status == "exact_conflict"
    assert "“start” must have the luminance 1, but within the bounds of lights" in solution.remedy
    assert "exact" not in solution.remedy.partition("“start” must have")[2]
    for power in bounds:  # of a light that has this power everywhere, by sums over the observer's table
        if np.isfinite(power):
            assert f"{power * 106.9:.2g}"[:3] in solution.remedy


def test_a_light_far_too_bright_for_its_colors_is_inaccurate_and_named() -> None:
    """Its material was said to be black under every light, beside black cells that the palette does not have."""
    light = PaletteLight(START, free=True, luminance=1e9)
    cells = ((Cell.fixed((0.3, 0.2, 0.1)),),)
    solution = solve_palette(PaletteProblem(GRID, (light,), (PaletteReflectance("a"),), cells), seconds=1)
    assert solution.status == "inaccurate"
    assert "reduce the power or the luminance of the light" in solution.remedy
