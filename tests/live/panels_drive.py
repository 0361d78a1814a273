# SPDX-License-Identifier: GPL-3.0-or-later
# ruff: noqa: E402
"""Runs inside a Blender with a window and the extension: takes pictures of the palette, texture and recipe panels.

``blender --factory-startup --python panels_drive.py``; SPECTRAL_OUT is a folder for pictures of the screen (made by
ImageMagick's ``import``), SPECTRAL_IMAGES two image files, SPECTRAL_ONLY names of steps. Prints RESULT and JSON.
"""

import faulthandler
import json
import os
import subprocess
import time
import traceback
from importlib import import_module
from pathlib import Path

faulthandler.enable()

import addon_utils
import bpy

NAME = os.environ.get("SPECTRAL_EXTENSION", "bl_ext.user_default.spectral_scene")
addon_utils.enable(NAME)
OUT = Path(os.environ.get("SPECTRAL_OUT", "/tmp"))
IMAGES = os.environ.get("SPECTRAL_IMAGES", "").split(os.pathsep)
ONLY = os.environ.get("SPECTRAL_ONLY", "").split()
PATIENCE_S = float(os.environ.get("SPECTRAL_PATIENCE", "240"))
texture_job, jobs = import_module(f"{NAME}.editing.texture_job"), import_module(f"{NAME}.jobs")
facts: dict = {"version": bpy.app.version_string, "errors": [], "pictures": []}
bpy.context.preferences.view.show_splash = False


def area():
    return next(each for each in bpy.context.window_manager.windows[0].screen.areas if each.type == "VIEW_3D")


def in_view():
    window, found = bpy.context.window_manager.windows[0], area()
    region = next(each for each in found.regions if each.type == "WINDOW")
    return bpy.context.temp_override(window=window, area=found, region=region)


def full():
    with in_view():
        bpy.ops.screen.screen_full_area(use_hide_panels=False)


def only_panels(*names):
    """Register only these panels in the sidebar's tab, open by default: Python cannot open a closed panel."""
    ours = [each for each in bpy.types.Panel.__subclasses__() if getattr(each, "bl_category", "") == "Spectral"]
    ours = [each for each in ours if each.__module__.startswith(NAME)]
    for panel in reversed(ours):
        if getattr(panel, "is_registered", False):
            bpy.utils.unregister_class(panel)
    for panel in ours:
        if panel.__name__ in names:
            panel.bl_options = set()
            bpy.utils.register_class(panel)
    area().tag_redraw()


def turn_to_tab():
    """Select the tab, which exists only after the sidebar has been drawn."""
    for region in area().regions:
        if region.type == "UI":
            try:
                region.active_panel_category = "Spectral"
            except (AttributeError, TypeError) as error:
                facts.setdefault("tab", str(error))
    area().tag_redraw()


def picture(name):
    path = OUT / f"{bpy.app.version_string.split()[0]}_{name}.png"
    subprocess.run(["import", "-window", "root", str(path)], check=False)
    facts["pictures"].append(path.name)


def palette():
    return bpy.context.scene.spectral.palette


def alternatives():
    bpy.ops.spectral.palette_preset(preset="SPLIT_LIGHT")
    bpy.ops.spectral.palette_solve()
    yield 1.0
    palette().alternative_count = 3
    bpy.ops.spectral.palette_alternatives()
    palette().materials[1].locked = True
    yield from shown("alternatives", "palette_view", "palette_alternatives_view")
    bpy.ops.spectral.palette_alternative_take(index=1)
    yield from shown("alternative_taken", "palette_view", "palette_alternatives_view")


def paint():
    bpy.ops.spectral.palette_preset(preset="METAMER_PAIR")
    palette().use_tints = True
    bpy.ops.spectral.palette_solve()
    yield 1.0
    yield from shown("tints", "palette_view", "palette_paint_view")
    palette().use_tints = False
    bpy.ops.spectral.palette_dye(index=-1)
    bpy.ops.spectral.palette_solve()
    yield 1.0
    yield from shown("dyes", "palette_view", "palette_paint_view")
    bpy.ops.spectral.palette_dye(index=0)


def possible():
    bpy.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    palette().materials[0].cells[1].target = (0.0, 1.0, 0.0)
    palette().materials[0].cells[1].mode = "FIXED"
    bpy.ops.spectral.palette_solve()
    bpy.ops.spectral.palette_select(row=0, column=1)
    yield 1.0
    bpy.ops.spectral.palette_possible()
    yield from shown("possible", "palette_view", "palette_cell_view")


