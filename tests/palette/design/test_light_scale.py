# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights that are brightened until reflectances fit, from cold and from warm starts."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.presets import design_grid
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import normalized

D65 = normalized(illuminant("D65"))


def brightened(target: tuple[float, float, float]) -> PaletteProblem:
    rows = ((Cell.fixed(target),),)
    return PaletteProblem(design_grid(), (PaletteLight(D65),), (PaletteReflectance("m"),), rows, scale_lights=True)


@pytest.mark.parametrize("target", [(1.2, 0.8, 0.8), (0.5, 0.3, 0.3)])
def test_lights_are_as_bright_from_a_warm_start_as_from_a_cold_one(target: tuple[float, float, float]) -> None:
    """They kept the brightness of the earlier solution, however dark the colors had become."""
    bright = brightened((2.5, 1.5, 1.5))
    problem = brightened(target)
    before, cold = solve_palette(bright), solve_palette(problem)
    warm = solve_palette(problem, warm=before)
    assert before.light_scale > 1.5 * warm.light_scale
    assert warm.light_scale == pytest.approx(cold.light_scale, rel=1e-9)
    np.testing.assert_allclose(warm.illuminants[0].values, D65.values * warm.light_scale)
    assert any("times brighter" in note for note in warm.notes) == (target[0] > 1)
    again = solve_palette(bright, warm=before)
    assert again.light_scale == before.light_scale
    assert any("times brighter" in note for note in again.notes)
