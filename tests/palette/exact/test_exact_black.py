# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials that are black to rounding under a light: the last digits take few steps, since none is left to gain."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.design.factored import FactoredRows
from spectral_core.palette.presets import sine_light
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import SpectralGrid


@pytest.mark.parametrize("names", [("HP1", "D65"), ("D65", "A"), ("FL11", "sine")])
def test_exact_black_cells_take_few_steps(monkeypatch: pytest.MonkeyPatch, names: tuple[str, str]) -> None:
    """They took 2,800: each released a bound and met another at once, up to the limit."""
    grid = SpectralGrid(np.linspace(400.0, 700.0, 31))
    lamps = [
        sine_light(90.0, grid, luminance=6.0) if name == "sine" else normalized(illuminant(name), luminance=6.0)
        for name in names
    ]
    black = Cell.black(exact=True)
    cells = ((black, Cell.fixed((0.5, 0.3, 0.2))), (Cell.fixed((0.2, 0.3, 0.4)), black))
    items = tuple(PaletteReflectance(name) for name in ("a", "b"))
    problem = PaletteProblem(grid, tuple(map(PaletteLight, lamps)), items, cells)
    steps = []
    step = FactoredRows.step

    def counted(self: FactoredRows, *arguments: object) -> object:
        steps.append(1)
        return step(self, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(FactoredRows, "step", counted)
    solution = solve_palette(problem, explain=False)
    assert solution.status.trusted
    assert np.abs(solution.actual_linear_rgb[[0, 1], [0, 1]]).max() < 1e-8
    assert len(steps) < 600
