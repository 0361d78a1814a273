# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes that are difficult for solvers: every known difficulty, alone and combined, from a seed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

LINE_LAMPS = ("HP1", "HP2", "FL3.12", "FL11", "LPS", "Mercury", "Metal Halide", "LED-RGB1")
BINS = (5, 9, 16, 31, 31, 31, 41, 61, 100)
MANY_BINS = (201, 471)


def random_grid(rng: np.random.Generator, *, many: bool) -> SpectralGrid:
    """From 5 to 471 samples, even or not, linear or summed."""
    size = int(rng.choice(MANY_BINS if many else BINS))
    low, high = (360.0, 830.0) if size > 100 else (rng.uniform(360, 420), rng.uniform(680, 830))
    wavelengths = np.linspace(low, high, size)
    if rng.random() < 0.2:
        wavelengths = np.sort(wavelengths + rng.uniform(-0.4, 0.4, size) * (wavelengths[1] - wavelengths[0]))
    return SpectralGrid(wavelengths, "sampled" if rng.random() < 0.3 else "linear")


def _smooth_lights(count: int, grid: SpectralGrid, rng: np.random.Generator) -> list[np.ndarray]:
    waves = grid.wavelengths_nm
    return [1 + np.sin(2 * np.pi * (waves - rng.uniform(0, 400)) / rng.uniform(60, 400)) for _ in range(count)]


def _near_lights(count: int, grid: SpectralGrid, rng: np.random.Generator) -> list[np.ndarray]:
    first = _smooth_lights(1, grid, rng)[0]
    return [first + 10 ** rng.uniform(-9, -4) * rng.uniform(size=grid.size) for _ in range(count)]


def _line_lights(count: int, grid: SpectralGrid, rng: np.random.Generator) -> list[np.ndarray]:
    names = rng.choice(LINE_LAMPS, count)
    return [np.maximum(illuminant(str(name)).at(grid.wavelengths_nm), 0.0) for name in names]


def _spikes(count: int, grid: SpectralGrid, rng: np.random.Generator) -> list[np.ndarray]:
    lights = np.zeros((count, grid.size))
    for light in lights:
        light[rng.integers(grid.size, size=rng.integers(1, 4))] = 1.0
    return list(lights)


def _one_dark(count: int, grid: SpectralGrid, rng: np.random.Generator) -> list[np.ndarray]:
    lights = _smooth_lights(count, grid, rng)
    lights[int(rng.integers(count))] *= 0.0
    return lights


def _dim_and_bright(count: int, grid: SpectralGrid, rng: np.random.Generator) -> list[np.ndarray]:
    return [light * 10 ** rng.uniform(-6, 3) for light in _smooth_lights(count, grid, rng)]


LIGHTS: dict[str, Callable[[int, SpectralGrid, np.random.Generator], list[np.ndarray]]] = {
    "smooth": _smooth_lights,
    "near-identical": _near_lights,
    "line lamps": _line_lights,
    "spikes": _spikes,
    "one without power": _one_dark,
    "dim and bright": _dim_and_bright,
}


def hard_problem(seed: int) -> tuple[PaletteProblem, list[str]]:
    """A problem, and the names of its difficulties."""
    rng = np.random.default_rng(seed)
    many = rng.random() < 0.04
    grid = random_grid(rng, many=many)
    traps = [f"{grid.size} samples"]
    if rng.random() < 0.04:
        grid = SpectralGrid(grid.wavelengths_nm + 600.0, grid.interpolation)
        traps.append("no overlap with the observer")
    rows, columns = (2, 2) if many else (int(rng.integers(1, 6)), int(rng.integers(1, 5)))
    kind = str(rng.choice(list(LIGHTS)))
    traps.append(kind)
    lights = []
    for j, values in enumerate(LIGHTS[kind](columns, grid, rng)):
        total = float(values.sum()) or 1.0
        strength = 1.0 if kind == "dim and bright" else rng.choice([1.0, 6.0]) * grid.size / total
        free = rng.random() < (0.3 if not many else 0.1)
        lights.append(PaletteLight(Illuminant(f"L{j}", grid, values * strength / 100), free=bool(free)))
    smoothness = float(rng.choice([0.0, 1e-3, 1e-2, 1.0, 10 ** rng.uniform(-9, 9)]))
    traps += ["no smoothness"] if smoothness == 0 else []
    cells = _cells(rng, rows, columns, traps)
    problem = PaletteProblem(
        grid,
        tuple(lights),
        tuple(PaletteReflectance(f"R{i}") for i in range(rows)),
        cells,
        smoothness=smoothness,
        smoothness_operator="thesis" if rng.random() < 0.3 else "mended",
        match="perceptual" if rng.random() < 0.2 else "linear",
        rounds=int(rng.integers(1, 4)),
    )
    return problem, traps


def _cells(rng: np.random.Generator, rows: int, columns: int, traps: list[str]) -> list[list[Cell]]:
    heavy = rng.random() < 0.4
    wide = rng.random() < 0.3
    exact = rng.random() < 0.3
    for trap, present in (("weights to 1e12", heavy), ("out of gamut", wide), ("exact cells", exact)):
        traps += [trap] if present else []
    table = []
    for i in range(rows):
        row = []
        for j in range(columns):
            weight = float(10 ** rng.uniform(-3, 12)) if heavy and rng.random() < 0.5 else 1.0
            hold = bool(exact and rng.random() < 0.5)
            color = rng.uniform(-1.0, 3.0, 3) if wide else rng.uniform(0, 1, 3) * rng.choice([0.3, 1.0])
            choice = rng.random()
            if choice < 0.55:
                cell = Cell.fixed(color, weight=weight, exact=hold)
            elif choice < 0.75 and (i or j):
                other = (i - 1, j) if i else (i, j - 1)
                cell = Cell.same_as(other, weight=weight, exact=hold)
            elif choice < 0.85:
                cell = Cell.black(weight=weight, exact=hold)
            elif choice < 0.92 and j:
                cell = Cell.constant((i, 0), weight=weight, exact=hold)
            elif choice < 0.96:
                cell = Cell.free((color - 0.1, color + 0.1), weight=weight)
            else:
                cell = Cell.ignore()
            row.append(cell)
        table.append(row)
    return table
