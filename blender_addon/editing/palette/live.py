# SPDX-License-Identifier: GPL-3.0-or-later
"""From a change in the palette's panel to a new solution. Panels never solve: they show stored results."""

import threading
from collections.abc import Callable

import bpy

from spectral_core.palette import PaletteSolution

from ... import compat
from ...properties import hooks
from ...properties.hooks import Topic
from ...translate.palette.solution import show_stored_colors
from ...translate.palette.table import fill_references, paused
from ..apart import APART
from ..behind import Behind
from ..deferred import Deferred, redraw
from . import names, picture, possible
from .solve import Solve, finishing_solve, forget_solutions, keep, known_solve, live_solve, solve_now

DELAY_SECONDS = 0.0
"""Time from an edit to its solution. Blender calls timers once in each round of events: edits of one round are solved
together.
"""
REST_SECONDS = 0.3
"""Time without a further edit after which the solution is finished: all rounds, and the conflicts."""
SOLVES, FINISHES = Behind("palette"), Behind("finished palette")
"""Threads of their own, so that an edit does not wait until the solution before it is finished."""
AREAS = ("VIEW_3D", "PROPERTIES", "NODE_EDITOR")


def edited(properties: bpy.types.PropertyGroup) -> None:
    """Handle a change of the palette: solve again if it is live, else mark its result as outdated."""
    palette = properties.id_data.spectral.palette
    palette.is_stale = True
    if not (palette.live and palette.possible_follows) or bpy.app.background:  # else it follows the finished solution
        possible.changed(palette.id_data)
    if palette.live and compat.is_editable(palette.id_data):
        LIVE.request(palette.id_data)


def _live_switched(palette: bpy.types.PropertyGroup) -> None:
    """Solve the changes made while Live was off."""
    if palette.live and palette.is_stale:
        LIVE.request(palette.id_data)


def _mode_changed(cell: bpy.types.PropertyGroup) -> None:
    """Give a cell that refers to other cells the most frequent references."""
    with paused():
        fill_references(cell)
    hooks.announce(Topic.PALETTE, cell)


def _follow(scene: bpy.types.Scene) -> None:
    FINISHES.drop(scene)  # it finishes the table before this edit
    if not (len(scene.spectral.palette.lights) and len(scene.spectral.palette.materials)):
        picture.forget(scene)
    if not SOLVES.is_busy(scene, LIVE.request):
        solve = live_solve(scene)
        if solve is None:
            possible.changed(scene)  # no finished solution will come that it could follow
        _solve(SOLVES, scene, solve, lambda: None)


def _finish(scene: bpy.types.Scene) -> None:
    if not SOLVES.is_busy(scene, LIVE.request):
        _solve(FINISHES, scene, finishing_solve(scene), lambda: possible.follow(scene))


def _solve(solver: Behind, scene: bpy.types.Scene, solve: Solve | None, then: Callable[[], None]) -> None:
    is_later = False

    def done(scene: bpy.types.Scene, answer: PaletteSolution | str) -> None:
        assert solve is not None
        kept = keep(scene, solve, answer, may_differ=is_later)
        show()
        if kept is not None:
            then()
        else:
            possible.changed(scene)
        for each in bpy.data.scenes:  # Blender reports no copy of a scene, which may have been made meanwhile
            if each != scene:
                _resume(each)

    if solve is None:
        show()
    else:
        solver.run(scene, solve.answer, done)
        is_later = True


def show() -> None:
    """Repaint every area that may show the palette."""
    redraw(*AREAS)


LIVE = Deferred(_follow, _finish, delay_seconds=DELAY_SECONDS, rest_seconds=REST_SECONDS)


@bpy.app.handlers.persistent
def _after_undo(*_: object) -> None:
    """An undo changes the tables of all scenes; Blender names only that of the window in which it was called."""
    for scene in bpy.data.scenes:
        if compat.is_editable(scene) and (len(scene.spectral.palette.materials) or picture.shown_in(scene)):
            _undone(scene)


def _undone(scene: bpy.types.Scene) -> None:
    """Blender stores an undo step before the timer has solved, so a step may contain new targets with older results.

    Or a step is of the time between that solution and its finish, which names the conflicts. A step with its own
    results, or a table that is not live, keeps its results; the picture shows them.
    """
    palette = scene.spectral.palette
    for solver in (SOLVES, FINISHES):
        solver.drop(scene)  # it solves the table before the undo
    if not (palette.live and (palette.is_stale or palette.is_unfinished)):
        picture.follow(scene)
    else:
        known = known_solve(scene)
        if known is None:
            LIVE.request(scene)
        else:
            solve_now(scene, known)
            show()
    possible.follow(scene)  # a step contains the answer of before its edit, which came later


@bpy.app.handlers.persistent
def _before_update(scene: bpy.types.Scene, *_: object) -> None:
    """Solve before Blender draws the edit: the first redraw then shows its colors, not only the second."""
    if threading.current_thread() is threading.main_thread():  # the depsgraphs of renders are updated by other threads
        LIVE.flush(scene)


def _resume(scene: bpy.types.Scene) -> None:
    """Solve a table of which nobody else does: that of a file or scene that was saved or copied before its solution, or
    before the conflicts were found.

    Without a window it waits: Apply solves it, and a command that renders does not need it.
    """
    palette = scene.spectral.palette
    is_complete = not (palette.is_stale or palette.is_unfinished)
    if bpy.app.background or not palette.live or is_complete or palette.message:
        return
    is_waiting = LIVE.is_pending(scene) or scene.session_uid in {*SOLVES.running, *FINISHES.running}
    if not is_waiting and len(palette.lights) and len(palette.materials) and compat.is_editable(scene):
        LIVE.request(scene)


@bpy.app.handlers.persistent
def _after_load(*_: object) -> None:
    """A file was opened, perhaps one of an earlier version."""
    for scene in bpy.data.scenes:
        show_stored_colors(scene.spectral.palette)
        names.know(scene.spectral.palette)
        _resume(scene)


HANDLERS = {
    "undo_post": _after_undo,
    "redo_post": _after_undo,
    "load_post": _after_load,
    "depsgraph_update_pre": _before_update,
}
LISTENERS = {
    Topic.PALETTE: edited,
    Topic.PALETTE_LIVE: _live_switched,
    Topic.PALETTE_CELL_MODE: _mode_changed,
    Topic.PALETTE_NAME: names.renamed,
}


def register() -> None:
    """Start listening to edits, and solve again after undo and redo."""
    for topic, listener in LISTENERS.items():
        hooks.listen(topic, listener)
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Stop listening to edits, and drop pending ones."""
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(handler)
    hooks.ignore(*LISTENERS)
    LIVE.cancel()
    SOLVES.stop()
    FINISHES.stop()
    possible.ANSWERS.stop()
    APART.end()
    forget_solutions()
