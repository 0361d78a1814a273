# SPDX-License-Identifier: GPL-3.0-or-later
# ruff: noqa: E402
"""Runs inside a Blender with a window: measures how long the extension blocks the interface during edits.

``blender --python stall_drive.py``; SPECTRAL_PATHS holds folders for sys.path. Every
call of Blender into the extension during edits is timed, in elapsed time and in processor time of the main thread. On a
machine with other work, only the processor time is the cost of the extension.
"""

import json
import os
import sys
import time
import traceback
from collections import defaultdict

sys.path[:0] = [path for path in os.environ.get("SPECTRAL_PATHS", "").split(os.pathsep) if path]

import bpy
import mathutils
import numpy as np

import blender_addon
from blender_addon import jobs, viewport
from blender_addon.editing.palette import live, possible

blender_addon.register()
bpy.context.preferences.view.show_splash = False
ROUNDS = int(os.environ.get("SPECTRAL_ROUNDS", "6"))
rng = np.random.default_rng(1)
spent: dict = defaultdict(list)
step = ["start"]
errors: list[str] = []


def timed(owner, name, label):
    function = getattr(owner, name)

    def call(*given):
        clock, work = time.perf_counter(), time.thread_time()
        try:
            return function(*given)
        except Exception:
            errors.append(traceback.format_exc(limit=3))
            raise
        finally:
            spent[label].append((1e3 * (time.perf_counter() - clock), 1e3 * (time.thread_time() - work), step[0]))

    setattr(owner, name, call)


timed(viewport.Viewport, "update", "view_update")
timed(viewport.Viewport, "draw", "view_draw")
timed(possible, "_collect", "possible")
timed(live.LIVE, "_follow", "solve while dragging")
timed(live.LIVE, "_finish", "solve at rest")


def view():
    area = next(each for each in bpy.context.window_manager.windows[0].screen.areas if each.type == "VIEW_3D")
    return area.spaces.active


def build():
    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL"
    scene.spectral.viewport.samples = 2
    bpy.ops.mesh.primitive_plane_add(size=12)
    for number in range(8):
        bpy.ops.mesh.primitive_uv_sphere_add(location=(number - 4, 1, 1), segments=100, ring_count=50)
        material = bpy.data.materials.new(f"Paint {number}")
        if material.node_tree is None:
            material.use_nodes = True
        bpy.context.object.data.materials.append(material)
    bpy.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    palette = scene.spectral.palette
    palette.materials[0].material = bpy.data.materials["Paint 0"]
    palette.materials[1].material = bpy.data.materials["Paint 1"]
    view().shading.type = "RENDERED"
    for object_ in list(bpy.data.objects):
        object_.select_set(False)


def shader(name):
    return next(node for node in bpy.data.materials[name].node_tree.nodes if node.type == "BSDF_PRINCIPLED").inputs


def reshape():
    mesh = bpy.data.objects["Sphere"].data
    mesh.vertices[int(rng.integers(100))].co.z += 0.02
    mesh.update()


def drag():
    cell = bpy.context.scene.spectral.palette.materials[0].cells[0]
    cell.mode, cell.target = "FIXED", rng.uniform(0.2, 0.8, 3)


STEPS = {
    "orbit": lambda: setattr(
        view().region_3d, "view_rotation", mathutils.Euler((1.1, 0, rng.uniform())).to_quaternion()
    ),
    "roughness": lambda: setattr(shader("Paint 3")["Roughness"], "default_value", rng.uniform(0.2, 0.8)),
    "lamp": lambda: setattr(bpy.data.lights["Light"], "energy", rng.uniform(500, 1500)),
    "move": lambda: setattr(bpy.data.objects["Sphere.002"], "location", (*rng.uniform(-2, 2, 2), 1)),
    "mesh": reshape,
    "wanted color": drag,
    "cell": lambda: bpy.ops.spectral.palette_select(row=int(rng.integers(2)), column=int(rng.integers(2))),
}


def drive():
    yield 1.0
    build()
    start = time.monotonic()
    while jobs.live().latest("view 1.0") is None and not any(v.shown for v in jobs.live()._views.values()):
        if time.monotonic() - start > 300:
            errors.append("no first picture")
            break
        yield 0.5
    step[0] = "first edits"  # the first of each kind may load or record
    for act in STEPS.values():
        act()
        yield 4.0
    for _ in range(ROUNDS):
        for name, act in STEPS.items():
            step[0] = name
            act()
            yield 1.5


steps = drive()


def tick():
    try:
        return next(steps)
    except StopIteration:
        pass
    except Exception:
        errors.append(traceback.format_exc())
    found = {}
    for label, times in spent.items():
        clock, work, names = zip(*times, strict=True)
        worst = int(np.argmax(work))
        found[label] = {"calls": len(times), "median_ms": round(float(np.median(clock)), 1),
                        "most_ms": round(max(clock), 1), "median_work_ms": round(float(np.median(work)), 1),
                        "most_work_ms": round(max(work), 1), "most_work_at": names[worst]}  # fmt: skip
    picture = bpy.context.scene.spectral.palette.picture
    print("RESULT " + json.dumps({"spent": found, "picture": picture, "errors": errors}), flush=True)
    bpy.ops.wm.quit_blender()
    return None


bpy.app.timers.register(tick, first_interval=1.0)
