# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes whose lights and colors are all far from 1 are solved in a unit of brightness of their own.

Color errors grow with the unit, roughness and the solvers' tolerances do not: in other units the same palette would
get other spectra and another status.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import PaletteState, initial_state
from spectral_core.palette.cell import Cell
from spectral_core.palette.distinct.cells import wants_distinct
from spectral_core.palette.inaccurate import BRIGHTEST
from spectral_core.palette.problem import PaletteLight, PaletteProblem
from spectral_core.palette.report import criterion_residuals
from spectral_core.palette.solution import PaletteSolution
from spectral_core.spectra.observer import xyz_of
from spectral_core.spectra.spectrum import Illuminant

ROUNDING = 1e-6
"""Of the logarithm of a luminance: a light of luminance 1 keeps its unit if its last digits are below 1."""


def brightness_unit(problem: PaletteProblem) -> float:
    """The power of ten in which the palette is solved: 1, unless all lights and the largest color are beyond 1000, or
    below a thousandth.

    In this unit the brightest light has a luminance from 1 to 10. Where no light has a brightness of its own, as of
    primaries, the largest color is from 0.1 to 1. The most distinct colors are searched for in the unit 1.
    """
    lights = _luminances(problem)
    colors = [float(np.abs(cell.target).max()) for row in problem.cells for cell in row if cell.target is not None]
    ends = [end for row in problem.cells for cell in row for end in cell.box or ()]
    colors += [float(np.abs(end[np.isfinite(end)]).max(initial=0.0)) for end in ends]
    color = max(colors, default=0.0)
    sizes = [*lights, color] if color > 0 else lights
    if not sizes or _are_ordinary(sizes) or wants_distinct(problem):
        return 1.0
    power = math.floor(math.log10(max(lights)) + ROUNDING) if lights else math.ceil(math.log10(color) - ROUNDING)
    return float(10.0**power)


def depends_on_colors(problem: PaletteProblem) -> bool:
    """True if another color of a cell may change the unit: its lights alone do not keep it at 1."""
    lights = _luminances(problem)
    return not (lights and _are_ordinary(lights))


def _luminances(problem: PaletteProblem) -> list[float]:
    """The luminances that the palette states, above 0."""
    lights = [float(xyz_of(light.spectrum)[1]) for light in problem.lights if not light.primaries]
    lights += [light.luminance for light in problem.lights if light.luminance is not None]
    return [size for size in lights if size > 0]


def _are_ordinary(sizes: list[float]) -> bool:
    return min(sizes) < BRIGHTEST and max(sizes) > 1 / BRIGHTEST


def in_unit(problem: PaletteProblem, unit: float) -> PaletteProblem:
    """The palette with all lights and colors divided by ``unit``. Primaries stay as they are, with smaller amounts."""
    if unit == 1:
        return problem

    def lamp(given: Illuminant) -> Illuminant:
        return given.scaled(1 / unit)

    def column(light: PaletteLight) -> PaletteLight:
        luminance = None if light.luminance is None else light.luminance / unit
        return replace(
            light, spectrum=lamp(light.spectrum), variants=tuple(map(lamp, light.variants)), luminance=luminance
        )

    low, high = problem.light_bounds
    return replace(
        problem, lights=tuple(map(column, problem.lights)), light_bounds=(low / unit, high / unit),
        cells=tuple(tuple(cell_in_unit(cell, unit) for cell in row) for row in problem.cells),
    )  # fmt: skip


def cell_in_unit(cell: Cell, unit: float) -> Cell:
    """The request with its colors divided by ``unit``."""
    target = None if cell.target is None else cell.target / unit
    return replace(cell, target=target, box=None if cell.box is None else (cell.box[0] / unit, cell.box[1] / unit))


def start_in_unit(warm: PaletteSolution, unit: float) -> PaletteSolution:
    """An earlier solution as a start in the unit."""
    return warm if warm.state is None else replace(warm, state=multiplied(warm.state, 1 / unit))


def from_unit(solution: PaletteSolution, problem: PaletteProblem, unit: float) -> PaletteSolution:
    """The solution of ``in_unit(problem, unit)`` as one of ``problem``; ΔE and status stay those of the unit."""
    state = state_from_unit(solution.state, problem, unit)
    wanted, actual = unit * solution.target_linear_rgb, unit * solution.actual_linear_rgb
    found = zip(solution.illuminants, problem.lights, strict=True)
    residuals = criterion_residuals(Assembler(problem, compiled_requests(problem)), state, wanted, actual)
    return replace(
        solution,
        problem=problem,
        illuminants=tuple(
            each.scaled(unit) if light.free else light.spectrum.scaled(solution.light_scale) for each, light in found
        ),
        target_linear_rgb=wanted,
        actual_linear_rgb=actual,
        residuals=solution.residuals | residuals,
        notes=(
            f"colors and lights of this palette are counted in {unit:g}: ΔE, the status and the numbers of messages "
            f"are relative to a white of {unit:g}",
            *solution.notes,
        ),
        amounts=tuple(None if each is None else unit * each for each in solution.amounts),
        state=state,
    )


def state_from_unit(state: PaletteState, problem: PaletteProblem, unit: float) -> PaletteState:
    """The spectra of a solve of ``in_unit(problem, unit)`` as those of ``problem``."""
    return replace(
        initial_state(problem), lights=multiplied(state, unit).lights, reflectances=state.reflectances,
        light_scale=state.light_scale,
    )  # fmt: skip


def multiplied(state: PaletteState, factor: float) -> PaletteState:
    """The spectra with designed lights multiplied; the record of their solve, which is of others, is left out."""
    return replace(state, lights=tuple(None if each is None else factor * each for each in state.lights), record=None)