def targets():
    """The pictures of docs/pictures/palette_targets.png, from left to right."""
    yield from shown("targets_1", "palette_view")
    for number, preset, cell, panel in (
        (2, "METAMER_PAIR", (1, 1), "cell"), (3, "COLOR_CONSTANCY", (0, 1), "light"), (4, "", (0, 1), "weights"),
    ):  # fmt: skip
        if preset:
            bpy.ops.spectral.palette_preset(preset=preset)
            for row in palette().materials:
                row.material = bpy.data.materials.new(row.name)
        if preset == "METAMER_PAIR":
            bpy.ops.spectral.palette_solve()
            bpy.ops.spectral.palette_apply()
        elif preset:
            palette().lights[1].light = bpy.data.lights["First"]
        bpy.ops.spectral.palette_select(row=cell[0], column=cell[1])
        yield 3.0
        yield from shown(f"targets_{number}", "palette_view", f"palette_{panel}_view")


def recipe():
    found = bpy.context.scene.spectral.recipe
    for kind in ("LAMP", "PAINTS"):
        found.kind = kind
        if kind != "LAMP":
            found.wanted = "NAMED"
            found.surface = "dark skin"
        bpy.ops.spectral.recipe_find()
        yield from shown(f"recipe_{kind.lower()}", "recipe")


def texture(kind):
    design = bpy.context.scene.spectral.texture
    design.kind, design.folder = kind, str(OUT / f"texture_{kind.lower()}")
    design.first, design.second = (bpy.data.images.load(path, check_existing=True) for path in IMAGES)
    if kind == "ONE":
        for light, name in ((design.light_1, "D65"), (design.light_2, "HP1")):
            light.spectral.source, light.spectral.catalogue_name = "CATALOGUE", name
        bpy.ops.spectral.texture_wanted_color(index=-1)
    yield from shown(f"texture_{kind.lower()}_before", "texture")
    bpy.ops.spectral.texture_design()
    yield 0.7
    picture(f"texture_{kind.lower()}_running")
    start = time.monotonic()
    while texture_job.running() and time.monotonic() - start < PATIENCE_S:
        yield 0.5
    design = bpy.context.scene.spectral.texture
    facts[kind] = {"status": design.status, "report": design.report.splitlines()}
    plane = bpy.data.objects["Plane"]
    bpy.context.view_layer.objects.active = plane
    plane.select_set(True)
    design.lamp_1, design.lamp_2 = bpy.data.lights["First"], bpy.data.lights["Second"]
    with in_view():
        facts[kind]["material"] = list(bpy.ops.spectral.texture_material())
        facts[kind]["lights"] = list(bpy.ops.spectral.texture_lights())
    yield from shown(f"texture_{kind.lower()}", "texture")
    for number, lamp in enumerate(("First", "Second"), start=1):
        for name in ("First", "Second"):
            bpy.data.objects[name].hide_viewport = bpy.data.objects[name].hide_render = name != lamp
        area().spaces.active.shading.type = "RENDERED"
        yield 2.0
        start = time.monotonic()
        while not settled() and time.monotonic() - start < PATIENCE_S:
            yield 0.5
        yield 1.5
        picture(f"texture_{kind.lower()}_light_{number}")
    area().spaces.active.shading.type = "SOLID"


def settled():
    views = list(jobs.live()._views.values())
    return bool(views) and all(
        view.shown is not None and view.shown.frame.is_done
        and view.shown.frame.generation >= view.request.generation for view in views
    )  # fmt: skip


def shown(name, *panels):
    area().spaces.active.show_region_ui = True
    only_panels(*(f"SPECTRAL_PT_{each}" for each in panels))
    yield 1.0
    turn_to_tab()
    yield 2.5
    picture(name)


def gallery():
    """A plane that faces the camera, under two suns."""
    for block in list(bpy.data.objects):
        bpy.data.objects.remove(block)
    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL"
    scene.spectral.viewport.samples = 4
    scene.world.color = (0, 0, 0)
    with in_view():
        bpy.ops.mesh.primitive_plane_add(size=2)
    for name in ("First", "Second"):
        lamp = bpy.data.objects.new(name, bpy.data.lights.new(name, "SUN"))
        lamp.data.energy, lamp.location = 3.0, (0, 0, 3)
        scene.collection.objects.link(lamp)
    region = area().spaces.active.region_3d
    region.view_rotation, region.view_distance = (1, 0, 0, 0), 4.0
    region.view_location, region.view_perspective = (0.4, 0, 0), "ORTHO"


STEPS = {
    "targets": targets, "alternatives": alternatives, "paint": paint, "possible": possible, "recipe": recipe,
    "two": lambda: texture("TWO"), "one": lambda: texture("ONE"),
}  # fmt: skip


def drive():
    yield 1.0
    full()
    yield 1.0
    gallery()
    yield 1.0
    for name, step in STEPS.items():
        if not ONLY or name in ONLY:
            print("STEP", name, flush=True)
            try:
                yield from step()
            except Exception:
                facts["errors"].append(f"{name}: {traceback.format_exc()}")


steps = drive()


def tick():
    try:
        return next(steps)
    except StopIteration:
        pass
    except Exception:
        facts["errors"].append(traceback.format_exc())
    print("RESULT " + json.dumps(facts, ensure_ascii=False), flush=True)
    bpy.ops.wm.quit_blender()
    return None


bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
