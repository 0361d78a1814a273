# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes whose exact cells are ill-conditioned: line lamps together, lights that are nearly one light, colors at the
end of what a lamp can show, and chains of "same" and "constant" cells. Most can hold, by construction.
"""

from __future__ import annotations

import numpy as np

from benchmarks.palette.checks.linear_program import color_matrix, of_luminance
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.palette.presets import design_grid
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.spectrum import Illuminant

LAMPS = (
    "HP1", "HP2", "FL8", "FL11", "FL3.12", "LED-RGB1", "LED-B3", "LPS", "Mercury", "Metal Halide", "A", "D65", "E",
    "FL2", "D50",
)  # fmt: skip


def _material(rng: np.random.Generator, waves: np.ndarray, edge: float) -> np.ndarray:
    """A reflectance, from a smooth one to an optimal color."""
    if rng.random() < 0.4:
        wave = np.sin(2 * np.pi * (waves - rng.uniform(380, 780)) / rng.uniform(80, 500))
        return np.clip(0.5 + 0.4 * wave * rng.uniform(0, 1), 0.02, 0.98)
    cuts = np.sort(rng.uniform(400, 700, 2))
    step = ((waves > cuts[0]) & (waves < cuts[1])).astype(float)
    if rng.random() < 0.5:
        step = 1 - step
    return edge * step + (1 - edge) * rng.uniform(0.2, 0.8)


def _lights(rng: np.random.Generator, count: int, level: float, traps: list[str]) -> list[Illuminant]:
    names = [str(name) for name in rng.choice(LAMPS, count, replace=False)]
    if rng.random() < 0.3:
        names[:2] = ["HP1", str(rng.choice(["FL8", "FL11", "LED-RGB1"]))]
    lights = [of_luminance(illuminant(name), level) for name in names]
    if rng.random() < 0.12:
        share = 10 ** rng.uniform(-8, -2)
        values = np.asarray(lights[0].values)
        near = values * (1 + share * rng.uniform(-1, 1, values.size))
        lights[1] = Illuminant(f"{names[0]}'", lights[0].grid, near)
        traps.append("two lights nearly one")
    return lights


def limiting_problem(seed: int) -> tuple[PaletteProblem, list[str]]:
    """A problem of 1 to 6 materials under 2 or 3 lamps, and the names of its difficulties."""
    rng = np.random.default_rng(seed)
    grid = design_grid(float(rng.choice([5.0, 10.0, 10.0, 20.0])))
    columns, rows = int(rng.integers(2, 4)), int(rng.integers(1, 7))
    traps = [f"{grid.size} samples"]
    level = float(rng.choice([1.0, 1.0, 3.0, 6.0]))
    lights = _lights(rng, columns, level, traps)
    edge = float(rng.choice([0.5, 0.9, 0.99, 0.999, 1.0]))
    is_made = bool(rng.random() < 0.6)
    traps += [f"edge {edge:g}", "made" if is_made else "random"]
    matrices = [color_matrix(grid, light) for light in lights]
    share = float(rng.choice([0.3, 0.6, 0.9]))
    base = rng.uniform(0.15, 0.7, 3)
    cells = []
    for i in range(rows):
        truth = _material(rng, np.asarray(grid.wavelengths_nm), edge) / (level if rng.random() < 0.5 else 1)
        row = []
        for j in range(columns):
            shown = matrices[j] @ truth
            color = shown if is_made else np.clip(base + rng.normal(scale=0.12, size=3), 0.01, 0.95)
            row.append(_cell(rng, i, j, color, share))
        cells.append(tuple(row))
    smoothness = float(rng.choice([0.01, 0.01, 1e-3, 1.0, 0.0, 1e-5]))
    traps.append(f"smoothness {smoothness:g}")
    materials = tuple(PaletteReflectance(f"R{i}") for i in range(rows))
    return PaletteProblem(grid, tuple(map(PaletteLight, lights)), materials, tuple(cells), smoothness=smoothness), traps


def _cell(rng: np.random.Generator, i: int, j: int, color: np.ndarray, share: float) -> Cell:
    hold, kind = bool(rng.random() < share), rng.random()
    weight = float(10 ** rng.uniform(-1, 1)) if rng.random() < 0.2 else 1.0
    if i and kind < 0.25:
        return Cell.same_as((int(rng.integers(i)), j), exact=hold, weight=weight)
    if j and kind < 0.35:
        return Cell.constant((i, 0), exact=hold, weight=weight)
    if kind < 0.38:
        return Cell.black(exact=hold, weight=weight)
    if kind < 0.46:
        return Cell.free()
    if kind < 0.5:
        return Cell.free((color - 0.02, color + 0.02), exact=hold, weight=weight)
    return Cell.fixed(color, exact=hold, weight=weight)
