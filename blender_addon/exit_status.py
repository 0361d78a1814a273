# SPDX-License-Identifier: GPL-3.0-or-later
"""Exit status of ``blender -b … -f`` and ``-a``: Blender itself exits with 0 after most failed renders.

The engine's records alone do not suffice: a render of strips, of another scene with another engine, or of frames that
exist already and are not overwritten has none, and none of these is a failure. So Blender's own handlers are read.
"""

from __future__ import annotations

import atexit
import os
import sys
from typing import Any

import bpy

from spectral_core.errors import counted

from . import jobs
from .properties.render import ENGINE

RENDER_ARGUMENTS = {"-f", "--render-frame", "-a", "--render-anim"}

_engine_asked = ""
"""Engine of the file that was loaded last: at the end of the session its data are not available."""
_begun: list[str] = []
"""Names of the scenes whose render Blender has begun, with any engine."""
_without_frame: set[str] = set()
"""Those that use this engine and of which Blender has rendered no frame so far, unless it may skip existing frames."""
_stopped: list[str] = []
"""Names of the scenes whose render with this engine did not reach its end."""


def _command_line() -> list[str]:
    """Arguments of the command line that Blender itself reads."""
    return sys.argv[: sys.argv.index("--")] if "--" in sys.argv else sys.argv


def _file_was_loaded(*_: Any) -> None:
    global _engine_asked
    _engine_asked = bpy.context.scene.render.engine


def _has_begun(scene: Any, *_: Any) -> None:
    _begun.append(scene.name)
    if scene.render.engine == ENGINE and scene.render.use_overwrite:
        _without_frame.add(scene.name)


def _frame_begins(scene: Any, *_: Any) -> None:
    _without_frame.discard(scene.name)


def _was_stopped(scene: Any, *_: Any) -> None:
    if scene.render.engine == ENGINE:
        _stopped.append(scene.name)


_HANDLERS = {
    "load_post": _file_was_loaded, "render_init": _has_begun,
    "render_pre": _frame_begins, "render_cancel": _was_stopped,
}  # fmt: skip


def _failure() -> str:
    """Text on the renders with this engine that failed, "" if none did."""
    failed = jobs.failures()
    if failed:
        return f"{len(failed)} of {counted(len(jobs.records), 'render')} failed: {failed[-1].message}"
    if _stopped:
        return f"the render of the scene {_stopped[-1]!r} was stopped; Blender's messages above say why"
    given = _command_line()
    asked = next((given[i + 1] for i, word in enumerate(given[:-1]) if word in ("-E", "--engine")), _engine_asked)
    if _without_frame or (not _begun and asked == ENGINE):
        return "nothing was rendered; Blender's messages above say why"
    return ""


def _end() -> None:
    """At the end of the process: exit with 1 after a failure."""
    message = _failure()
    if not message:
        return
    print(f"spectral: {message}", file=sys.stderr)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(1)


def register() -> None:
    """Listen to the renders of a command line; in other processes nothing changes."""
    if bpy.app.background and not getattr(bpy.app, "module", False) and RENDER_ARGUMENTS.intersection(_command_line()):
        for name, handler in _HANDLERS.items():
            getattr(bpy.app.handlers, name).append(bpy.app.handlers.persistent(handler))
        atexit.unregister(_end)
        atexit.register(_end)  # persists after unregister(), which Blender calls before its exit


def unregister() -> None:
    """Stop listening; what was heard stays for the exit status."""
    for name, handler in _HANDLERS.items():
        listening = getattr(bpy.app.handlers, name)
        if handler in listening:
            listening.remove(handler)
