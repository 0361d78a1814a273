# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes that no solver answers accurately: with exact cells that exclude each other, or with extreme numbers.

Texts name the cells, the numbers that were given, those that were expected, and the remedy.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import first_of
from spectral_core.palette.assemble.assembled import Assembled
from spectral_core.palette.assemble.state import PaletteState
from spectral_core.palette.design.linear_programs import least_miss
from spectral_core.palette.explain.exact_sets import comparisons
from spectral_core.palette.given import cell_name, told_apart
from spectral_core.palette.problem import CellIndex, CellMode, PaletteProblem
from spectral_core.palette.qp.answer import Answer
from spectral_core.palette.qp.feasibility import forced_black
from spectral_core.spectra.color import XYZ_FROM_RGB

Array = NDArray[np.float64]

BRIGHTEST = 1e3
"""Largest color that is ordinary, in linear RGB: white is 1."""
SPREAD = 1e6
"""Ratio of the colors of white under two lights, from which the dimmer is lost in the rounding of the brighter."""
NEARLY = 1e-2
"""Error of exact cells, in linear RGB, up to which they may hold in black alone, even if a conflict is proven to
rounding."""
MOST_UNKNOWNS, MOST_NAMES = 4000, 4
"""Largest side for which that is tested, which takes up to a second; and most cells that a message names."""
PROVEN = 1e-9
"""Share of the largest color by which exact cells must miss for a proof that they conflict."""
NO_LIGHT = 1e-7
"""Color per sample of the grid, in linear RGB, below which a designed light is black. Reflectance below which a
designed material is."""
ROUNDING = 1e-14
"""Share of a color that may be rounding of its sum."""


def missed_as_measured(problem: PaletteProblem, shown: Array, limit: float) -> tuple[CellIndex, ...]:
    """The exact cells that measured materials miss under measured lights, so that each of them alone cannot hold.

    ``shown``: linear RGB (R, L, 3) of all cells; ``limit``: linear RGB by which an exact cell may be off.
    """
    found = []
    for i, j in np.ndindex(shown.shape[:2]):
        cell = problem.cells[i][j]
        if problem.scale_lights or not cell.exact or any(_is_designed(problem, at) for at in ((i, j), *cell.others)):
            continue
        for signs, low, high in comparisons(cell, (i, j)):
            total = np.sum([sign * shown[at] for at, sign in signs], axis=0)
            if max(low - total) > limit or max(total - high) > limit:
                found.append((i, j))
                break
    return tuple(found)


def _is_designed(problem: PaletteProblem, at: CellIndex) -> bool:
    return problem.reflectances[at[0]].free or problem.lights[at[1]].free


def excluded_pair(problem: PaletteProblem, state: PaletteState) -> str:
    """Two exact cells of one reflectance whose lights cannot show such different colors; "" if none is found.

    No reflectance within its bounds changes the color by more than the sum of the lights' differences. A pair may
    exclude each other by less than any test of feasibility tells from rounding, and yet leave no solver an answer.
    """
    matrices = state.light_matrices()[0]
    limit = max(abs(end) for end in problem.reflectance_bounds)
    for i, surface in enumerate(problem.reflectances):
        cells = [j for j in range(len(problem.lights)) if surface.free and _exact_color(problem, (i, j)) is not None]
        for one, two in combinations(cells, 2):
            if problem.lights[one].free or problem.lights[two].free or not np.isfinite(limit):
                continue
            first, second = _exact_color(problem, (i, one)), _exact_color(problem, (i, two))
            assert first is not None
            assert second is not None
            asked = np.abs(first - second)
            most = np.abs(matrices[one] - matrices[two]).sum(axis=1) * limit
            worst = int(np.argmax(asked - most))
            if asked[worst] > most[worst] + ROUNDING * float(np.abs(matrices[one]).sum(axis=1).max()) * limit:
                return (
                    f"{cell_name(problem, (i, one))} and {cell_name(problem, (i, two))} must be exact and differ by "
                    f"{asked[worst]:.2g} in linear RGB, but these lights show any surface in colors that differ by "
                    f"{most[worst]:.2g} at most. Give both cells one color, or make one of them not exact."
                )
    return ""


