# SPDX-License-Identifier: GPL-3.0-or-later
"""From a change in the panel to a new solution: at once without a window, shortly after with one.

Dragging a slider changes a property many times per second; a timer collects what came in the meantime and solves once.
Panels never solve: they show what was stored.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

DELAY_SECONDS = 0.02
"""From an edit to its solution; edits in the meantime are solved together."""
REST_SECONDS = 0.3
"""Without a further edit the solution is finished: all rounds, and what stands in the way of what."""
RENDER_SECONDS = 0.5

_paused = 0
_edited: set[str] = set()
_unfinished: set[str] = set()


@contextmanager
def paused() -> Iterator[None]:
    """Within it changes do not solve: for code that sets many properties, and solves once at its end."""
    global _paused
    _paused += 1
    try:
        yield
    finally:
        _paused -= 1


def edited(properties, _context=None) -> None:
    """Update callback of every wish: solve again where the palette is live, else mark its result as old."""
    if _paused:
        return
    scene = properties.id_data
    palette = scene.spectral.palette
    palette.is_stale = True
    if palette.live:
        request(scene)


def catch_up(palette, _context=None) -> None:
    """Update callback of "Live": switched on, it solves what changed in the meantime."""
    if palette.live and palette.is_stale and not _paused:
        request(palette.id_data)


def request(scene) -> None:
    """Solve the palette of ``scene``: now where there is no window, else after the delay."""
    if bpy.app.background:
        _follow(scene)
        _finish(scene)
        return
    if not _edited:  # what waits already is not put off further: a drag shows its way
        if bpy.app.timers.is_registered(_tick):
            bpy.app.timers.unregister(_tick)
        bpy.app.timers.register(_tick, first_interval=DELAY_SECONDS)
    _edited.add(scene.name)


def _tick() -> float | None:
    """Timer: first what was edited, then, after a rest, what is not finished."""
    if bpy.app.is_job_running("RENDER"):
        return RENDER_SECONDS  # a render reads these spectra
    if _edited:
        for scene in _taken(_edited):
            _follow(scene)
            _unfinished.add(scene.name)
        return REST_SECONDS
    for scene in _taken(_unfinished):
        _finish(scene)
    return None


def _taken(names: set[str]) -> list:
    scenes = [bpy.data.scenes.get(name) for name in names]
    names.clear()
    return [scene for scene in scenes if scene is not None]


def _follow(scene) -> None:
    from .palette_solve import solve_live

    solve_live(scene)
    redraw()


def _finish(scene) -> None:
    from .palette_solve import finish_live

    if finish_live(scene) is not None:
        redraw()


def redraw() -> None:
    """Repaint every area that may show the palette."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"VIEW_3D", "PROPERTIES", "NODE_EDITOR"}:
                area.tag_redraw()


@bpy.app.handlers.persistent
def _after_undo(scene, *_rest) -> None:
    """Blender stores an undo step before the timer has solved, so a step may hold wishes with older results."""
    if scene is not None and scene.spectral.palette.live and len(scene.spectral.palette.materials):
        request(scene)


HANDLERS = ("undo_post", "redo_post")


def register() -> None:
    """Solve again after undo and redo."""
    for name in HANDLERS:
        getattr(bpy.app.handlers, name).append(_after_undo)


def unregister() -> None:
    """Forget what waits."""
    for name in HANDLERS:
        getattr(bpy.app.handlers, name).remove(_after_undo)
    _edited.clear()
    _unfinished.clear()
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
