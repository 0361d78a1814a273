# SPDX-License-Identifier: GPL-3.0-or-later
# ruff: noqa: E402
"""Runs inside a Blender with a window: Record and Load as buttons, Esc, an error, and what they leave behind."""

import os
import sys
from pathlib import Path

sys.path[:0] = [path for path in os.environ.get("SPECTRAL_PATHS", "").split(os.pathsep) if path]

import bpy

import blender_addon
from benchmarks.viewport.window import inside
from blender_addon import jobs
from blender_addon.editing.dial import changes, saving
from blender_addon.operators.dial import SPECTRAL_OT_dial_save
from blender_addon.operators.dial_record import SPECTRAL_OT_dial_record
from blender_addon.translate.display import transform as view_transform

blender_addon.register_once()
bpy.context.preferences.view.show_splash = False
told: dict = {"reports": [], "here": []}


def noted(kind):
    """Remember results of an operator: those of its ``refused``, and of its ``end``."""
    refused, end = kind.refused, kind.end

    def on_refused(self, error):
        told["reports"].append(str(error))
        return refused(self, error)

    def on_end(self, scene, answer):
        told["reports"].append("recorded")
        return end(self, scene, answer)

    kind.refused, kind.end = on_refused, on_end


def counted(owner, name):
    """Remember calls of a function whose work a second Blender does."""
    function = getattr(owner, name)

    def called(*arguments):
        told["here"].append(name)
        return function(*arguments)

    setattr(owner, name, called)


noted(SPECTRAL_OT_dial_record)
counted(saving, "write_pixels")
counted(saving, "write_picture")
counted(view_transform, "shown_pixels")
SPECTRAL_OT_dial_save.invoke = lambda self, context, _event: self.start(context)  # the browser cannot be driven


def dial():
    return bpy.context.scene.spectral.dial


def pressed(name, **values):
    with inside.in_view():
        return sorted(getattr(bpy.ops.spectral, name)("INVOKE_DEFAULT", **values))


def running():
    names = {each.bl_idname for each in bpy.context.window.modal_operators}
    ours = {"SPECTRAL_OT_dial_record", "SPECTRAL_OT_dial_load", "SPECTRAL_OT_plan", "SPECTRAL_OT_dial_save"}
    return bool(names & {*ours, "SCREEN_OT_render", "RENDER_OT_render"})


def left():
    """What must be as before."""
    preferences = bpy.context.preferences.view.render_display_type
    render = bpy.context.scene.render
    own = [render.engine, render.use_compositing, render.use_sequencer]
    own += [each.use for each in bpy.context.scene.view_layers]
    return [*own, preferences, jobs.current_request().translated is None]


def drive():
    yield 1.0
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.spectral.render.samples = 96, 54, 2
    scene.view_layers.new("Second")  # the window shows the first one
    told["before"] = left()
    told["pressed"] = pressed("dial_record")
    told["twice"] = _refused()
    yield 0.5
    yield from inside.until(lambda: not running(), 120, "the recording")
    yield 0.5
    told["recorded"] = [bool(dial().scene_hash), len(dial().bulbs), "Light Dial" in bpy.data.images, left()]
    changes.compare(scene)
    told["changes"] = dial().changes
    facts, dial().facts = dial().facts, "unchanged"
    scene.spectral.render.samples = 1 << 14  # a recording that is over before Esc comes cannot be stopped
    pressed("dial_record")
    yield 0.3
    _esc()
    yield from inside.until(lambda: not running(), 120, "the end after Esc")
    scene.spectral.render.samples = 2
    yield 0.3
    told["stopped"] = [dial().facts, left()]
    dial().facts = facts
    camera = scene.camera
    scene.camera = None
    bpy.context.collection.objects.unlink(camera)
    told["refused"] = _refused()
    yield from inside.until(lambda: not running(), 60, "the end without a camera")
    told["after an error"] = left()
    bpy.context.collection.objects.link(camera)
    scene.camera = camera
    bpy.data.objects["Light"].data.energy *= 2
    yield 0.3
    pressed("dial_record", only_changed=True)
    yield from inside.until(lambda: not running(), 120, "the second recording")
    yield 1.5
    told["again"] = [dial().changes, left()]
    pressed("plan")
    told["plan"] = [_refused()]
    yield from inside.until(lambda: not running(), 120, "the plan")
    yield 0.3
    told["plan"] += [len(scene.spectral.render.plan) > 5, left()]
    told["file"] = Path(bpy.app.tempdir, "light_dial.transport.exr").is_file()
    yield from saved(scene)


def saved(scene):
    """The picture of four frames, saved as after the file browser; then one picture by a script, for comparison."""
    folder = Path(bpy.app.tempdir)
    scene.frame_start, scene.frame_end = 3, 6
    pressed("dial_save", filepath=str(folder / "walk_.png"), animation=True)
    yield 0.05
    told["during"] = scene.frame_current, running()
    yield from inside.until(lambda: not running(), 120, "the pictures")
    told["walk"] = [(folder / f"walk_{number:04d}.png").is_file() for number in range(2, 8)]
    told["frame"] = scene.frame_current
    bpy.ops.spectral.dial_save(filepath=str(folder / "here.png"))
    told["same"] = (folder / "here.png").read_bytes() == (folder / "walk_0005.png").read_bytes()
    scene.frame_end = 400
    pressed("dial_save", filepath=str(folder / "long_.png"), animation=True)
    yield 2.0
    _esc()
    yield from inside.until(lambda: not running(), 60, "the end of the pictures after Esc")
    told["long"] = [scene.frame_current, len(list(folder.glob("long_*.png"))) < 300]


def _esc():
    window = bpy.context.window_manager.windows[0]
    for value in ("PRESS", "RELEASE"):
        window.event_simulate(type="ESC", value=value, x=300, y=300)


def _refused():
    try:
        return pressed("dial_record")
    except RuntimeError as error:
        return str(error)


inside.drive(drive(), told)
