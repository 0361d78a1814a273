# SPDX-License-Identifier: GPL-3.0-or-later
"""A part of a palette as a problem of its own: some rows or columns, with the other side's spectra held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from spectral_core.palette.assemble.requests import Requests, Target
from spectral_core.palette.problem import (
    Cell,
    CellIndex,
    CellMode,
    PaletteLight,
    PaletteProblem,
    PaletteReflectance,
)
from spectral_core.palette.solution import PaletteSolution
from spectral_core.spectra.spectrum import Illuminant, Reflectance

EXACT_WEIGHT = 100.0
"""Weight in place of exactness, relative to the largest of the other weights."""


def held_problem(solution: PaletteSolution, axis: int) -> PaletteProblem | None:
    """The problem with the other side's designed spectra as measured ones; None if they are unphysical."""
    problem = solution.problem
    # Distinct cells are searched for seconds, after everything else is met.
    cells = tuple(
        tuple(Cell.ignore() if cell.mode is CellMode.DISTINCT else cell for cell in row) for row in problem.cells
    )
    problem = replace(problem, cells=cells, scale_lights=False)
    if axis == 0:
        lights = []
        for light, found in zip(problem.lights, solution.illuminants, strict=True):
            if not isinstance(found, Illuminant):
                return None
            lights.append(PaletteLight(found, variants=light.variants))
        return replace(problem, lights=tuple(lights))
    surfaces = []
    for item, spectrum in zip(problem.reflectances, solution.reflectances, strict=True):
        if not isinstance(spectrum, Reflectance):
            return None
        surfaces.append(PaletteReflectance(item.name, spectrum))
    return replace(problem, reflectances=tuple(surfaces))


def heavy_weight(problem: PaletteProblem) -> float:
    """The weight in place of exactness."""
    largest = max((cell.weight for row in problem.cells for cell in row if not cell.exact), default=0.0) or 1.0
    return EXACT_WEIGHT * largest


def with_weights(requests: Requests, heavy: float) -> Requests:
    """The requests with a weight in place of exactness. Which cells share a color stays as if they were exact: a soft
    request between exact cells remains one, and does not become as heavy as they are.
    """

    def target(each: Target) -> Target:
        return replace(each, weight=heavy, exact=False) if each.exact else each

    groups = tuple(
        replace(
            each,
            weights=tuple(heavy if held else own for own, held in zip(each.weights, each.exact, strict=True)),
            exact=(False,) * len(each.members),
        )
        for each in requests.groups
    )
    targets, blacks = tuple(map(target, requests.targets)), tuple(map(target, requests.blacks))
    return replace(requests, targets=targets, blacks=blacks, groups=groups)


def linked_lines(requests: Requests, line: int, axis: int) -> tuple[int, ...]:
    """The rows or columns that groups of equal colors link to one, itself included."""
    linked, grows = {line}, True
    while grows:
        lines = [{member[axis] for member in group.members} for group in requests.groups]
        more = linked.union(*(each for each in lines if each & linked))
        linked, grows = more, len(more) > len(linked)
    return tuple(sorted(linked))


def lines_of(problem: PaletteProblem, lines: Sequence[int], axis: int) -> PaletteProblem:
    """Some rows or columns of a problem; references into the other ones end."""
    number = {line: k for k, line in enumerate(lines)}

    def kept(cell: Cell) -> Cell:
        others = tuple(placed(other, lines, axis) for other in cell.others if other[axis] in number)
        if len(others) < len(cell.others):  # without weight, so that it links nothing
            return Cell.ignore()
        return replace(cell, others=others)

    if axis == 0:
        cells = tuple(tuple(kept(cell) for cell in problem.cells[line]) for line in lines)
        return replace(problem, reflectances=tuple(problem.reflectances[line] for line in lines), cells=cells)
    cells = tuple(tuple(kept(row[line]) for line in lines) for row in problem.cells)
    return replace(problem, lights=tuple(problem.lights[line] for line in lines), cells=cells)


def placed(cell: CellIndex, lines: Sequence[int], axis: int) -> CellIndex:
    """The place of a cell of the whole palette in the part."""
    return (lines.index(cell[0]), cell[1]) if axis == 0 else (cell[0], lines.index(cell[1]))
