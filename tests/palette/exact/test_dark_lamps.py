# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials that must be black under an LED whose power falls off without an end, as a Gaussian does."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import linear_rgb_from_product, normalized
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

GRID = SpectralGrid.uniform(400, 700, 10)
KNOTS = np.arange(360.0, 801.0)
DAY = normalized(illuminant("D65"))
WANTED = np.array([0.25, 0.15, 0.3])


def led(center_nm: float, width_nm: float) -> Illuminant:
    values = np.exp(-0.5 * ((KNOTS - center_nm) / width_nm) ** 2)
    return normalized(Illuminant("LED", SpectralGrid(KNOTS), values))


def color_beside(lamp: Illuminant, limit: float) -> float:
    """Least distance of a day color to the wanted one, of reflectances that are 0 where the lamp has more than a limit:
    a statement of its own, by SciPy.
    """
    shown = np.abs(linear_rgb_from_product(lamp, GRID)).max(axis=0)
    matrix = linear_rgb_from_product(DAY, GRID)[:, shown < limit]
    return float(np.sqrt(2 * lsq_linear(matrix, WANTED, bounds=(0, 1)).cost))


@pytest.mark.parametrize(("center_nm", "width_nm"), [(450, 4), (470, 9), (530, 6), (555, 14), (610, 8), (640, 12)])
@pytest.mark.parametrize("smoothness", [0.001, 0.1])
def test_black_under_an_led_is_solved(center_nm: float, width_nm: float, smoothness: float) -> None:
    """42 of 120 such palettes were called inaccurate, with colors that are not reliable."""
    lamp = led(center_nm, width_nm)
    cells = (
        (Cell.fixed(WANTED), Cell.black(exact=True)),
        (Cell.same_as((0, 0), exact=True), Cell.fixed((0.1, 0.05, 0.02))),
    )
    materials = (PaletteReflectance("smoke"), PaletteReflectance("paint"))
    problem = PaletteProblem(GRID, (PaletteLight(DAY), PaletteLight(lamp)), materials, cells, smoothness=smoothness)
    solution = solve_palette(problem, explain=False)
    smoke, paint = (each.values for each in solution.reflectances)
    assert solution.status.trusted
    assert np.abs(linear_rgb_from_product(lamp, GRID) @ smoke).max() < 1e-9
    day = linear_rgb_from_product(DAY, GRID)
    np.testing.assert_allclose(day @ smoke, day @ paint, atol=1e-9)
    # With hardly any smoothness and no other request, the color is as near as SciPy brings it.
    alone = solve_palette(
        PaletteProblem(GRID, problem.lights, materials[:1], cells[:1], smoothness=1e-5), explain=False
    )
    assert alone.status.trusted
    reached = float(np.linalg.norm(day @ alone.reflectances[0].values - WANTED))
    assert color_beside(lamp, 1e-9) - 1e-4 < reached < color_beside(lamp, 1e-12) + 1e-4
