# SPDX-License-Identifier: GPL-3.0-or-later
# ruff: noqa: E402
"""Runs inside a Blender with a window: opens every panel, edits live, undoes, and prints the results as JSON.

``blender file --python window_drive.py``; SPECTRAL_PATHS holds folders for sys.path. Times of drawing and of timers
vary, above all under software OpenGL, so each step waits for its condition, not for a time.
"""

import contextlib
import json
import os
import sys
import traceback
from time import perf_counter

sys.path[:0] = os.environ.get("SPECTRAL_PATHS", "").split(os.pathsep)

import bpy

import blender_addon
from blender_addon.panels import palette as palette_panels
from blender_addon.panels import render as render_panels
from blender_addon.panels import spectrum as spectrum_panels

STEP_SECONDS = 60.0
drawn: set[str] = set()
errors: list[str] = []
facts: dict = {"version": bpy.app.version_string}


def recorded(draw, name: str):
    """The panel's draw function, which records that it ended or failed."""

    def draw_and_note(self, context):
        try:
            draw(self, context)
            drawn.add(name)
        except Exception:
            errors.append(f"{name}: {traceback.format_exc(limit=3)}")

    return draw_and_note


PANELS = [
    *palette_panels.PANELS,
    render_panels.SPECTRAL_PT_render_sampling, render_panels.SPECTRAL_PT_render_plan,
    spectrum_panels.SPECTRAL_PT_material_spectrum, spectrum_panels.SPECTRAL_PT_light_spectrum,
    spectrum_panels.SPECTRAL_PT_world_spectrum, spectrum_panels.SPECTRAL_PT_node_spectrum,
]  # fmt: skip
for panel in PANELS:
    panel.draw = recorded(panel.draw, panel.__name__)
    panel.bl_options = set()  # closed panels are not drawn
blender_addon.register_once()

bpy.context.preferences.view.show_splash = False


def palette():
    """The palette, read from the scene at each call, because undo invalidates references."""
    return bpy.context.scene.spectral.palette


def areas(kind: str) -> list:
    return [a for w in bpy.context.window_manager.windows for a in w.screen.areas if a.type == kind]


def show(context_name: str):
    """Show a tab in the properties editor, and this extension's tab in every sidebar."""

    def turn() -> None:
        for area in areas("PROPERTIES"):
            area.spaces.active.context = context_name
        for area in (*areas("VIEW_3D"), *areas("NODE_EDITOR")):
            area.spaces.active.show_region_ui = True
            for region in area.regions:
                if region.type == "UI":
                    with contextlib.suppress(AttributeError, TypeError):  # no tabs yet, or no tab for the active object
                        region.active_panel_category = "Spectral"
        for window in bpy.context.window_manager.windows:
            for area in window.screen.areas:
                area.tag_redraw()

    return turn


def prepare() -> None:
    """A solved and applied palette, spectra of all kinds, a plan."""
    bpy.ops.spectral.palette_preset(preset="SPLIT_LIGHT")
    palette().materials[0].material, palette().lights[1].light = (
        bpy.data.objects["Cube"].active_material,
        bpy.data.objects["Light"].data,
    )
    bpy.ops.spectral.palette_apply()
    palette().show_curves = True
    bpy.context.scene.world.spectral.source = "CATALOGUE"
    bpy.context.scene.world.spectral.catalogue_name = "nobody"
    bpy.context.scene.render.engine = "SPECTRAL"
    bpy.ops.spectral.plan()
    nodes = areas("DOPESHEET_EDITOR") or areas("OUTLINER")
    nodes[0].ui_type = "ShaderNodeTree"
    tree = bpy.data.objects["Cube"].active_material.node_tree
    tree.nodes.active = tree.nodes["Principled BSDF"]
    bpy.ops.ed.undo_push(message="prepared")


def select_lamp() -> None:
    bpy.context.view_layer.objects.active = bpy.data.objects["Light"]


def edit() -> None:
    facts["before"] = tuple(palette().materials[2].cells[1].actual_linear)
    facts["edited_at"] = perf_counter()
    palette().materials[2].cells[1].target = (0.9, 0.7, 0.5)
    facts["waits_for_timer"] = palette().is_stale


def solved() -> bool:
    if palette().is_stale:
        return False
    facts.setdefault("answered_after", perf_counter() - facts["edited_at"])
    facts["after"] = tuple(palette().materials[2].cells[1].actual_linear)
    return True


def undo() -> None:
    """Undo the edit as a user does."""
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.ed.undo_push(message="edited")
        bpy.ops.ed.undo()
    facts["target_after_undo"] = tuple(palette().materials[2].cells[1].target)


def undone() -> bool:
    cell = palette().materials[2].cells[1]
    facts["error_after_undo"] = max(abs(a - b) for a, b in zip(cell.actual_linear, facts["before"], strict=True))
    return facts["error_after_undo"] < 1e-2


def ask_the_impossible() -> None:
    """Request green under a lamp without green light."""
    bpy.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    for row, target in enumerate([(0.0, 0.0, 1.0), (1.0, 0.0, 0.0)]):
        palette().materials[row].cells[0].target = target
        palette().materials[row].cells[1].target = (0.0, 1.0, 0.0)


def conflict_drawn() -> bool:
    facts["status"], facts["conflicts"] = palette().status, len(palette().conflicts)
    return not palette().is_stale and palette().status != "solved" and len(palette().conflicts) > 0


def seen(*names: str):
    return lambda: all(any(panel.startswith(name) for panel in drawn) for name in names)


def nothing() -> None:
    pass


STEPS = [
    (nothing, lambda: True),
    (prepare, lambda: True),
    (show("SCENE"), seen("SPECTRAL_PT_palette_view", "SPECTRAL_PT_palette_scene", "SPECTRAL_PT_node")),
    (show("MATERIAL"), seen("SPECTRAL_PT_material")),
    (show("WORLD"), seen("SPECTRAL_PT_world")),
    (show("RENDER"), seen("SPECTRAL_PT_render_plan", "SPECTRAL_PT_render_sampling")),
    (select_lamp, lambda: True),
    (show("DATA"), seen("SPECTRAL_PT_light")),
    (edit, solved),
    (undo, undone),
    (ask_the_impossible, conflict_drawn),
    (show("SCENE"), lambda: len(drawn) == len(PANELS)),
]
"""Steps and their end conditions. Showing a tab is repeated until it is visible, because Blender may not be ready."""
state = {"step": 0, "since": perf_counter(), "done": False}


def tick() -> float | None:
    action, met = STEPS[state["step"]]
    try:
        if not state["done"] or action.__name__ == "turn":
            action()
            state["done"] = True
        if not met():
            if perf_counter() - state["since"] < STEP_SECONDS:
                return 0.3
            errors.append(f"step {state['step']} ({action.__name__}) was not reached in {STEP_SECONDS:g} s")
    except Exception:
        errors.append(f"step {state['step']}: {traceback.format_exc(limit=4)}")
    state.update(step=state["step"] + 1, since=perf_counter(), done=False)
    if state["step"] < len(STEPS) and not errors:
        return 0.3
    facts.pop("edited_at", None)
    result = {**facts, "panels": len(PANELS), "drawn": sorted(drawn), "errors": errors}
    print("RESULT " + json.dumps(result), flush=True)
    bpy.ops.wm.quit_blender()
    return None


bpy.app.timers.register(tick, first_interval=1.0)
