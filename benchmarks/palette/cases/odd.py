# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes unlike those of ``hard``: one oddity each, as an artist or a script might state it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

LAMPS = ("D65", "A", "FL2", "HP1", "LED-B3", "LED-V1", "D50")
SURFACES = ("dark skin", "foliage", "orange", "blue sky", "white 9.5 (.05 D)")
Cells = list[list[Cell]]


def odd_problem(seed: int) -> tuple[PaletteProblem, list[str]]:
    """A problem, and the name of its oddity after the size of its grid."""
    rng = np.random.default_rng(seed)
    name = list(ODDITIES)[seed % len(ODDITIES)]
    problem = ODDITIES[name](rng)
    return problem, [f"{problem.grid.size} samples", name]


def _plain(
    rng: np.random.Generator, *, size: int = 0, shape: tuple[int, int] = (0, 0), designed: float = 0.5
) -> PaletteProblem:
    """Measured lamps, some of them designed, and colors that are all wanted alike."""
    grid = SpectralGrid(np.linspace(400, 700, size or int(rng.choice([13, 31, 61]))))
    rows, columns = (shape[k] or int(rng.integers(1, 5)) for k in (0, 1))
    lights = []
    for _ in range(columns):
        lamp = normalized(illuminant(str(rng.choice(LAMPS))), luminance=float(rng.uniform(1, 6)))
        is_free = bool(rng.random() < designed)
        lights.append(PaletteLight(lamp.resampled(grid) if is_free else lamp, free=is_free))
    cells = [[Cell.fixed(rng.uniform(0.03, 0.9, 3)) for _ in range(columns)] for _ in range(rows)]
    surfaces = tuple(PaletteReflectance(f"R{i}") for i in range(rows))
    smoothness = float(10 ** rng.uniform(-3, -1))
    return PaletteProblem(grid, tuple(lights), surfaces, _frozen(cells), smoothness=smoothness)


def _frozen(cells: Cells) -> tuple[tuple[Cell, ...], ...]:
    return tuple(map(tuple, cells))


def _indices(problem: PaletteProblem) -> list[tuple[int, int]]:
    return [(i, j) for i in range(len(problem.reflectances)) for j in range(len(problem.lights))]


def _far_weights(rng: np.random.Generator) -> PaletteProblem:
    problem = _plain(rng)
    return problem.with_cells({
        at: Cell.fixed(rng.uniform(0, 1, 3), weight=float(rng.choice([1e-3, 1.0, 1e3]))) for at in _indices(problem)
    })  # fmt: skip


def _near_lights(rng: np.random.Generator) -> PaletteProblem:
    """Two lights that differ by 1e-8 to 1e-2, under which each material should look different."""
    problem = _plain(rng, shape=(0, 2), designed=0.0)
    first = problem.lights[0].spectrum.resampled(problem.grid)
    change = 1 + 10 ** rng.uniform(-8, -2) * rng.uniform(-1, 1, problem.grid.size)
    near = Illuminant("near", problem.grid, first.values * change)
    return replace(problem, lights=(PaletteLight(first), PaletteLight(near, free=bool(rng.random() < 0.3))))


def _one_wavelength(rng: np.random.Generator) -> PaletteProblem:
    """A line of half a nanometer beside a lamp, and a grid of two to five samples."""
    problem = _plain(rng, size=int(rng.integers(2, 6)), shape=(0, 2), designed=0.3)
    at = rng.uniform(430, 660)
    line = Illuminant("line", SpectralGrid(np.array([at - 0.25, at, at + 0.25])), np.array([0.0, 1.0, 0.0]))
    return replace(problem, lights=(PaletteLight(normalized(line, luminance=2.0)), problem.lights[1]))


def _black_and_white(rng: np.random.Generator) -> PaletteProblem:
    problem = _plain(rng)
    wanted = [Cell.black(), Cell.fixed([1, 1, 1]), Cell.black(exact=True), Cell.fixed([0, 0, 0])]
    return problem.with_cells({at: wanted[int(rng.integers(4))] for at in _indices(problem)})


def _exact_conflict(rng: np.random.Generator) -> PaletteProblem:
    """Exact colors, and a cell that should be exactly as another one of another exact color."""
    problem = _plain(rng, shape=(2, 2))
    colors = rng.uniform(0.1, 0.4, (2, 3))
    return problem.with_cells({
        (0, 0): Cell.fixed(colors[0], exact=True),
        (1, 0): Cell.fixed(colors[int(rng.integers(2))], exact=True),
        (1, 1): Cell.same_as((0, 0), exact=bool(rng.random() < 0.5), weight=5.0),
    })  # fmt: skip


