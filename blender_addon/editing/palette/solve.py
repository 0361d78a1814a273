# SPDX-License-Identifier: GPL-3.0-or-later
"""Solving the palette of a scene: read the properties, solve, write the properties."""

import traceback
from collections.abc import Callable

from bpy.types import Scene

from spectral_core.errors import SpectralError
from spectral_core.palette import PaletteProblem, PaletteSolution, PaletteStatus

from ...translate.palette.paint import solver_of
from ...translate.palette.problem import palette_problem, takes_seconds
from ...translate.palette.solution import store_solution
from ...translate.palette.table import paused
from . import picture
from .session import forget_sessions, live_solution

_last: dict[int, PaletteSolution] = {}
"""Last solution by scene, a start for the next one. Not saved: an opened file starts without it."""


def solve_scene(scene: Scene) -> PaletteSolution | None:
    """Solve from the start; None if the table cannot be solved (``message`` says why).

    If the time ended before the solution of the unchanged table was optimal, the solve continues from that solution.
    """
    palette = scene.spectral.palette
    # A common brightness is computed anew: from a brightened solution it would only grow.
    continues = palette.status == PaletteStatus.IMPROVING and not (palette.is_stale or palette.scale_lights)
    before = _last.get(scene.session_uid) if continues else None
    return _solve(scene, lambda problem: solver_of(palette)(problem, before))


def solve_live(scene: Scene) -> PaletteSolution | None:
    """Solve an edit at once: a few milliseconds for the usual table; tables that take seconds wait for the button."""
    palette = scene.spectral.palette
    if not len(palette.lights) or not len(palette.materials):
        return None
    if takes_seconds(palette):
        if palette.is_stale:  # Solve may have been pressed since the edit
            palette.message = "This table takes some seconds to solve: press Solve"
        return None
    return _solve(scene, lambda problem: live_solution(scene.session_uid, problem), finished=False)


def finish_live(scene: Scene) -> PaletteSolution | None:
    """Finish the parts that ``solve_live`` omits for speed: all rounds, and the explanation of conflicts."""
    from spectral_core.palette import solve_palette

    palette = scene.spectral.palette
    if palette.is_stale or not palette.status or takes_seconds(palette):
        return None
    # A common brightness is computed anew: from a brightened solution it would only grow.
    before = None if palette.scale_lights else _last.get(scene.session_uid)
    return _solve(scene, lambda problem: solve_palette(problem, warm=before))


def _solve(
    scene: Scene, solve: Callable[[PaletteProblem], PaletteSolution], *, finished: bool = True
) -> PaletteSolution | None:
    palette = scene.spectral.palette
    with paused():
        try:
            solution = solve(palette_problem(palette))
        except SpectralError as error:
            palette.message = str(error)
            palette.is_stale = True
            return None
        except Exception as error:  # a timer cannot pass the error to a caller
            traceback.print_exc()
            palette.message = f"the solver failed unexpectedly ({type(error).__name__}: {error})"
            palette.is_stale = True
            return None
        store_solution(palette, solution, finished=finished)
        palette.message = ""
        palette.is_stale = False
    _last[scene.session_uid] = solution
    picture.follow(scene)
    return solution


def forget_solutions() -> None:
    """Start without a solution at the next edit."""
    _last.clear()
    forget_sessions()
