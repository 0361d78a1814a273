# SPDX-License-Identifier: GPL-3.0-or-later
"""Solving the palette of a scene: read the properties, solve, write the properties."""

import operator
import traceback
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from bpy.types import PropertyGroup, Scene

from spectral_core.errors import SpectralError
from spectral_core.palette import PaletteProblem, PaletteSolution, PaletteStatus

from ...translate.palette.paint import Paint, paint_of, solver_of
from ...translate.palette.problem import palette_problem, takes_seconds
from ...translate.palette.solution import store_solution
from ...translate.palette.table import paused
from ..apart import APART
from . import names, picture
from .session import fingerprint, forget_sessions, live_solution, same_problem, same_table

NEEDS_BUTTON = "This table takes some seconds to solve: press Solve"
"""Message of a table that is not solved live; no error."""
_last: dict[int, PaletteSolution] = {}
"""Last solution by scene, a start for the next one. Not saved: an opened file starts without it."""


@dataclass(frozen=True)
class Solve:
    """A solve of a table as it was read; ``answer`` reads nothing from Blender, so that a thread can call it."""

    problem: PaletteProblem
    compute: Callable[[], PaletteSolution]
    finished: bool = True
    """False if ``finishing_solve`` does the rest."""
    store: Callable[[PropertyGroup], None] = lambda _palette: None
    """Writes into the table what the solution does not hold, such as amounts of dyes."""
    entries: tuple[int, ...] = ()
    """Lasting numbers of the rows and columns, in their order."""
    paint: Paint = (None, ())
    """Tints and dyes of the table, which the problem does not hold."""

    def answer(self) -> PaletteSolution | str:
        """The solution, or a text on why there is none."""
        try:
            return self.compute()
        except SpectralError as error:
            return str(error)
        except Exception as error:  # neither a timer nor a thread can pass the error to a caller
            traceback.print_exc()
            return f"the solver failed unexpectedly ({type(error).__name__}: {error})"


MOST_FINISHED = 64
"""Finished solutions that are kept for undo and redo."""
_finished: OrderedDict[tuple[Any, ...], Solve] = OrderedDict()
"""The latest finished solutions, by scene, lasting numbers of the entries, tints and dyes, and fingerprint of the
problem.
"""


def button_solve(scene: Scene, call: Callable[..., Any] = operator.call) -> Solve | None:
    """Solve from the start; None if the table is invalid (``message`` says why).

    If the time ended before the solution of the unchanged table was optimal, the solve continues from that solution.
    ``call``: calls the core's part.
    """
    palette = scene.spectral.palette
    # A common brightness is computed anew: from a brightened solution it would only grow.
    continues = palette.status == PaletteStatus.IMPROVING and not (palette.is_stale or palette.scale_lights)
    before = _last.get(scene.session_uid) if continues else None

    def solve(problem: PaletteProblem) -> Solve:
        solver = solver_of(palette)
        return Solve(problem, lambda: solver.solve(problem, before, call), store=solver.store)

    return _read(scene, solve)


def live_solve(scene: Scene) -> Solve | None:
    """Solve an edit: a few milliseconds for the usual table. Tables that take seconds wait for the button."""
    palette, uid = scene.spectral.palette, scene.session_uid
    if not len(palette.lights) or not len(palette.materials):
        return None
    if takes_seconds(palette):
        if palette.is_stale and _read(scene, lambda problem: Solve(problem, lambda: live_solution(uid, problem))):
            palette.message = NEEDS_BUTTON  # unless Solve would only state what is wrong
        return None
    return _read(scene, lambda problem: Solve(problem, lambda: live_solution(uid, problem), finished=False))


def finishing_solve(scene: Scene) -> Solve | None:
    """Finish the parts that ``live_solve`` omits for speed: all rounds, and the explanation of conflicts."""
    from spectral_core.palette import solve_palette

    palette = scene.spectral.palette
    if palette.is_stale or not palette.status or takes_seconds(palette):
        return None
    # A common brightness is computed anew: from a brightened solution it would only grow.
    before = None if palette.scale_lights else _last.get(scene.session_uid)
    return _read(
        scene, lambda problem: Solve(problem, lambda: APART.call(partial(solve_palette, problem, warm=before)))
    )


def known_solve(scene: Scene) -> Solve | None:
    """The finished solution that this table had before; None if there is none.

    Where lights and materials are designed together, many solutions have the wanted colors, and a solve from the
    present one would find another.
    """
    palette = scene.spectral.palette
    if not len(palette.lights) or not len(palette.materials):
        return None
    solve = _read(scene, lambda problem: Solve(problem, lambda: live_solution(scene.session_uid, problem)))
    return None if solve is None else _finished.get(_key(scene, solve))


def _key(scene: Scene, solve: Solve) -> tuple[Any, ...]:
    return scene.session_uid, solve.entries, solve.paint, fingerprint(solve.problem)


def _read(scene: Scene, solve: Callable[[PaletteProblem], Solve]) -> Solve | None:
    palette = scene.spectral.palette
    try:
        return replace(solve(palette_problem(palette)), entries=_entries(palette), paint=paint_of(palette))
    except SpectralError as error:
        palette.message, palette.is_stale = str(error), True
        return None


def _entries(palette: PropertyGroup) -> tuple[int, ...]:
    return tuple(each.uid for each in (*palette.lights, *palette.materials))


def keep(
    scene: Scene, solve: Solve, answer: PaletteSolution | str, *, may_differ: bool = True
) -> PaletteSolution | None:
    """Store the answer in the table; None if it is a text, or if the rows or columns are others by now, or moved.

    An answer for earlier numbers of the same table is stored, and the table stays outdated. ``may_differ``: False if
    Blender has handled no event since the table was read, which then is not read again.
    """
    palette = scene.spectral.palette
    if solve.entries != _entries(palette):
        return None
    try:
        now = palette_problem(palette) if may_differ else solve.problem
    except SpectralError as error:
        palette.message, palette.is_stale = str(error), True
        return None
    is_current = now is solve.problem or (same_problem(solve.problem, now) and solve.paint == paint_of(palette))
    if isinstance(answer, str):
        palette.message, palette.is_stale = answer, True
        return None
    if not (is_current or same_table(solve.problem, now)):
        return None
    with paused():
        solve.store(palette)
        store_solution(palette, answer, finished=solve.finished)
        names.name_results(palette, [each.name for each in (*answer.illuminants, *answer.reflectances)])
        palette.message = ""
        palette.is_stale = not is_current
    _last[scene.session_uid] = answer
    if solve.finished and is_current:
        _remember(scene, solve, answer)
    picture.follow(scene)
    return answer


def _remember(scene: Scene, solve: Solve, answer: PaletteSolution) -> None:
    key = _key(scene, solve)
    _finished[key] = replace(solve, compute=lambda: answer)
    _finished.move_to_end(key)
    while len(_finished) > MOST_FINISHED:
        _finished.popitem(last=False)


def solve_now(scene: Scene, solve: Solve | None) -> PaletteSolution | None:
    """Solve and store at once."""
    return None if solve is None else keep(scene, solve, solve.answer(), may_differ=False)


def solve_scene(scene: Scene) -> PaletteSolution | None:
    """``button_solve`` at once."""
    return solve_now(scene, button_solve(scene))


def solve_live(scene: Scene) -> PaletteSolution | None:
    """``live_solve`` at once."""
    return solve_now(scene, live_solve(scene))


def forget_solutions() -> None:
    """Start without a solution at the next edit."""
    _last.clear()
    _finished.clear()
    forget_sessions()