def only_black(problem: PaletteProblem, solved: tuple[Assembled, Answer] | None, worst: float) -> str:
    """Exact cells that only black meets, as "same" under two lights that no other color survives; "" if none is found.

    ``solved``: the side of the reflectances with its answer; ``worst``: largest error of an exact cell that the
    solution has.
    """
    if solved is None or any(light.free for light in problem.lights):
        return ""
    assembled, answer = solved
    if assembled.quadratic.size > MOST_UNKNOWNS:
        return ""
    if worst > NEARLY and (not answer.values or least_miss(assembled.quadratic, answer) > 0):
        return ""  # another cause is proven, or likely
    cells = forced_black(assembled.quadratic)
    if not cells:
        return ""
    sets = [
        first_of([cell_name(problem, cell) for cell in own], len(own), MOST_NAMES) for own in _apart(problem, cells)
    ]
    more = f"; and {len(sets) - MOST_NAMES} more sets" if len(sets) > MOST_NAMES else ""
    apart = (
        f"; independently of these, the same holds for {'; '.join(sets[1:MOST_NAMES])}{more}" if len(sets) > 1 else ""
    )
    which = "one of each of these sets" if len(sets) > 1 else "one of them"
    return (
        f"Together with the other exact cells, {sets[0]} can be exact only in black{apart}. The closest compromise is "
        f"shown, which misses exact cells by {worst:.1g} in linear RGB. Make {which} not exact, or choose another "
        "light."
    )


def _apart(problem: PaletteProblem, cells: Sequence[CellIndex]) -> list[list[CellIndex]]:
    """Cells in sets that no exact cell connects, by its material and those that it refers to."""
    asking = [((i, j), cell) for i, row in enumerate(problem.cells) for j, cell in enumerate(row) if cell.exact]
    sets: list[set[int]] = []
    for rows in [{row for row, _ in (at, *cell.others)} for at, cell in asking] + [{row} for row, _ in cells]:
        joined = rows.union(*(each for each in sets if each & rows))
        sets = [*(each for each in sets if not each & rows), joined]
    found = [[cell for cell in cells if cell[0] in rows] for rows in sets]
    return sorted((own for own in found if own), key=lambda own: cells.index(own[0]))


def unlit(problem: PaletteProblem, state: PaletteState) -> list[str]:
    """Notes on designed lights, one each, and on designed materials, one for all, that are black because no cell needs
    more of them.
    """
    notes, brightest = [], np.abs(state.light_matrices()[0]).max(axis=(1, 2))
    for j, light in enumerate(problem.lights):
        if light.free and brightest[j] < NO_LIGHT:
            white = "; its required white allows every brightness, also 0" if light.white_xyz is not None else ""
            notes.append(
                f"light {light.name!r} is black, which meets all requests of its column{white}. Require it to keep its "
                "luminance (Keep Brightness), or give one of these cells a color other than black"
            )
    black = []
    for material, values, row in zip(problem.reflectances, state.reflectances, problem.cells, strict=True):
        is_asked = any(cell.mode in (CellMode.BLACK, CellMode.FIXED) for cell in row)
        if values is not None and not is_asked and np.abs(values).max() < NO_LIGHT:
            black.append(f"material {material.name!r}")
    if len(black) == 1:
        remedy = "give one of its cells a color if it should not be black"
        notes.append(f"{black[0]} is black, which meets all its requests; {remedy}")
    elif black:
        named = first_of(black, len(black), MOST_NAMES)
        remedy = "give one of the cells of each a color if it should not be black"
        notes.append(f"{len(black)} materials are black, which meets all their requests: {named}; {remedy}")
    return notes


def white_remedy(problem: PaletteProblem, whites: list[int]) -> str:
    """What helps designed lights (``whites``) whose white is impossible."""
    texts = []
    for has_primaries in (True, False):
        own = [f"“{problem.lights[j].name}”" for j in whites if bool(problem.lights[j].primaries) is has_primaries]
        if own and has_primaries:
            texts.append(
                f"The primaries of {', '.join(own)} cannot make the white that the light must show, in any amounts. "
                "Add a primary on the other side of that white, choose another white, or do not require one."
            )
        elif own:
            texts.append(
                f"No light has the white that {', '.join(own)} must show: it is more saturated than the colors of the "
                "spectrum. Choose another white, or do not require one."
            )
    return " ".join(texts)


