# SPDX-License-Identifier: GPL-3.0-or-later
# ruff: noqa: E402
"""Runs inside a Blender with a window, for ``viewport-latency``: from a dragged color to the redraw that shows it."""

import os
import sys
import time

sys.path[:0] = [path for path in os.environ.get("SPECTRAL_PATHS", "").split(os.pathsep) if path]

import bpy
import numpy as np

import blender_addon
from benchmarks.palette import palette_live
from benchmarks.viewport.window import inside

blender_addon.register_once()  # first, as in Blender: it prepares what the imports below load

from blender_addon.editing.dial import kept_mix
from blender_addon.editing.dial.picture import PICTURE
from blender_addon.editing.palette import live

bpy.context.preferences.view.show_splash = False
SETTINGS = inside.settings()
PATIENCE_S = 120.0
rng = np.random.default_rng(7)
told: dict = {"drags": {}}


def drags():
    """A wanted color is dragged over a recording of 31 bands; work of the extension, and of Blender.

    The camera view of a 3D view shows the re-lit picture, in Solid and in Rendered mode, then an image editor in the
    same area. The same editor is also redrawn without any change, and after a change of the scene that the extension
    ignores: a view in Solid mode reuses its last picture only as long as nothing has changed.
    """
    for block in (*bpy.data.objects, *bpy.data.materials, *bpy.data.lights, *bpy.data.meshes):
        bpy.data.batch_remove([block])
    width, height = (240, 135) if SETTINGS["quick"] else (960, 540)
    with inside.in_view():
        scene = palette_live.room(width, height)
        bpy.ops.spectral.dial_record("EXEC_DEFAULT")
    cell = palette_live.paper(scene)
    yield 2.0
    editor = inside.area()
    inside.space().shading.type = "SOLID"
    inside.space().region_3d.view_perspective = "CAMERA"
    yield from dragged(scene, cell, editor, "camera view in Solid mode")
    inside.space().shading.type = "RENDERED"
    yield 10.0  # its kernels compile
    yield from dragged(scene, cell, editor, "camera view in Rendered mode")
    editor.type = "IMAGE_EDITOR"
    editor.spaces.active.image = bpy.data.images[PICTURE]
    yield from dragged(scene, cell, editor, "image editor")


def dragged(scene, cell, editor, where):
    """Drags while ``editor`` shows the picture."""
    ends: list = []
    follow = live.LIVE._follow

    def followed(changed_scene):
        clock, work = time.perf_counter(), time.thread_time()
        follow(changed_scene)
        ended, worked = time.perf_counter(), time.thread_time() - work
        ends.append((ended, 1e3 * (ended - clock), 1e3 * worked, kept_mix.known_mix(changed_scene).is_coarse))

    live.LIVE._follow = followed
    shown: list = []
    draws = type(editor.spaces.active)
    handler = draws.draw_handler_add(lambda: shown.append(time.perf_counter()), (), "WINDOW", "POST_PIXEL")

    def drawn_after(moment):
        yield from inside.until(lambda: bool(shown) and shown[-1] > moment, PATIENCE_S, "a redraw")
        return next(t for t in shown if t > moment)

    def redrawn_alone():
        start = time.perf_counter()
        editor.tag_redraw()
        took = (yield from drawn_after(start)) - start
        yield 0.1
        return took

    found = told["drags"][where] = []
    for number in range(2 + SETTINGS["count"]):
        idle = yield from redrawn_alone()
        scene.update_tag()
        ignored = yield from redrawn_alone()
        ends.clear()
        start = time.perf_counter()
        cell.target = rng.uniform(0.2, 0.8, 3)
        yield from inside.until(lambda: bool(ends), PATIENCE_S, "a dragged color")
        solved, clock, work, is_coarse = ends[0]
        end = yield from drawn_after(solved)
        if number >= 2:  # the first loads the solver
            found.append({"ms": 1e3 * (solved - start), "clock_ms": clock, "work_ms": work,
                          "shown_ms": 1e3 * (end - start), "idle_ms": 1e3 * idle, "ignored_ms": 1e3 * ignored,
                          "coarse": is_coarse,
                          "relit": scene.spectral.palette.picture.startswith("Re-lit")})  # fmt: skip
        yield 0.7
    draws.draw_handler_remove(handler, "WINDOW")
    live.LIVE._follow = follow


def drive():
    yield 1.0
    yield from inside.only_the_view()
    yield from drags()


inside.drive(drive(), told)
