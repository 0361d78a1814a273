# SPDX-License-Identifier: GPL-3.0-or-later
"""From a change in the panel to a new solution: at once without a window, shortly after with one.

Dragging a slider changes a property many times per second; a timer collects what came in the meantime and solves once.
Panels never solve: they show what was stored.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

DELAY_SECONDS = 0.02

_paused = 0
_waiting: set[str] = set()


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


def request(scene) -> None:
    """Solve the palette of ``scene``: now where there is no window, else after the delay."""
    if bpy.app.background:
        _solve(scene)
        return
    _waiting.add(scene.name)
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=DELAY_SECONDS)


def _tick() -> None:
    names = set(_waiting)
    _waiting.clear()
    if bpy.app.is_job_running("RENDER"):
        _waiting.update(names)  # a render reads these spectra; solve when it is done
        return DELAY_SECONDS * 25
    for name in names:
        scene = bpy.data.scenes.get(name)
        if scene is not None:
            _solve(scene)
    return None


def _solve(scene) -> None:
    from .palette_solve import solve_scene

    solve_scene(scene, live=True)
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
    _waiting.clear()
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
