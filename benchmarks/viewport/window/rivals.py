# SPDX-License-Identifier: GPL-3.0-or-later
# ruff: noqa: E402
"""Runs inside a Blender with a window, for ``viewport-against-cycles``: both engines in Rendered mode, edit by edit."""

import json
import os
import sys
import time
import traceback
from pathlib import Path

sys.path[:0] = [path for path in os.environ.get("SPECTRAL_PATHS", "").split(os.pathsep) if path]

import bpy

import blender_addon
from benchmarks.render.cases.cycles_scenes import SCENES
from benchmarks.render.render_against_cycles import BOUNCES, figures_of
from blender_addon import jobs

blender_addon.register_once()
bpy.context.preferences.view.show_splash = False
SETTINGS = json.loads(os.environ["SPECTRAL_SETTINGS"])
SAMPLES, F12_SIZE, MANY = SETTINGS["samples"], (96, 54), SETTINGS["many"]
REST_S = 1.5
"""Cycles has ended where its threads have done nothing for so long."""
PATIENCE_S = 240.0
TICK = os.sysconf("SC_CLK_TCK")
told: dict = {"version": bpy.app.version_string, "samples": SAMPLES, "scenes": {}, "errors": [], "size": (0, 0)}


def area():
    return next(each for each in bpy.context.window_manager.windows[0].screen.areas if each.type == "VIEW_3D")


def in_view():
    found = area()
    region = next(each for each in found.regions if each.type == "WINDOW")
    return bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=found, region=region)


def seconds_of(folder):
    """Processor time of a process or thread, from its folder in /proc; 0 where it has ended."""
    try:
        words = (folder / "stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(words[11]) + int(words[12])) / TICK


def cycles_work():
    """Of Blender's threads but the main one and those of software OpenGL."""
    total = 0.0
    for thread in Path("/proc/self/task").iterdir():
        try:
            name = (thread / "comm").read_text().strip()
        except OSError:
            continue
        if int(thread.name) != os.getpid() and not name.startswith(("llvmpipe", "blender:disk", "blender:sh")):
            total += seconds_of(thread)
    return total


def our_work():
    number = jobs.live().process_id
    return 0.0 if number is None else seconds_of(Path(f"/proc/{number}"))


def our_picture_is_done():
    views = list(jobs.live()._views.values())
    return bool(views) and all(
        view.shown is not None and view.shown.frame.is_done
        and view.shown.frame.generation >= view.request.generation for view in views
    )  # fmt: skip


def prepare(name):
    for block in (*bpy.data.objects, *bpy.data.materials, *bpy.data.lights, *bpy.data.worlds, *bpy.data.meshes):
        bpy.data.batch_remove([block])
    scene, cycles = bpy.context.scene, bpy.context.scene.cycles
    scene.world = None
    scene.render.resolution_x, scene.render.resolution_y = F12_SIZE
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.use_preview_denoising = cycles.use_preview_adaptive_sampling = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = cycles.light_sampling_threshold = 0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = BOUNCES
    cycles.volume_bounces, cycles.sampling_pattern = BOUNCES, "TABULATED_SOBOL"
    cycles.preview_samples = scene.spectral.viewport.samples = SAMPLES
    scene.render.preview_pixel_size = "1"
    with in_view():
        SCENES[name]()
        space = area().spaces.active
        space.overlay.show_overlays = space.show_gizmo = False
        space.region_3d.view_perspective = "CAMERA"
        bpy.ops.view3d.view_center_camera()


def edit():
    """A number of a material's first shader."""
    material = next(each for each in bpy.data.materials if each.node_tree is not None)
    node = next(each for each in material.node_tree.nodes if each.inputs.get("Color") is not None)
    node.inputs["Color"].default_value[0] *= 0.99


def shown(engine):
    """Wait until the view rests; work and seconds since the edit."""
    meter, start = (our_work, cycles_work)[engine == "CYCLES"], time.perf_counter()
    before = meter()
    end, last, latest = start, before, start
    while True:
        yield 0.05
        now = time.perf_counter()
        if now - start > PATIENCE_S:
            raise TimeoutError(f"{engine}: the view did not rest within {PATIENCE_S:g} s")
        if engine == "SPECTRAL":
            if our_picture_is_done():
                return meter() - before, now - start
            continue
        spent = meter()
        if spent - last > 0.03:
            last, latest, end = spent, now, now
        elif now - latest > REST_S and spent - before > 0.1:
            return spent - before, end - start


def measured(engine):
    scene = bpy.context.scene
    scene.render.engine = engine
    area().spaces.active.shading.type = "RENDERED"
    yield 0.5
    try:
        yield from shown(engine)
        found: dict = {"work": [], "wall": []}
        for number in range(SETTINGS["rounds"] + 1):
            edit()
            work, wall = yield from shown(engine)
            if number:  # the first may compile
                found["work"].append(work)
                found["wall"].append(wall)
    finally:
        area().spaces.active.shading.type = "SOLID"
    yield 1.0
    _, error, mean = figures_of(engine, SAMPLES, MANY, denoised=False)
    return found | {"error": error, "mean": mean}


def drive():
    yield 1.0
    with in_view():
        bpy.ops.screen.screen_full_area(use_hide_panels=True)
    yield 1.0
    area().spaces.active.show_region_header = False
    area().spaces.active.show_region_toolbar = area().spaces.active.show_region_ui = False
    yield 1.0
    region = next(each for each in area().regions if each.type == "WINDOW")
    told["size"] = (region.width, region.height)
    for name in SETTINGS["scenes"]:
        prepare(name)
        yield 0.5
        found = {}
        for engine in ("CYCLES", "SPECTRAL"):
            found[engine] = yield from measured(engine)
            print("MEASURED", name, engine, found[engine], file=sys.stderr, flush=True)
        told["scenes"][name] = found


steps = drive()


def tick():
    try:
        return next(steps)
    except StopIteration:
        pass
    except Exception:
        told["errors"].append(traceback.format_exc())
    print("RESULT " + json.dumps(told), flush=True)  # also the measurements before a failure
    bpy.ops.wm.quit_blender()
    return None


bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
