# SPDX-License-Identifier: GPL-3.0-or-later
# ruff: noqa: E402
"""Runs inside a Blender with a window: a 3D view in Rendered mode, edits of each type, and the pictures after them.

``blender --python window_drive.py``; SPECTRAL_PATHS holds folders for sys.path, SPECTRAL_OUT a folder for pictures.
"""

import contextlib
import json
import os
import sys
import time
import traceback
from pathlib import Path

sys.path[:0] = [path for path in os.environ.get("SPECTRAL_PATHS", "").split(os.pathsep) if path]

import bpy
import mathutils
import numpy as np

import blender_addon
from blender_addon import jobs, viewport

blender_addon.register_once()
bpy.context.preferences.view.show_splash = False
OUT = Path(os.environ.get("SPECTRAL_OUT", "/tmp"))
PATIENCE_S = 60.0
facts: dict = {"version": bpy.app.version_string, "steps": {}}
errors: list[str] = []
draws: list[float] = []
drawn = viewport.Viewport.draw


def timed(self, engine, context, depsgraph):
    try:
        drawn(self, engine, context, depsgraph)
        draws.append(time.perf_counter())
    except Exception:
        errors.append(traceback.format_exc(limit=4))


viewport.Viewport.draw = timed


def view():
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    return window, area, area.spaces.active


def shown():
    """The newest picture of any view."""
    views = jobs.live()._views
    pictures = [kept.shown for kept in views.values() if kept.shown is not None]
    return max(pictures, key=lambda each: each.frame.generation) if pictures else None


def build():
    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL"
    scene.spectral.viewport.samples = 4
    bpy.data.objects["Cube"].location = (0, 0, 1)
    material = bpy.data.materials["Material"]
    material.use_nodes = True
    bpy.ops.mesh.primitive_plane_add(size=12)
    bpy.ops.mesh.primitive_uv_sphere_add(location=(2.5, 0, 1))
    floor = bpy.data.materials.new("Floor")
    floor.use_nodes = True
    bpy.data.objects["Plane"].data.materials.append(floor)
    bpy.data.lights["Light"].energy = 1000
    _, _, space = view()
    space.shading.type = "RENDERED"


def base():
    tree = bpy.data.materials["Material"].node_tree
    return next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED").inputs


def background():
    """The color of the world's nodes: its own color does nothing beside them."""
    tree = bpy.data.worlds[0].node_tree
    return next(node for node in tree.nodes if node.type == "BACKGROUND").inputs["Color"]


def camera_view():
    window, area, _ = view()
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.view3d.view_camera()


def orbit(kind):
    _, _, space = view()
    space.region_3d.view_perspective = kind
    space.region_3d.view_rotation = mathutils.Euler((1.1, 0, 0.4)).to_quaternion()


def kill():
    os.kill(jobs.live().process_id, 9)


def undo():
    window, area, _ = view()
    with bpy.context.temp_override(window=window, area=area):
        bpy.ops.ed.undo_push(message="before")
        bpy.data.objects["Cube"].location.x = 2
        bpy.ops.ed.undo_push(message="moved")
        bpy.ops.ed.undo()


STEPS = {
    "first": lambda: None,
    "color": lambda: setattr(base()["Base Color"], "default_value", (0.8, 0.1, 0.1, 1)),
    "roughness": lambda: setattr(base()["Roughness"], "default_value", 0.1),
    "lamp": lambda: setattr(bpy.data.lights["Light"], "energy", 3000),
    "world": lambda: setattr(background(), "default_value", (0.1, 0.1, 0.3, 1)),
    "move": lambda: setattr(bpy.data.objects["Cube"], "location", (-2, 1, 1.5)),
    "orbit": lambda: orbit("PERSP"),
    "orthographic": lambda: orbit("ORTHO"),
    "camera": camera_view,
    "hide": lambda: bpy.data.objects["Sphere"].hide_set(True),
    "show": lambda: bpy.data.objects["Sphere"].hide_set(False),
    "undo": undo,
    "killed": kill,
    "after": lambda: setattr(base()["Base Color"], "default_value", (0.1, 0.6, 0.1, 1)),
}


def save(name, picture):
    pixels = np.clip(picture.pixels[..., :3], 0, 1) ** (1 / 2.2)
    image = bpy.data.images.new(name, pixels.shape[1], pixels.shape[0])
    flat = np.ones((*pixels.shape[:2], 4), np.float32)
    flat[..., :3] = pixels
    image.pixels.foreach_set(flat.ravel())
    image.filepath_raw, image.file_format = str(OUT / f"view_{name.replace(' ', '_')}.png"), "PNG"
    with contextlib.suppress(RuntimeError):
        image.save()
    bpy.data.images.remove(image)


def drive():
    yield 1.0
    build()
    for name, step in STEPS.items():
        before = shown()
        count, start = len(draws), time.perf_counter()
        step()
        first = None
        while time.perf_counter() - start < PATIENCE_S:
            yield 0.02
            now = shown()
            is_new = now is not None and (before is None or now.frame.generation > before.frame.generation)
            if is_new and first is None:
                first = time.perf_counter() - start
            if is_new and now.frame.is_done:
                break
        else:
            if name != "killed":
                errors.append(f"{name}: the view never settled: {[v.trouble for v in jobs.live()._views.values()]}")
                print("STEP", errors[-1], len(draws), flush=True)
            continue
        facts["steps"][name] = {
            "first_ms": round(1e3 * first), "settled_ms": round(1e3 * (time.perf_counter() - start)),
            "draws": len(draws) - count, "how": now.frame.how, "mean": float(now.pixels[..., :3].mean()),
            "size": now.pixels.shape[:2],
        }  # fmt: skip
        print("STEP", name, facts["steps"][name], flush=True)
        save(name, now)
    facts["restarts"] = jobs.live().restarts


steps = drive()


def tick():
    try:
        return next(steps)
    except StopIteration:
        pass
    except Exception:
        errors.append(traceback.format_exc())
    facts["errors"] = errors
    print("RESULT " + json.dumps(facts), flush=True)
    if os.environ.get("SPECTRAL_STAY"):
        return None
    bpy.ops.wm.quit_blender()
    return None


bpy.app.timers.register(tick, first_interval=1.0)
