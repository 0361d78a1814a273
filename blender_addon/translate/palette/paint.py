# SPDX-License-Identifier: GPL-3.0-or-later
"""Choice of the solver for a table's paints: plain, with matching tints, or with fluorescent dyes."""

from __future__ import annotations

from collections.abc import Callable

from bpy.types import PropertyGroup

from spectral_core.errors import InvalidInputError
from spectral_core.palette import PaletteProblem, PaletteSolution

Solver = Callable[[PaletteProblem, PaletteSolution | None], PaletteSolution]
"""From a problem, and an earlier solution to continue from or None, to a solution."""


def solver_of(palette: PropertyGroup) -> Solver:
    """The solver of this table. Raises InvalidInputError if it has both tints and dyes."""
    dyed = {row: material.dyes for row, material in enumerate(palette.materials) if len(material.dyes)}
    if dyed and palette.use_tints:
        raise InvalidInputError("tints and fluorescent dyes are not designed together; switch one of them off")
    if dyed:
        return _fluorescent(palette, dyed)
    if palette.use_tints:
        from spectral_core.palette.paint.tints import TintCriterion, solve_with_tints

        return lambda problem, _: solve_with_tints(problem, TintCriterion(weight=palette.tint_weight))
    from spectral_core.palette import solve_palette

    return lambda problem, before: solve_palette(problem, warm=before)


def _fluorescent(palette: PropertyGroup, dyed: dict[int, PropertyGroup]) -> Solver:
    from spectral_core.palette.paint.fluorescent_design import solve_fluorescent
    from spectral_core.palette.paint.fluorescent_report import palette_solution
    from spectral_core.spectra.fluorescence import FluorescentDye

    def solve(problem: PaletteProblem, before: PaletteSolution | None) -> PaletteSolution:
        dyes = {
            row: [
                FluorescentDye.gaussian(
                    f"dye {dye.excitation_nm:.0f} to {dye.emission_nm:.0f} nm", dye.excitation_nm, dye.emission_nm
                )
                for dye in group
            ]
            for row, group in dyed.items()
        }
        least = min(dye.excitation_nm for group in dyed.values() for dye in group)
        if problem.grid.wavelengths_nm[0] > least - 10:
            raise InvalidInputError(
                f"a dye absorbs light around {least:.0f} nm, but the table designs from "
                f"{problem.grid.wavelengths_nm[0]:.0f} nm on; under Design, begin at {least - 20:.0f} nm"
            )
        found = solve_fluorescent(problem, dyes, start=None if before is None else before.illuminants)
        for row, group in dyed.items():
            for dye, amount in zip(group, found.surfaces[row].amounts, strict=True):
                dye.amount = float(amount)
        return palette_solution(found)

    return solve
