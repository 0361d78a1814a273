# SPDX-License-Identifier: GPL-3.0-or-later
# ruff: noqa: E402
"""Runs inside a Blender with a window: presses, drags and releases on the dial, and prints the results as JSON.

``blender --enable-event-simulate --python window_drive.py``. SPECTRAL_PATHS holds folders for sys.path, SPECTRAL_STAGE
names a folder for the file and its recording, SPECTRAL_HOLD seconds to keep the window open at the end, for a
screenshot.
"""

import json
import os
import sys
import traceback
from pathlib import Path
from time import perf_counter

sys.path[:0] = os.environ.get("SPECTRAL_PATHS", "").split(os.pathsep)

import bpy

import blender_addon
from blender_addon.panels import board as board_panels
from blender_addon.panels import dial as dial_panels
from tests.blender_relight.stage import build_stage

STEP_SECONDS = 90.0
facts: dict = {"version": bpy.app.version_string, "errors": []}
seen: dict = {}
drawn_panels: set[str] = set()


def recorded(panel):
    """Register an open copy of the panel that records that its drawing ended or failed."""
    draw = panel.draw

    def draw_and_note(self, context):
        try:
            draw(self, context)
            drawn_panels.add(panel.__name__)
        except Exception:
            facts["errors"].append(f"{panel.__name__}: {traceback.format_exc(limit=3)}")

    panel.draw, panel.bl_options = draw_and_note, set()


PANELS = (dial_panels.SPECTRAL_PT_dial_view, dial_panels.SPECTRAL_PT_dial_image, board_panels.SPECTRAL_PT_board)
for each in PANELS:
    recorded(each)
blender_addon.register_once()
bpy.context.preferences.view.show_splash = False
for block in (*bpy.data.objects, *bpy.data.materials, *bpy.data.lights, *bpy.data.cameras, *bpy.data.worlds):
    bpy.data.batch_remove([block])
# in this Blender, because none opens the files of later ones
build_stage(Path(os.environ["SPECTRAL_STAGE"]) / "stage.blend")
bpy.ops.spectral.dial_record()

from blender_addon.drawing import dial as drawn
from blender_addon.operators import dial_drag


def scene():
    return bpy.context.scene


def dial():
    return scene().spectral.dial


def view():
    return next(area for area in window().screen.areas if area.type == "VIEW_3D")


def window():
    return bpy.context.window_manager.windows[0]


def pixels_mean() -> float:
    import numpy as np

    image = bpy.data.images["Light Dial"]
    values = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(-1, 4)[:, :3].mean(axis=0).tolist()


def mouse(kind: str, value: str, place=None, **keys):
    """Send an event at a position of the dial, or in its center."""
    region = next(region for region in view().regions if region.type == "WINDOW")
    x, y = drawn_shape().pixels((0.0, 0.0) if place is None else place)
    window().event_simulate(type=kind, value=value, x=round(region.x + x), y=round(region.y + y), **keys)


def drawn_shape():
    region = next(region for region in view().regions if region.type == "WINDOW")
    return drawn.shape_in(view(), region)


def arrange() -> None:
    """Show the picture beside the view, and this extension's tab in the sidebar."""
    with bpy.context.temp_override(window=window(), area=view()):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.6)  # other areas are too narrow for a sidebar
    beside = [area for area in window().screen.areas if area.type == "VIEW_3D"][-1]
    beside.ui_type = "IMAGE_EDITOR"
    for area in (view(), beside):
        area.spaces.active.show_region_ui = True
    entry = scene().spectral.board.bindings.add()
    entry.name, entry.control = 'bpy.data.lights["Key"].energy', "osc:0:/fader/1"


def open_tab() -> None:
    for area in window().screen.areas:
        for region in area.regions:
            if region.type == "UI" and area.type in ("VIEW_3D", "IMAGE_EDITOR"):
                region.active_panel_category = "Spectral"
        area.tag_redraw()
    with bpy.context.temp_override(window=window(), area=view()):
        bpy.ops.spectral.dial_show()


def tab_open() -> bool:
    return drawn_panels == {panel.__name__ for panel in PANELS}


def play() -> None:
    region = next(region for region in view().regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window(), area=view(), region=region):
        bpy.ops.spectral.dial_play("INVOKE_DEFAULT")
    seen["start"] = pixels_mean()


