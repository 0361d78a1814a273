# SPDX-License-Identifier: GPL-3.0-or-later
"""Choice of the solver for a table's paints: plain, with matching tints, or with fluorescent dyes."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from bpy.types import PropertyGroup

from spectral_core.errors import InvalidInputError
from spectral_core.palette import PaletteProblem, PaletteSolution

if TYPE_CHECKING:
    from spectral_core.spectra.fluorescence import FluorescentDye

MARGIN_NM = 10.0
"""Distance of a dye's wavelength from the first one of the table, so that its light counts."""


@dataclass(frozen=True)
class TableSolver:
    """Solver of a table; ``solve`` reads nothing from Blender, ``store`` writes what its last call found."""

    solve: Callable[..., PaletteSolution]
    """From a problem, and an earlier solution to continue from or None, to a solution. Optional: a function that calls
    the core's part, a partial call that can be sent to another process.
    """
    store: Callable[[PropertyGroup], None] = lambda _palette: None


Dyes = tuple[tuple[tuple[float, float], ...], ...]
"""Wavelengths around which the dyes of each row absorb and emit."""
Paint = tuple[float | None, Dyes]
"""Weight of tints, None without them, and the dyes."""


def paint_of(palette: PropertyGroup) -> Paint:
    """What a solution depends on beside the problem: tables that differ in it have different solutions."""
    dyes = tuple(tuple((dye.excitation_nm, dye.emission_nm) for dye in material.dyes) for material in palette.materials)
    return (palette.tint_weight if palette.use_tints else None), dyes


def has_paint(palette: PropertyGroup) -> bool:
    """True if the table has tints or dyes."""
    return bool(palette.use_tints or any(len(material.dyes) for material in palette.materials))


def dyes_of(peaks: Mapping[int, Sequence[tuple[float, float]]]) -> dict[int, list[FluorescentDye]]:
    """Dyes of each row from the wavelengths around which they absorb and emit."""
    from spectral_core.spectra.fluorescence import FluorescentDye

    return {
        row: [FluorescentDye.gaussian(f"dye {low:.0f} to {high:.0f} nm", low, high) for low, high in pairs]
        for row, pairs in peaks.items()
    }


def solver_of(palette: PropertyGroup) -> TableSolver:
    """The solver of this table. Raises InvalidInputError if it has both tints and dyes."""
    dyed = {row: material.dyes for row, material in enumerate(palette.materials) if len(material.dyes)}
    if dyed and palette.use_tints:
        raise InvalidInputError("tints and fluorescent dyes are not designed together; switch one of them off")
    if dyed:
        return _fluorescent(dyed, palette.bl_rna.properties["grid_start"].hard_min)
    if palette.use_tints:
        from spectral_core.palette.paint.tints import TintCriterion, solve_with_tints

        criterion = TintCriterion(weight=palette.tint_weight)
        return TableSolver(
            lambda problem, before, call=operator.call: call(partial(solve_with_tints, problem, criterion, warm=before))
        )
    from spectral_core.palette import solve_palette

    return TableSolver(lambda problem, before, call=operator.call: call(partial(solve_palette, problem, warm=before)))


def _fluorescent(dyed: dict[int, PropertyGroup], lowest_nm: float) -> TableSolver:
    """``lowest_nm``: least wavelength from which a table can design."""
    from spectral_core.palette.paint.fluorescent_design import solve_fluorescent
    from spectral_core.palette.paint.fluorescent_report import palette_solution

    peaks = {row: [(dye.excitation_nm, dye.emission_nm) for dye in group] for row, group in dyed.items()}
    amounts: dict[int, list[float]] = {}

    def solve(
        problem: PaletteProblem, before: PaletteSolution | None, call: Callable[..., Any] = operator.call
    ) -> PaletteSolution:
        dyes = dyes_of(peaks)
        least = min(low for pairs in peaks.values() for low, _ in pairs)
        if problem.grid.wavelengths_nm[0] > least - MARGIN_NM:
            remedy = f"under Design, begin at {max(least - 2 * MARGIN_NM, lowest_nm):.0f} nm"
            if lowest_nm > least - MARGIN_NM:
                remedy = f"give the dye {lowest_nm + MARGIN_NM:.0f} nm or more, and begin at {lowest_nm:.0f} nm"
            raise InvalidInputError(
                f"a dye absorbs light around {least:.0f} nm, but the table designs from "
                f"{problem.grid.wavelengths_nm[0]:.0f} nm on; {remedy}"
            )
        start = None if before is None else before.illuminants
        found = call(partial(solve_fluorescent, problem, dyes, start=start))
        amounts.update({row: [float(amount) for amount in found.surfaces[row].amounts] for row in peaks})
        return palette_solution(found)

    def store(palette: PropertyGroup) -> None:
        for row, found in amounts.items():
            for dye, amount in zip(palette.materials[row].dyes, found, strict=False):  # a dye may be new by now
                dye.amount = amount

    return TableSolver(solve, store)
