# SPDX-License-Identifier: GPL-3.0-or-later
"""What scripts share that drive a Blender with a window: its view, its steps by a timer, and what it tells."""

from __future__ import annotations

import faulthandler
import json
import os
import sys
import time
import traceback
from collections.abc import Callable, Generator
from typing import Any

import bpy

Steps = Generator[float, None, None]


def settings() -> dict[str, Any]:
    """The settings that the benchmark passes."""
    found: dict[str, Any] = json.loads(os.environ.get("SPECTRAL_SETTINGS", "{}"))
    return found


def area() -> Any:
    """The first 3D view."""
    return next(each for each in bpy.context.window_manager.windows[0].screen.areas if each.type == "VIEW_3D")


def space() -> Any:
    """Its settings."""
    return area().spaces.active


def region() -> Any:
    """The part of it that shows the scene."""
    return next(each for each in area().regions if each.type == "WINDOW")


def in_view() -> Any:
    """Operators that are called within it take it for the view under the pointer."""
    return bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=area(), region=region())


def only_the_view() -> Steps:
    """Let the 3D view fill the window, without bars."""
    with in_view():
        bpy.ops.screen.screen_full_area(use_hide_panels=True)
    yield 1.0
    view = space()
    view.show_region_header = view.show_region_toolbar = view.show_region_ui = False
    yield 1.0


def shader(name: str) -> Any:
    """The inputs of a material's Principled BSDF."""
    return next(node for node in bpy.data.materials[name].node_tree.nodes if node.type == "BSDF_PRINCIPLED").inputs


def until(is_true: Callable[[], bool], seconds: float, what: str) -> Steps:
    """Wait. Raises TimeoutError."""
    end = time.monotonic() + seconds
    while not is_true():
        if time.monotonic() > end:
            raise TimeoutError(f"{what}: not within {seconds:g} s")
        yield 0.02


def drive(steps: Steps, told: dict[str, Any]) -> None:
    """Run ``steps``, each after as many seconds as the last yielded; then print ``told`` and end Blender."""
    told.setdefault("errors", [])
    faulthandler.enable(sys.__stderr__)  # if Blender ends with a signal: what Python did then
    told["version"] = bpy.app.version_string

    def tick() -> float | None:
        try:
            return next(steps)
        except StopIteration:
            pass
        except Exception:  # what was measured before it is told, too
            told["errors"].append(traceback.format_exc())
        print("RESULT " + json.dumps(told), flush=True)
        bpy.ops.wm.quit_blender()
        return None

    bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