def luminance_outside(problem: PaletteProblem, state: PaletteState) -> str:
    """The remedy for a designed light whose bounds exclude the luminance that it must keep; "" if there is none."""
    for j, light in enumerate(problem.lights):
        if light.luminance is None:
            continue
        own, wanted = state.given.primary_colors[j], light.luminance * state.light_scale
        y = XYZ_FROM_RGB[1] @ (state.kernel.bare[0] if own is None else own.T)
        lit = y > ROUNDING * np.abs(y).max()
        least, most = (float(y[lit] @ ends[lit]) for ends in state.light_limits(j, problem.light_bounds))
        if not least * (1 - PROVEN) <= wanted <= most * (1 + PROVEN):
            return (
                f"“{light.name}” must have the luminance {wanted:.3g}, but within the bounds of lights, "
                f"{problem.light_bounds[0]:g} to {problem.light_bounds[1]:g}, it has {least:.3g} to {most:.3g}. "
                "Change the bounds, or the luminance."
            )
    return ""


def held_materials(problem: PaletteProblem) -> set[int]:
    """Materials that any exact cell concerns."""
    cells = [((i, j), cell) for i, row in enumerate(problem.cells) for j, cell in enumerate(row) if cell.exact]
    return {row for at, cell in cells for row, _ in (at, *cell.others)}


def is_proven(problem: PaletteProblem, solved: Iterable[tuple[Assembled, Answer]]) -> bool:
    """True if the multipliers of a side prove that exact cells conflict by more than rounding of the largest color.

    ``solved``: the sides with their answers.
    """
    largest = max((float(np.abs(color).max()) for _, color in _colors(problem)), default=0.0)
    return any(
        answer.values and least_miss(assembled.quadratic, answer) > PROVEN * max(largest, 1.0)
        for assembled, answer in solved
        if answer.infeasible
    )


def extreme_number(problem: PaletteProblem, state: PaletteState) -> str:
    """The most extreme number of a palette that no solver answered accurately; "" if all are ordinary."""
    bright = [(float(np.abs(color).max()), at) for at, color in _colors(problem)]
    most, cell = max(bright, default=(0.0, (0, 0)))
    if most > BRIGHTEST:
        return (
            f"{cell_name(problem, cell)} has the color {most:.3g} in linear RGB, where white is 1: beside it, errors "
            f"of other colors are lost in rounding. Expected are colors up to {BRIGHTEST:g}. Divide the colors under "
            "that light by a number that brings them near 1, and multiply the power of the light in the scene, or the "
            "exposure, by it."
        )
    white = np.abs(state.light_matrices()[0].sum(axis=2)).max(axis=1)
    seen = [j for j in np.argsort(white, kind="stable").tolist() if white[j] > 0]
    if seen and white[seen[-1]] > SPREAD * max(most, 1.0):
        name = told_apart([light.name for light in problem.lights], seen[-1])
        return (
            f"A white surface shows {white[seen[-1]]:.3g} in linear RGB under {name}, and the brightest wanted color "
            f"is {most:.3g}: the materials reflect less than rounding errors. Expected is at most {SPREAD:g} "
            "times that color: reduce the power or the luminance of the light."
        )
    if seen and white[seen[-1]] > SPREAD * white[seen[0]]:
        names = [light.name for light in problem.lights]
        return (
            f"A white surface shows {white[seen[-1]]:.3g} in linear RGB under {told_apart(names, seen[-1])} and "
            f"{white[seen[0]]:.3g} under {told_apart(names, seen[0])}; a ratio up to {SPREAD:g} is expected. Bring the "
            "powers of the two lights nearer to each other."
        )
    return ""


def _colors(problem: PaletteProblem) -> list[tuple[CellIndex, Array]]:
    return [
        ((i, j), np.asarray(cell.target))
        for i, row in enumerate(problem.cells)
        for j, cell in enumerate(row)
        if cell.mode is CellMode.FIXED and cell.target is not None and (cell.weight > 0 or cell.exact)
    ]


def _exact_color(problem: PaletteProblem, at: CellIndex) -> Array | None:
    cell = problem.cells[at[0]][at[1]]
    if not cell.exact or cell.mode not in (CellMode.FIXED, CellMode.BLACK):
        return None
    return np.zeros(3) if cell.target is None else np.asarray(cell.target)
