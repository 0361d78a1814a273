# SPDX-License-Identifier: GPL-3.0-or-later
"""Running renders and their outcomes: the renderer's process, and records that persist after the render.

Blender does not report to a script that a render failed (in an animation it even continues), so every render adds a
``RenderRecord``; batches read these instead of an operator's result.
"""

from __future__ import annotations

import atexit
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import bpy

from spectral_core.render import Progress, RenderProcess, RenderResult
from spectral_core.render.denoise import how_to_install, is_installed
from spectral_core.render.live.link import LiveLink
from spectral_core.scene import Note, Scene

from .properties.render import ENGINE


@dataclass(frozen=True)
class RenderRecord:
    """Outcome of one view layer of one frame. ``message``: the error's text, "" if there was none."""

    frame: int
    view_layer: str
    status: Literal["done", "cancelled", "failed"]
    message: str = ""
    notes: tuple[Note, ...] = ()
    samples: int = 0
    seconds: float = 0.0
    result: RenderResult | None = field(default=None, repr=False)


@dataclass(frozen=True)
class RenderRequest:
    """Options of a script for the renders that it starts, beyond those of F12.

    ``options``: passed on to the renderer. ``translated``: receives each scene before it is rendered; it may change the
    scene, or raise RenderCancelled to skip the render. ``rendered``: receives the result of each picture, with the
    names of its view layer and of its view ("" except for stereo).
    """

    options: dict[str, Any] = field(default_factory=dict)
    translated: Callable[[Scene], Scene] | None = None
    rendered: Callable[[RenderResult, str, str], None] | None = None


_request = RenderRequest()


@contextmanager
def request(wanted: RenderRequest) -> Iterator[None]:
    """Renders started within it use ``wanted``."""
    global _request
    before, _request = _request, wanted
    try:
        yield
    finally:
        _request = before


def current_request() -> RenderRequest:
    """Options of the running render."""
    return _request


records: list[RenderRecord] = []
"""Renders of this session, the latest last. At most MOST_RECORDS; only the last one keeps its pixels."""
MOST_RECORDS = 1000


def record(entry: RenderRecord) -> None:
    """Keep the outcome of a render."""
    if records:
        records[-1] = replace(records[-1], result=None)
    records.append(entry)
    del records[:-MOST_RECORDS]


def failures() -> list[RenderRecord]:
    """Renders of this session that failed."""
    return [entry for entry in records if entry.status == "failed"]


NICENESS = 0 if bpy.app.background else 12
"""Added to the niceness of renders: in a window the artist goes on, and the view (8) is drawn before the render."""
process = RenderProcess(niceness=NICENESS)
"""The process of all renders: started by the first render, and again after a crash or an end."""


_live: list[LiveLink] = []
_previews: list[RenderProcess] = []


def render_preview(
    scene: Scene, on_progress: Callable[[Progress], None], should_stop: Callable[[], bool]
) -> RenderResult:
    """Render an icon or the preview panel, in a separate process that waits for no other render.

    It adds no record. Raises RenderError if the process crashed or its renderer failed.
    """
    if not _previews:
        _previews.append(RenderProcess(niceness=NICENESS))
    return _previews[0].render(scene, on_progress=on_progress, should_stop=should_stop)


def live() -> LiveLink:
    """The process of viewports, separate from that of renders, so that neither waits for the other or ends with it."""
    if not _live:
        _live.append(LiveLink())
    return _live[0]


def render(
    scene: Scene, *, on_progress: Callable[[Progress], None], should_stop: Callable[[], bool], **options: Any
) -> RenderResult:
    """Render a scene in the renderer's own process.

    Raises RenderError if that process crashed or its renderer failed; the next render starts a new one.
    """
    return process.render(scene, on_progress=on_progress, should_stop=should_stop, **options)


def missing_denoiser() -> str:
    """Sentence on the installation of the denoiser; "" if it is installed."""
    text = "" if is_installed() else how_to_install()
    return f"{text[:1].upper()}{text[1:]}." if text else ""


RENDER_ARGUMENTS = {"-f", "--render-frame", "-a", "--render-anim"}
_engine_asked = ""


def _command_line() -> list[str]:
    """Arguments of the command line that Blender itself reads."""
    return sys.argv[: sys.argv.index("--")] if "--" in sys.argv else sys.argv


def _file_was_loaded(*_: Any) -> None:
    """Store the engine of each loaded file: at the end of the session its data are not available."""
    global _engine_asked
    _engine_asked = bpy.context.scene.render.engine


def _exit_status() -> None:
    """At the end of ``blender -b … -f`` or ``-a``: Blender itself exits with 0 after a failed render."""
    given = _command_line()
    engine = next((given[i + 1] for i, word in enumerate(given[:-1]) if word in ("-E", "--engine")), _engine_asked)
    if engine != ENGINE:
        return
    failed = failures()
    if records and not failed:
        return
    if failed:
        print(f"spectral: {len(failed)} of {len(records)} renders failed: {failed[-1].message}", file=sys.stderr)
    else:
        print("spectral: nothing was rendered; Blender's messages above say why", file=sys.stderr)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(1)


def register() -> None:
    """Set the exit status of a command-line render after a failure; in other cases only clean up at exit."""
    if bpy.app.background and not getattr(bpy.app, "module", False) and RENDER_ARGUMENTS.intersection(_command_line()):
        bpy.app.handlers.persistent(_file_was_loaded)
        bpy.app.handlers.load_post.append(_file_was_loaded)
        atexit.unregister(_exit_status)
        atexit.register(_exit_status)  # persists after unregister(), which Blender calls before its exit


def unregister() -> None:
    """End the renderer's process; the records stay for the exit status."""
    if _file_was_loaded in bpy.app.handlers.load_post:
        bpy.app.handlers.load_post.remove(_file_was_loaded)
    process.close()
    while _previews:
        _previews.pop().close()
    while _live:
        _live.pop().close()
