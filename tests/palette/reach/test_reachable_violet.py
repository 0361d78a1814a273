# SPDX-License-Identifier: GPL-3.0-or-later
"""Nearest colors under violet lamps, which show some combinations of wavelengths a hundred thousand times less."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from spectral_core.errors import InvalidInputError
from spectral_core.palette.reach.reachable import CellReach
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import lab_from_linear_rgb
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

GRID = SpectralGrid.uniform(380, 780, 20)
KNOTS = np.arange(300.0, 500.0, 5.0)
VIOLET = Illuminant("violet", SpectralGrid(KNOTS), np.exp(-(((KNOTS - 395) / 12) ** 2)) + 1e-6)
A = illuminant("A")


def rows(light: Illuminant) -> np.ndarray:
    return CellReach(light, GRID).matrix


@pytest.mark.parametrize("seed", range(8))
def test_a_color_beside_an_exact_one_is_reachable(seed: int) -> None:
    """Colors that a reflectance has were called out of reach, and missed by up to 8e-4 in linear RGB."""
    reflectance = np.random.default_rng(seed).random(GRID.size)
    near = Illuminant("near", SpectralGrid(KNOTS), np.exp(-(((KNOTS - 396) / 12) ** 2)) + 1e-6)
    for light, other in ((VIOLET, A), (VIOLET, near), (A, VIOLET)):
        wanted = rows(light) @ reflectance
        found = CellReach(light, GRID, [(other, rows(other) @ reflectance)]).nearest(wanted)
        assert found.reachable
        np.testing.assert_allclose(found.color, wanted, atol=1e-6)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("held", [(), (A,)])
def test_no_other_color_is_nearer_to_first_order(seed: int, held: tuple[Illuminant, ...]) -> None:
    """A linear program seeks the reflectance toward which the distance falls most."""
    rng = np.random.default_rng(seed)
    reflectance, wanted = rng.random(GRID.size), 0.1 * rng.random(3)
    exact = [(light, rows(light) @ reflectance) for light in held]
    matrix = rows(VIOLET)
    found = CellReach(VIOLET, GRID, exact).nearest(wanted)
    target = lab_from_linear_rgb(wanted)

    def square(color: np.ndarray) -> float:
        return float(np.sum((lab_from_linear_rgb(color) - target) ** 2))

    step = 1e-7
    slope = [(square(found.color + step * e) - square(found.color - step * e)) / (2 * step) for e in np.eye(3)]
    equal = {"A_eq": rows(A), "b_eq": exact[0][1]} if held else {}
    best = linprog(np.array(slope) @ matrix, bounds=[(0, 1)] * GRID.size, method="highs", **equal)
    gain = np.array(slope) @ (found.color - matrix @ best.x)
    assert gain < 2e-3 * square(found.color)


def test_lights_that_no_reflectance_can_follow_are_refused() -> None:
    """Within 0.4 and 0.6 no material shows under A what it shows under the violet lamp; this was found out too late."""
    with pytest.raises(InvalidInputError, match="no reflectance between 0.4 and 0.6"):
        CellReach(VIOLET, GRID, follows=[A], bounds=(0.4, 0.6))