def press() -> None:
    mouse("MOUSEMOVE", "NOTHING", (0.0, 0.0))
    mouse("LEFTMOUSE", "PRESS", (0.0, 0.0))


def drag() -> None:
    for share in (0.3, 0.6, 1.0):
        mouse("MOUSEMOVE", "NOTHING", [share * value for value in dial().bulbs[0].place])


def dragged() -> bool:
    seen["dragged"] = pixels_mean()
    return max(abs(a - b) for a, b in zip(dial().selector, dial().bulbs[0].place, strict=True)) < 0.05 and (
        seen["dragged"] != seen["start"]
    )


def release() -> None:
    mouse("LEFTMOUSE", "RELEASE", dial().bulbs[0].place)


def click_bulb() -> None:
    mouse("MOUSEMOVE", "NOTHING", dial().bulbs[1].place)
    mouse("LEFTMOUSE", "PRESS", dial().bulbs[1].place)
    mouse("LEFTMOUSE", "RELEASE", dial().bulbs[1].place)


def drag_bulb() -> None:
    seen["bulb"] = tuple(dial().bulbs[2].place)
    mouse("MOUSEMOVE", "NOTHING", seen["bulb"])
    mouse("LEFTMOUSE", "PRESS", seen["bulb"])
    for share in (0.8, 0.6):
        mouse("MOUSEMOVE", "NOTHING", [share * value for value in seen["bulb"]])
    mouse("LEFTMOUSE", "RELEASE", [0.6 * value for value in seen["bulb"]])


def bulb_moved() -> bool:
    return abs(dial().bulbs[2].place[1] - 0.6 * seen["bulb"][1]) < 0.05 and dial().bulbs[2].is_on


def keys() -> None:
    mouse("MOUSEMOVE", "NOTHING", (0.1, -0.1))
    mouse("ZERO", "PRESS", (0.1, -0.1))
    mouse("ZERO", "RELEASE", (0.1, -0.1))
    mouse("RIGHT_ARROW", "PRESS", (0.1, -0.1))
    mouse("RIGHT_ARROW", "RELEASE", (0.1, -0.1))


def keyed() -> bool:
    return max(abs(a - b) for a, b in zip(dial().selector, (0.05, 0.0), strict=True)) < 1e-6


def pose() -> None:
    """Keep the window open for the screenshot."""
    dial().selector = (0.45, 0.3)
    mouse("MOUSEMOVE", "NOTHING", (0.1, -0.5))
    seen["posed"] = perf_counter()


def posed() -> bool:
    return perf_counter() - seen["posed"] > float(os.environ.get("SPECTRAL_HOLD", "0"))


def escape() -> None:
    mouse("ESC", "PRESS", (0.1, -0.5))


STEPS = [
    (lambda: None, lambda: True),
    (arrange, lambda: any(area.type == "IMAGE_EDITOR" for area in window().screen.areas)),
    (open_tab, tab_open),
    (play, lambda: bool(dial_drag.running)),
    (press, lambda: True),
    (drag, dragged),
    (release, lambda: True),
    (click_bulb, lambda: not dial().bulbs[1].is_on),
    (drag_bulb, bulb_moved),
    (keys, keyed),
    (pose, posed),
    (escape, lambda: not dial_drag.running),
]
state = {"step": 0, "since": perf_counter(), "done": False}


def tick() -> float | None:
    action, met = STEPS[state["step"]]
    try:
        if not state["done"] or action is open_tab:
            action()
            state["done"] = True
        if not met():
            if perf_counter() - state["since"] < STEP_SECONDS:
                return 0.2
            facts["errors"].append(f"step {action.__name__} was not reached in {STEP_SECONDS:g} s")
    except Exception:
        facts["errors"].append(f"step {action.__name__}: {traceback.format_exc(limit=4)}")
        if action is open_tab and perf_counter() - state["since"] < STEP_SECONDS:
            facts["errors"].pop()
            return 0.5  # a region has no tabs until it has been drawn
    state.update(step=state["step"] + 1, since=perf_counter(), done=False)
    if state["step"] < len(STEPS) and not facts["errors"]:
        return 0.3
    facts.update(
        selector=list(dial().selector), steps=state["step"], start=seen.get("start"), dragged=seen.get("dragged")
    )
    print("RESULT " + json.dumps(facts), flush=True)
    bpy.ops.wm.quit_blender()
    return None


bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
