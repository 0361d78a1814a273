# SPDX-License-Identifier: GPL-3.0-or-later
# ruff: noqa: E402
"""Runs inside a Blender with a window: adds three settings to a sweep by the context menu, runs it, applies a point.

``blender --factory-startup --python window_drive.py``; SPECTRAL_PATHS holds folders for sys.path, SPECTRAL_FOLDER an
empty folder, SPECTRAL_HOLD seconds to keep the window open at the end, for a screenshot. Prints RESULT and JSON.
With SPECTRAL_EXTENSION=bl_ext.user_default.spectral_scene, and without --factory-startup, it drives the installed zip.
"""

import json
import os
import sys
import time
import traceback
from types import SimpleNamespace

sys.path[:0] = [entry for entry in os.environ.get("SPECTRAL_PATHS", "").split(os.pathsep) if entry]

from importlib import import_module

import bpy

NAME = os.environ.get("SPECTRAL_EXTENSION", "blender_addon")
extension, panels = import_module(NAME), import_module(NAME + ".panels.sweep")
if "SPECTRAL_EXTENSION" in os.environ:
    bpy.utils.unregister_class(panels.SPECTRAL_PT_sweep)  # registered again below, in the tab that is shown

facts: dict = {"version": bpy.app.version_string, "errors": [], "drawn": False}
draw = panels.SPECTRAL_PT_sweep.draw


def draw_and_note(self, context):
    try:
        draw(self, context)
        facts["drawn"] = True
    except Exception:
        facts["errors"].append(traceback.format_exc(limit=3))


panels.SPECTRAL_PT_sweep.draw, panels.SPECTRAL_PT_sweep.bl_options = draw_and_note, set()
panels.SPECTRAL_PT_sweep.bl_category = "Item"  # the tab of a new window
if "SPECTRAL_EXTENSION" in os.environ:
    bpy.utils.register_class(panels.SPECTRAL_PT_sweep)
else:
    extension.register()
bpy.context.preferences.view.show_splash = False

operators, editing = import_module(NAME + ".operators.sweep"), import_module(NAME + ".editing.sweep.live")


class Layout:
    """A layout that can press its last button."""

    def separator(self):
        """Ignore labels: only buttons can be pressed."""

    def operator(self, name, **_look):
        """Keep the arguments of a button."""
        self.pressed = SimpleNamespace(name=name)
        return self.pressed


def by_menu(pointer, identifier):
    """Add a setting by the function that draws its context menu entry."""
    menu = SimpleNamespace(layout=Layout())
    known = pointer.bl_rna.properties[identifier]
    operators.draw_menu(menu, SimpleNamespace(button_pointer=pointer, button_prop=known))
    bpy.ops.spectral.sweep_add(target=menu.layout.pressed.target)


def begin():
    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL"
    scene.render.resolution_x, scene.render.resolution_y = 64, 48
    for area in bpy.context.screen.areas:
        if area.type == "VIEW_3D":
            area.spaces.active.show_region_ui = True
            for region in area.regions:
                if region.type == "UI" and hasattr(region, "active_panel_category"):
                    try:
                        region.active_panel_category = "Spectral"
                    except (AttributeError, TypeError):
                        facts["category"] = "not settable"
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(os.environ["SPECTRAL_FOLDER"], "scene.blend"))  # noqa: PTH118
    by_menu(bpy.data.lights["Light"], "energy")
    by_menu(bpy.data.objects["Camera"], "location")
    by_menu(bpy.data.lights["Light"], "type")
    sweep = scene.spectral.sweep
    for entry, (low, high) in zip(sweep.parameters, ((200, 2000), (3, 8)), strict=False):
        entry.low, entry.high = low, high
    sweep.parameters[0].scale, sweep.parameters[2].choices = "log", "POINT, SPOT"
    sweep.budget, sweep.percentage, sweep.samples = 4, 100, 4
    facts["labels"] = [entry.label for entry in sweep.parameters]
    bpy.ops.spectral.sweep_run()


def finish():
    scene = bpy.context.scene
    facts["status"] = scene.spectral.sweep.status
    rows = editing.rows(scene)
    facts["rows"] = len(rows)
    bpy.ops.spectral.sweep_open(browse=False)
    facts["address"] = bpy.context.window_manager.clipboard.startswith("http://127.0.0.1:")
    before = bpy.data.lights["Light"].energy
    bpy.ops.spectral.sweep_apply(row=2)
    wanted = rows[1].parameters[facts["labels"][0]]
    facts["applied"] = abs(bpy.data.lights["Light"].energy - wanted) < 1e-3 * wanted and before != wanted
    facts["applied"] &= bpy.data.lights["Light"].type == rows[1].parameters[facts["labels"][2]]
    facts["drawn"] = bool(facts["drawn"])


state = {"step": 0, "end": time.monotonic() + 240}


def tick():
    try:
        if state["step"] == 0:
            begin()
            state["step"] = 1
            return 1.0
        if state["step"] == 1:
            if bpy.app.timers.is_registered(editing.tick) and time.monotonic() < state["end"]:
                return 0.5
            finish()
            state["step"], state["end"] = 2, time.monotonic() + float(os.environ.get("SPECTRAL_HOLD", "2"))
            return 1.0
        if time.monotonic() < state["end"]:
            return 0.5
    except Exception:
        facts["errors"].append(traceback.format_exc(limit=6))
    print("RESULT " + json.dumps(facts), flush=True)
    bpy.ops.wm.quit_blender()
    return None


bpy.app.timers.register(tick, first_interval=2.0)
