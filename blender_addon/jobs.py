# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders under way and what became of them: a record that outlives the render.

Blender does not tell a script whether a render failed (in an animation it even goes on), so every render leaves a
``RenderRecord``; batches read these instead of an operator's answer.
"""

from __future__ import annotations

import atexit
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from spectral_core.render import Progress, RenderResult, render_scene
from spectral_core.scene import Note, Scene


@dataclass(frozen=True)
class RenderRecord:
    """What became of one view layer of one frame. ``message``: the error's text, "" where there was none."""

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
    """What a script wants of the renders that it starts, beyond what F12 does.

    ``options``: passed on to the renderer. ``translated``: sees each scene before it is rendered, and may change it or
    raise RenderCancelled to leave it at that.
    """

    options: dict[str, Any] = field(default_factory=dict)
    translated: Callable[[Scene], Scene] | None = None


_request = RenderRequest()


@contextmanager
def request(wanted: RenderRequest) -> Iterator[None]:
    """Renders started within it are done as ``wanted``."""
    global _request
    before, _request = _request, wanted
    try:
        yield
    finally:
        _request = before


def current_request() -> RenderRequest:
    """What the render under way was started with."""
    return _request


records: list[RenderRecord] = []
"""Renders of this session, the latest last. At most MOST_RECORDS; only the last one keeps its pixels."""
MOST_RECORDS = 1000


def record(entry: RenderRecord) -> None:
    """Keep what became of a render."""
    if records:
        records[-1] = replace(records[-1], result=None)
    records.append(entry)
    del records[:-MOST_RECORDS]


def failures() -> list[RenderRecord]:
    """Renders of this session that did not end well."""
    return [entry for entry in records if entry.status == "failed"]


def render(
    scene: Scene, *, on_progress: Callable[[Progress], None], should_stop: Callable[[], bool], **options: Any
) -> RenderResult:
    """Render a scene. Raises RenderError where the renderer failed."""
    return render_scene(scene, on_progress=on_progress, should_stop=should_stop, **options)


def _exit_status() -> None:
    """At the end of ``blender -b … -f`` or ``-a``: Blender itself would answer 0 after a failed render."""
    failed = failures()
    if not failed:
        return
    print(f"spectral: {len(failed)} of {len(records)} renders failed; the last: {failed[-1].message}", file=sys.stderr)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(1)


RENDER_ARGUMENTS = {"-f", "--render-frame", "-a", "--render-anim"}


def register() -> None:
    """Answer a command-line render's failure with an exit status; elsewhere nothing is done at exit but tidying."""
    import bpy

    asked = RENDER_ARGUMENTS.intersection(sys.argv if "--" not in sys.argv else sys.argv[: sys.argv.index("--")])
    if bpy.app.background and not getattr(bpy.app, "module", False) and asked:
        atexit.register(_exit_status)


def unregister() -> None:
    """Forget what was rendered."""
    atexit.unregister(_exit_status)
    records.clear()
