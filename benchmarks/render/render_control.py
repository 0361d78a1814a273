# SPDX-License-Identifier: GPL-3.0-or-later
"""Control of F12: the time until a cancel takes effect, and the state of Blender after the renderer is killed."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import dataclass, field
from typing import Any

from benchmarks import Options
from benchmarks.render.render_cycles import MATERIALS, empty_scene

PICTURES = 4
"""Number of pictures before the user acts: by then a pass takes 8 samples."""


@dataclass
class _User:
    """Waits for a few pictures, then stops the render or kills its process."""

    act: str
    shown: list[float] = field(default_factory=list)
    acted_at: float | None = None

    def should_stop(self, _engine: Any) -> bool:
        from blender_addon import jobs

        if self.acted_at is None and len(self.shown) >= PICTURES:
            self.acted_at = time.perf_counter()
            if self.act == "kill" and jobs.process.process_id is not None:
                os.kill(jobs.process.process_id, signal.SIGKILL)
        return self.acted_at is not None and self.act == "cancel"


def run(options: Options) -> dict[str, Any]:
    """Cancel and kill renders of a glass ball under a sky, at 1080p (160×90 with --quick); print and return."""
    import bpy

    import blender_addon

    blender_addon.register_once()
    empty_scene(samples=1 << 20, size=64)
    MATERIALS["glass"]()
    render = bpy.context.scene.render
    render.engine = "SPECTRAL"
    render.resolution_x, render.resolution_y = (160, 90) if options.quick else (1920, 1080)
    figures = {act: _acted(act) for act in ("cancel", "kill")}
    cancel, kill = figures["cancel"], figures["kill"]
    return figures | {
        "holds": {
            "Blender is free 1 s after a cancel": cancel["status"] == "cancelled" and cancel["seconds"] < 1,
            "Blender is free 1 s after a kill, with a message that names the signal": kill["status"] == "failed"
            and kill["seconds"] < 1
            and "signal 9" in kill["message"],
        }
    }


def _acted(act: str) -> dict[str, Any]:
    """Render until the user acts: time until Blender is free again, and its message."""
    import bpy

    from blender_addon import engine, jobs

    user, kind = _User(act), engine.SpectralRenderEngine
    write, should_stop = kind._write, kind._should_stop

    def watched_write(self: Any, *given: Any) -> None:
        write(self, *given)
        user.shown.append(time.perf_counter())

    kind._write, kind._should_stop = watched_write, lambda engine_: user.should_stop(engine_)
    message = ""
    try:
        bpy.ops.render.render()
    except RuntimeError as error:
        message = str(error).splitlines()[0].removeprefix("Error: ")
    finally:
        back_at = time.perf_counter()
        kind._write, kind._should_stop = write, should_stop
    assert user.acted_at is not None
    seconds, status = back_at - user.acted_at, jobs.records[-1].status
    print(f"{act}: Blender is back {seconds:.2f} s later, status {status!r}{': ' if message else ''}{message}")
    return {"seconds": seconds, "status": status, "message": message, "pass_seconds": user.shown[-1] - user.shown[-2]}
