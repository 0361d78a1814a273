# SPDX-License-Identifier: GPL-3.0-or-later
"""Running renders and their outcomes: the renderer's process, and records that persist after the render.

Blender does not report to a script that a render failed (in an animation it even continues), so every render adds a
``RenderRecord``; batches read these instead of an operator's result.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import bpy

from spectral_core.render import Progress, RenderProcess, RenderResult
from spectral_core.render.denoise import how_to_install, is_installed
from spectral_core.render.live.link import LiveLink
from spectral_core.scene import Note, Scene


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


_running = [0]
"""Number of renders of the engine, icons included, that have not returned to Blender."""
_counting = threading.Lock()
"""Icons and a render are on different threads, and a sum in place takes several steps."""
_ending = threading.Event()
END_S, NEXT_S, FREE_S = 20.0, 2.0, 0.5
"""Longest waits for the end of renders and for the beginning of one, and for Blender to free the engine after it."""
POLL_S = 0.02


@contextmanager
def under_way() -> Iterator[None]:
    """Within it the engine renders, on a thread of Blender's."""
    with _counting:
        _running[0] += 1
    try:
        yield
    finally:
        with _counting:
            _running[0] -= 1


def is_ending() -> bool:
    """True while the extension is being disabled: every render stops."""
    return _ending.is_set()


def end_renders() -> None:
    """Stop every render, and wait for it: Blender crashes if the class of a running engine is removed."""
    _ending.set()
    began = latest = time.monotonic()
    is_expected = not bpy.app.background and bpy.app.is_job_running("RENDER")  # of this engine, or of another one
    while time.monotonic() < began + END_S:
        if _running[0]:
            latest, is_expected = time.monotonic(), True
        elif time.monotonic() >= latest + (0 if not is_expected else FREE_S if latest > began else NEXT_S):
            return
        time.sleep(POLL_S)  # the thread of the render needs Python


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


def register() -> None:
    """Permit renders again; processes start with the first one."""
    _ending.clear()


def unregister() -> None:
    """End the renderer's processes; the records stay for the exit status."""
    process.close()
    while _previews:
        _previews.pop().close()
    while _live:
        _live.pop().close()
