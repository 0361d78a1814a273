# SPDX-License-Identifier: GPL-3.0-or-later
# ruff: noqa: E402
"""Runs inside a Blender with a window: the demo's vase in a split view, in daylight and under a sodium street lamp.

``blender --python vase_drive.py``; SPECTRAL_PATHS holds folders for sys.path (the checkout among them), SPECTRAL_OUT a
folder for what the demo's design writes. Blender's screenshots of a hidden window are black, so the
picture is taken of the screen. This takes minutes until the kernels are compiled. With SPECTRAL_STAY the window stays
open.
"""

import os
import sys
import time
import traceback
from pathlib import Path

sys.path[:0] = [path for path in os.environ.get("SPECTRAL_PATHS", "").split(os.pathsep) if path]

import bpy
import numpy as np

import blender_addon
from blender_addon import jobs
from examples.demo import run as demo
from examples.demo import still_life

OUT = Path(os.environ.get("SPECTRAL_OUT", "/tmp"))
SAMPLES = int(os.environ.get("SPECTRAL_SAMPLES", "32"))
PATIENCE_S = float(os.environ.get("SPECTRAL_PATIENCE", "1500"))

blender_addon.register_once()
bpy.context.preferences.view.show_splash = False


def build():
    for block in (*bpy.data.objects, *bpy.data.materials, *bpy.data.lights, *bpy.data.worlds):
        bpy.data.batch_remove([block])
    still_life.build(bpy)
    demo._design(bpy, OUT)
    demo._prepare(bpy, 48, 100)
    demo._switch_on(bpy, demo.LIGHTS[0])


def look():
    scene = bpy.context.scene
    settings = scene.spectral.viewport
    settings.samples, settings.is_split, settings.divider = SAMPLES, True, 0.577  # through the vase
    for side, light in zip((settings.look, settings.other), demo.LIGHTS, strict=True):
        side.kind, side.lamp = "LAMP", light.name
        side.exposure = float(np.log2(light.exposure))
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    space = area.spaces.active
    space.region_3d.view_perspective = "CAMERA"
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.screen.screen_full_area(use_hide_panels=True)
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    space = area.spaces.active
    region = next(region for region in area.regions if region.type == "WINDOW")
    space.region_3d.view_perspective = "CAMERA"
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.view3d.view_center_camera()
    space.show_region_header = space.show_region_toolbar = space.show_region_ui = False
    space.overlay.show_overlays = False
    space.show_gizmo = False
    space.shading.type = "RENDERED"


def settled():
    views = list(jobs.live()._views.values())
    shown = [view.shown for view in views if view.shown is not None]
    print("VIEW", [(s.frame.level, s.frame.samples, round(s.frame.seconds)) for s in shown],
          [view.trouble for view in views], flush=True)  # fmt: skip
    return len(shown) == 2 and all(each.frame.is_done for each in shown)


def drive():
    yield 1.0
    build()
    yield 1.0
    look()
    start = time.monotonic()
    while not settled() and time.monotonic() - start < PATIENCE_S:
        yield 2.0
    print("RESULT settled in", round(time.monotonic() - start), "s", flush=True)


steps = drive()


def tick():
    try:
        return next(steps)
    except StopIteration:
        if os.environ.get("SPECTRAL_STAY"):
            return None
    except Exception:
        traceback.print_exc()
    bpy.ops.wm.quit_blender()
    return None


bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