def _groups(rng: np.random.Generator) -> PaletteProblem:
    """Cells that refer to each other in a ring, partly exact, with a box that may exclude the target."""
    problem = _plain(rng, shape=(3, 2))
    low = rng.uniform(0, 0.5, 3)
    return problem.with_cells({
        (0, 0): Cell.same_as((1, 0), box=(low, low + 0.1)),
        (1, 0): Cell.same_as((2, 0), exact=bool(rng.random() < 0.5)),
        (2, 0): Cell.same_as((0, 0), weight=float(10 ** rng.uniform(-2, 2))),
        (2, 1): Cell.constant((2, 0)),
    })  # fmt: skip


def _duplicates(rng: np.random.Generator) -> PaletteProblem:
    """The same light in all columns, with different colors wanted, and the same material twice."""
    problem = _plain(rng, shape=(2, 3), designed=0.0)
    lights = (problem.lights[0],) * 3
    row = tuple(Cell.fixed(rng.uniform(0.1, 0.6, 3)) for _ in range(3))
    return replace(problem, lights=lights, cells=(row, row))


def _rough(rng: np.random.Generator) -> PaletteProblem:
    return replace(_plain(rng), smoothness=0.0)


def _smooth(rng: np.random.Generator) -> PaletteProblem:
    return replace(_plain(rng), smoothness=float(10 ** rng.uniform(2, 12)))


def _lights_alone(rng: np.random.Generator) -> PaletteProblem:
    """Measured surfaces: only lights are designed."""
    problem = _plain(rng, designed=1.0)
    given = tuple(
        PaletteReflectance(f"{name} {i}", reflectance(str(name)).resampled(problem.grid))
        for i, name in enumerate(rng.choice(SURFACES, len(problem.reflectances)))
    )
    return replace(problem, reflectances=given)


def _narrow_bounds(rng: np.random.Generator) -> PaletteProblem:
    low = float(rng.uniform(0, 0.4))
    bounds = (low, low + float(10 ** rng.uniform(-6, -0.5)))
    return replace(_plain(rng), reflectance_bounds=bounds, light_bounds=(0.0, float(10 ** rng.uniform(-3, 0))))


def _units(rng: np.random.Generator) -> PaletteProblem:
    """Lights of 1e-5 to 1e5 times the usual power; the colors are what such lights can show."""
    problem = _plain(rng)
    scale = float(10 ** rng.uniform(-5, 5))
    lights = tuple(replace(light, spectrum=light.spectrum.scaled(scale)) for light in problem.lights)
    cells = {at: Cell.fixed(min(scale, 1e3) * rng.uniform(0.05, 0.5, 3)) for at in _indices(problem)}
    return replace(problem, lights=lights).with_cells(cells)


def _impossible(rng: np.random.Generator) -> PaletteProblem:
    """Colors below 0, and brighter than a perfect white by up to a hundred times."""
    problem = _plain(rng)
    return problem.with_cells(
        {at: Cell.fixed(rng.uniform(-1, 1, 3) * 10 ** rng.uniform(0, 2)) for at in _indices(problem)}
    )


def _most_ignored(rng: np.random.Generator) -> PaletteProblem:
    """One request in the whole table, or none."""
    problem = _plain(rng, shape=(3, 3))
    kept = rng.integers(0, 3, 2)
    is_kept = rng.random() < 0.8
    return problem.with_cells({
        at: Cell.ignore() for at in _indices(problem) if not (is_kept and at == (int(kept[0]), int(kept[1])))
    })  # fmt: skip


def _perceptual(rng: np.random.Generator) -> PaletteProblem:
    problem = replace(_plain(rng, shape=(0, 2)), match="perceptual")
    return problem.with_cells({(0, 0): Cell.black(), (0, 1): Cell.fixed(rng.uniform(0, 1e-3, 3))})


def _large(rng: np.random.Generator) -> PaletteProblem:
    """Many samples, shared colors, and nearly all requests met, so that roughness alone is left."""
    problem = _plain(rng, size=int(rng.choice([81, 151, 301])), shape=(3, 2))
    cells = {at: Cell.fixed(0.15 * problem.cells[at[0]][at[1]].target) for at in _indices(problem)}  # type: ignore[operator]
    return problem.with_cells({**cells, (1, 0): Cell.same_as((0, 0)), (2, 0): Cell.same_as((0, 0))})


ODDITIES: dict[str, Callable[[np.random.Generator], PaletteProblem]] = {
    "weights of 0.001 to 1000": _far_weights,
    "nearly identical lights": _near_lights,
    "one wavelength": _one_wavelength,
    "black and white": _black_and_white,
    "exact cells in conflict": _exact_conflict,
    "rings of groups": _groups,
    "duplicates": _duplicates,
    "no smoothness": _rough,
    "huge smoothness": _smooth,
    "lights alone": _lights_alone,
    "narrow bounds": _narrow_bounds,
    "units of light": _units,
    "impossible colors": _impossible,
    "one request": _most_ignored,
    "perceptual near black": _perceptual,
    "many samples": _large,
}
