# SPDX-License-Identifier: GPL-3.0-or-later
"""Words for cells that conflict: their requests, lists of them, and what to do."""

from __future__ import annotations

from collections.abc import Sequence

from spectral_core.errors import first_of
from spectral_core.palette.given import cell_name
from spectral_core.palette.problem import CellIndex, CellMode, PaletteProblem

MOST_NAMES = 8
"""Most cells that a text names."""


def listed(names: Sequence[str]) -> str:
    """Names of two cells or more, with "and"; of many the first ones, and how many more there are."""
    if len(names) > MOST_NAMES:
        return first_of(names, len(names), MOST_NAMES)
    return f"{', '.join(names[:-1])} and {names[-1]}"


def request_of(problem: PaletteProblem, at: CellIndex) -> str:
    """The request of a cell in words."""
    cell = problem.cells[at[0]][at[1]]
    words = {
        CellMode.FIXED: "a color",
        CellMode.FREE: "a range of colors",
        CellMode.BLACK: "black",
        CellMode.SAME: "same as ",
        CellMode.CONSTANT: "constant with ",
    }[cell.mode]
    named = [cell_name(problem, other) for other in cell.others]
    return ("exact, " if cell.exact else "") + words + (named[0] if len(named) == 1 else listed(named) if named else "")


def own_remedy(problem: PaletteProblem, cell: CellIndex) -> str:
    """What to do about a cell that no other cell excludes."""
    light = problem.lights[cell[1]]
    if not light.free:
        return (
            f"the color may be out of reach under “{light.name}”; brighten or free that light, or choose another color."
        )
    return "the color may be out of reach; choose another one, or lower the smoothness."
