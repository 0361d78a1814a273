# SPDX-License-Identifier: GPL-3.0-or-later
"""While the extension reads a scene, the artist edits, saves and undoes: the scene's own render settings stay."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytest.importorskip("bpy")

import bpy

from blender_addon.editing.dial.as_rendered import SETTINGS, AsRendered
from spectral_core.errors import RenderCancelled

PRINT = (
    "import bpy; bpy.ops.wm.open_mainfile(filepath={path!r}); s = bpy.context.scene; "
    "print('FOUND', s.render.engine, s.render.use_compositing, s.render.use_sequencer, "
    "[(each.name, each.use) for each in s.view_layers])"
)


def settings():
    scene = bpy.context.scene
    render = scene.render
    layers = [(each.name, each.use) for each in scene.view_layers]
    return render.engine, render.use_compositing, render.use_sequencer, layers


@pytest.fixture
def own(stage):
    """The scene with settings that a reading changes, and an undo step of them."""
    stage.render.engine = "CYCLES"
    stage.view_layers.new("Second")
    stage.view_layers.new("Unused").use = False
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.ed.undo_push(message="before")
    return settings()


def test_a_step_of_undo_made_while_the_scene_is_read_has_its_own_settings(own):
    reading = AsRendered(bpy.context, at_once=True)
    assert settings() != own
    bpy.context.scene.frame_end = 77
    bpy.ops.ed.undo_push(message="edited meanwhile")
    reading.take()
    assert settings() == own
    bpy.context.scene.frame_end = 99
    bpy.ops.ed.undo_push(message="edited after")
    bpy.ops.ed.undo()
    assert bpy.context.scene.frame_end == 77, "this is the step that was made meanwhile"
    assert settings() == own
    bpy.ops.ed.redo()
    assert bpy.context.scene.frame_end == 99 and settings() == own


def test_an_undo_while_the_scene_is_read_leaves_its_own_settings(own):
    bpy.context.scene.frame_end = 78
    bpy.ops.ed.undo_push(message="edited")
    reading = AsRendered(bpy.context, at_once=True)
    bpy.ops.ed.undo()
    reading.leave()
    assert settings() == own


@pytest.mark.parametrize("copy", [True, False])
def test_a_file_saved_while_the_scene_is_read_has_its_own_settings(own, tmp_path, copy):
    path = str(tmp_path / "meanwhile.blend")
    reading = AsRendered(bpy.context, at_once=True)
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=copy)
    engine, composites, sequences, layers = settings()
    assert {"engine": engine, "use_compositing": composites, "use_sequencer": sequences} == SETTINGS
    assert sum(use for _, use in layers) == 1, "the reading goes on"
    reading.take()
    assert settings() == own
    # a Blender without the extension
    done = subprocess.run(
        [sys.executable, "-c", "import bpy; bpy.ops.wm.read_factory_settings(); " + PRINT.format(path=path)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert f"FOUND {own[0]} {own[1]} {own[2]} {own[3]}" in done.stdout, done.stdout + done.stderr


def test_a_file_that_blender_saved_by_itself_gets_its_own_settings_when_it_is_opened(own, tmp_path, monkeypatch):
    """Blender calls no handler before it saves for a recovery."""
    path = str(tmp_path / "recovered.blend")
    reading = AsRendered(bpy.context, at_once=True)
    for name in ("save_pre", "save_post"):
        handlers = getattr(bpy.app.handlers, name)
        kept = list(handlers)
        handlers.clear()
        monkeypatch.setattr(sys.modules[__name__], f"kept_{name}", kept, raising=False)
    try:
        bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    finally:
        for name in ("save_pre", "save_post"):
            getattr(bpy.app.handlers, name).extend(getattr(sys.modules[__name__], f"kept_{name}"))
    reading.take()
    bpy.ops.wm.open_mainfile(filepath=path)
    assert settings() == own


def test_a_reading_that_blender_ends_is_no_missing_camera(stage, monkeypatch):
    monkeypatch.setattr(
        "blender_addon.editing.dial.as_rendered._start_job", lambda _name: None
    )  # the job ends at once, as after Esc
    with pytest.raises(RenderCancelled, match="press the button again"):
        AsRendered(bpy.context, at_once=False).take()
