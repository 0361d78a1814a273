# SPDX-License-Identifier: GPL-3.0-or-later
"""The fast objective of plain palettes equals that of the general path, with its gradient and its surfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import initial_state
from spectral_core.palette.design.fast_lights import PlainPalette
from spectral_core.palette.design.projected import Projected
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

GRID = SpectralGrid.uniform(400, 700, 10)


def palette(rng: np.random.Generator, *, given: bool, match: str) -> PaletteProblem:
    """Three surfaces, perhaps a measured one among them, under daylight and two designed lights."""
    waves = [1.1 + np.sin(GRID.wavelengths_nm / period) for period in (12.0, 30.0)]
    lights = [PaletteLight(normalized(illuminant("D65"), luminance=2.0))]
    lights += [PaletteLight(normalized(Illuminant(f"l{k}", GRID, wave)), free=True) for k, wave in enumerate(waves)]
    surfaces = [PaletteReflectance(f"r{i}") for i in range(3)]
    if given:
        surfaces[1] = PaletteReflectance("measured", reflectance("foliage").resampled(GRID))
    cells = [
        [Cell.fixed(rng.uniform(0.1, 0.6, 3), weight=float(rng.uniform(0.5, 3))) for _ in lights] for _ in surfaces
    ]
    cells[1][0] = Cell.ignore()  # known from the start where the surface is measured: the general path leaves it out
    problem = PaletteProblem(GRID, tuple(lights), tuple(surfaces), tuple(map(tuple, cells)), smoothness=0.1)
    return replace(problem, match=match)


@pytest.mark.parametrize("given", [False, True])
@pytest.mark.parametrize("match", ["linear", "perceptual"])
def test_the_fast_objective_is_that_of_the_general_path(rng, given: bool, match: str) -> None:
    problem = palette(rng, given=given, match=match)
    assembler = Assembler(problem, compiled_requests(problem))
    fast = PlainPalette.of(assembler, perceptual=match == "perceptual")
    assert fast is not None
    begin = initial_state(problem)
    for _ in range(3):
        moved = {j: np.abs(light + 0.2 * rng.normal(size=GRID.size)) for j, light in enumerate(begin.lights) if j}
        state = begin.with_values("lights", moved)
        objective, gradient, found = fast.objective(state)
        wanted, wanted_gradient, wanted_state = Projected(assembler, "lights").objective(state)
        assert objective == pytest.approx(wanted, rel=1e-6)
        np.testing.assert_allclose(gradient, wanted_gradient, rtol=1e-4, atol=1e-6 * np.abs(wanted_gradient).max())
        np.testing.assert_allclose(found.colors(), wanted_state.colors(), atol=1e-5)
