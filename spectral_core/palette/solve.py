# SPDX-License-Identifier: GPL-3.0-or-later
"""``solve_palette``: spectra that come as near to all cells as the bounds allow.

One side alone is a convex problem and is solved once. If lights are designed too, a few rounds bring both sides near
each other, variable projection improves them together, and rounds finish the solve: until neither side alone can be
improved any further, or the time budget ends.
"""

from __future__ import annotations

from time import perf_counter

from spectral_core.blas_threads import on_one_thread
from spectral_core.checks import require_kind, require_range
from spectral_core.errors import InvalidInputError
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import PaletteState, initial_state
from spectral_core.palette.brightness_unit import brightness_unit, from_unit, in_unit, start_in_unit
from spectral_core.palette.conflicts import with_conflicts
from spectral_core.palette.design.rounds import Budget, Rounds, SolveTrace
from spectral_core.palette.design.whole import SECONDS, brightened_to_fit, designed
from spectral_core.palette.distinct.cells import wants_distinct
from spectral_core.palette.distinct.search import solve_distinct
from spectral_core.palette.given import shown
from spectral_core.palette.problem import PaletteProblem
from spectral_core.palette.report import reported
from spectral_core.palette.solution import PaletteSolution


@on_one_thread
def solve_palette(
    problem: PaletteProblem,
    *,
    warm: PaletteSolution | None = None,
    explain: bool = True,
    seconds: float = SECONDS,
) -> PaletteSolution:
    """Design the spectra of a palette.

    Never raises for an impossible target: the solution's ``status``, ``remedy`` and ``conflicts`` report it.

    Parameters
    ----------
    problem
        Lights, reflectances, and the request of each cell.
    warm
        An earlier solution of a like problem; where the unknowns have the same shapes its spectra are the start.
    explain
        Whether to name the cells that conflict where targets are missed.
    seconds
        Time budget where lights and reflectances are both designed. Where it ends the search, the status is
        ``still_improving``; solve again with ``warm`` to go on.

    Returns
    -------
    The spectra, the colors that they show, errors, status and remedy.
    """
    require_kind("the palette", problem, PaletteProblem, "read_palette of spectral_core.palette.files reads a file")
    require_range("seconds", seconds, 0.0, 1e6)
    if warm is not None and not isinstance(warm, PaletteSolution):
        raise InvalidInputError(f"warm is {shown(warm)}; expected a PaletteSolution, or None")
    if wants_distinct(problem):
        return solve_distinct(problem, warm=warm)
    if (unit := brightness_unit(problem)) != 1:
        start = None if warm is None else start_in_unit(warm, unit)
        return from_unit(
            solve_palette(in_unit(problem, unit), warm=start, explain=explain, seconds=seconds), problem, unit
        )
    started = perf_counter()
    requests = compiled_requests(problem)
    assembler = Assembler(problem, requests)
    state = initial_state(problem, None if warm is None else warm.state)
    trace = SolveTrace(notes=list(requests.notes))
    if problem.scale_lights:
        state = brightened_to_fit(assembler, state, trace, warm)
    fresh = warm is None or not _continues(state, warm)
    # Before the time budget begins: a first import takes a quarter of it.
    import scipy.optimize  # noqa: F401

    state = designed(Rounds(assembler, trace), state, Budget(seconds), race=fresh)
    trace.timings["total"] = perf_counter() - started
    solution = reported(assembler, state, trace)
    if not explain:
        return solution
    return with_conflicts(solution, check=True)


def _continues(state: PaletteState, warm: PaletteSolution) -> bool:
    return warm.state is not None and all(a is b for a, b in zip(state.lights, warm.state.lights, strict=False))
