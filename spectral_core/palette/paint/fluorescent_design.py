# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes with fluorescent materials: reflectances with amounts of dyes, and lights, designed together.

The cells are those of a ``PaletteProblem``; dyes are given per reflectance. If lights are designed too, a few rounds of
one side after the other come first, then a descent over the lights, and rounds until neither side alone can be improved
or the time ends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.blas_threads import on_one_thread
from spectral_core.checks import require_kind, require_range
from spectral_core.errors import InvalidInputError, counted
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.assemble.view import Side
from spectral_core.palette.cell_errors import cell_errors
from spectral_core.palette.design.rounds import Budget, is_nothing
from spectral_core.palette.design.whole import LAST_ROUNDS, MOST_RESERVED, SECONDS
from spectral_core.palette.given import sequence_of
from spectral_core.palette.paint.fluorescence import FluorescentSurface
from spectral_core.palette.paint.fluorescent_descent import descended
from spectral_core.palette.paint.fluorescent_spectra import FluorescentSpectra
from spectral_core.palette.problem import PaletteProblem
from spectral_core.palette.qp.answer import Check
from spectral_core.palette.report import EXACT_LIMIT, exact_error
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.spectrum import Spectrum

Array = NDArray[np.float64]
Dyes = Mapping[int, Sequence[FluorescentDye]]
"""Dyes of each reflectance, by its index."""
SIDES: tuple[Side, ...] = ("reflectances", "lights")

LEAD = 3
"""Rounds before the descent over the lights."""


@dataclass(frozen=True, slots=True, eq=False)
class FluorescentSolution:
    """Spectra and errors. ``surfaces`` and ``illuminants`` in the problem's order; cells are (R, L, ...)."""

    problem: PaletteProblem
    surfaces: tuple[FluorescentSurface, ...]
    """Surfaces without dyes have no amounts."""
    illuminants: tuple[Spectrum, ...]
    target_linear_rgb: Array
    actual_linear_rgb: Array
    delta_e_2000: Array
    check: Check
    """The worst check of the last solves of each side."""
    exact_error: float
    """Largest distance of exact cells from their targets, in linear RGB."""
    rounds: int
    worst_pair_delta_e_2000: float = 0.0
    """Largest ΔE2000 between two cells with equal requested colors."""
    settled: bool = True
    """True if neither side alone could still lower the objective; False if the time or the rounds ended before."""
    notes: tuple[str, ...] = ()
    """Text on deviations from the request, such as capped weights."""

    @property
    def trusted(self) -> bool:
        """True if the solves passed their checks and every exact cell holds."""
        return self.check.passed and self.exact_error <= EXACT_LIMIT

    @property
    def largest_returned_share(self) -> float:
        """Largest share of photons or power that any surface returns at any knot: at most 1, up to rounding."""
        return max(float(surface.returned_share().max()) for surface in self.surfaces)


@on_one_thread
def solve_fluorescent(
    problem: PaletteProblem, dyes: Dyes, *, start: Sequence[Spectrum] | None = None, seconds: float = SECONDS
) -> FluorescentSolution:
    """Reflectances, amounts of dyes, and free lights that meet all cells as well as energy conservation allows.

    Parameters
    ----------
    problem
        Lights, reflectances, and the request of each cell.
    dyes
        Dyes of each reflectance, by its index.
    start
        Lights of an earlier solution, from which the design of the free ones continues.
    seconds
        Time budget if lights and reflectances are both designed.

    Returns
    -------
    The spectra and their errors; ``settled`` is False if the time ended before neither side could be improved.

    Raises
    ------
    InvalidInputError
        For settings that dyes do not support: several observers, variants of lights, lights from primaries, subspaces,
        "distinct" cells, negative reflectances, and dyes on measured reflectances.
    """
    require_kind("the palette", problem, PaletteProblem)
    require_kind("the dyes", dyes, Mapping, "of tuples of dyes by the number of their reflectance")
    dyes = {item: sequence_of(f"dyes of reflectance {item}", given) for item, given in dyes.items()}
    _require_supported(problem, dyes)
    require_range("seconds", seconds, 0.0, 1e6)
    if start is not None:
        start = sequence_of("the lights of an earlier solution", start)
        for light in start:
            require_kind("a light of an earlier solution", light, Spectrum)
        if len(start) != len(problem.lights):
            raise InvalidInputError(f"start has {counted(len(start), 'light')}; expected {len(problem.lights)}")
    own = [tuple(dyes.get(row, ())) for row in range(len(problem.reflectances))]
    design = FluorescentSpectra(problem, compiled_requests(problem), own)
    if start is not None:
        design.start_from(start)
    budget, rounds = Budget(seconds), 0
    sides: list[Side] = [side for side in SIDES if design.free_items(side)]
    took = 0.0
    for number in range(1, problem.rounds + 1):
        rounds = number
        if number == LEAD + 1:
            budget.reserved = min(LAST_ROUNDS * took, MOST_RESERVED * seconds)
            rounds += descended(design, budget)
            budget.reserved = 0.0
        before = budget.left
        gains = [design.half_round(side, thorough=len(sides) < 2) for side in sides]
        took = max(before - budget.left, took / 2)
        if len(sides) < 2 or budget.left <= took:  # the joint check takes as long as a round
            break
        if all(is_nothing(fall, least) for fall, least in gains) and design.checked(sides)[1]:
            break
    check, settled = design.checked(sides)
    return _solution(design, check, rounds, settled=settled)


def _solution(design: FluorescentSpectra, check: Check, rounds: int, *, settled: bool) -> FluorescentSolution:
    """The present spectra."""
    actual = design.colors()
    errors = cell_errors(design.problem, design.requests, [actual])
    return FluorescentSolution(
        design.problem,
        design.surface_spectra(),
        design.light_spectra(),
        errors.target_linear_rgb,
        actual,
        errors.delta_e_2000,
        check,
        exact_error(design.requests, actual)[0],
        rounds,
        errors.worst_pair_delta_e_2000,
        settled,
        design.requests.notes,
    )


def _require_supported(problem: PaletteProblem, dyes: Dyes) -> None:
    refused: dict[str, Any] = {
        "several observers": len(problem.observers) > 1,
        "variants of lights": any(light.variants for light in problem.lights),
        "lights from primaries, or held to a white or a luminance": any(
            light.primaries or light.white_xyz is not None or light.luminance is not None for light in problem.lights
        ),
        "a subspace criterion": problem.subspace is not None,
        "lights that are scaled": problem.scale_lights,
        "perceptual matching": problem.match != "linear",
        "'distinct' cells": any(cell.mode == "distinct" for row in problem.cells for cell in row),
        "negative reflectances": problem.reflectance_bounds[0] < 0 or problem.reflectance_bounds[1] > 1,
    }
    found = [name for name, present in refused.items() if present]
    if found:
        raise InvalidInputError(f"a palette with fluorescence has {', '.join(found)}; it is designed without them")
    for item, given in dyes.items():
        for dye in given:
            require_kind(f"a dye of reflectance {item}", dye, FluorescentDye)
        if not isinstance(item, int | np.integer) or not 0 <= item < len(problem.reflectances):
            raise InvalidInputError(f"dyes for reflectance {item}; expected 0 to {len(problem.reflectances) - 1}")
        if not problem.reflectances[item].free:
            raise InvalidInputError(
                f"reflectance {problem.reflectances[item].name!r} is measured, so no dye can be designed into it; let "
                "it be designed (Spectrum: Designed; in a file, give it no spectrum)"
            )
