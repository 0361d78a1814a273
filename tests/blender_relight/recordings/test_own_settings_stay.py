# SPDX-License-Identifier: GPL-3.0-or-later
"""While the extension reads a scene, the artist edits, saves and undoes: the scene's own render settings stay."""

from __future__ import annotations

import threading
import time
from types import SimpleNamespace

import pytest

pytest.importorskip("bpy")

import bpy

from blender_addon.editing.dial.as_rendered import AsRendered
from blender_addon.operators import dial_record
from blender_addon.operators.dial_record import _Translating
from spectral_core.errors import InvalidInputError, RenderCancelled


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


def test_settings_that_the_artist_changes_while_the_scene_is_read_stay(own):
    """The engine was set back to that of before, and so were view layers."""
    reading = AsRendered(bpy.context, at_once=True)
    scene = bpy.context.scene
    scene.render.engine, scene.view_layers["Unused"].use = "BLENDER_WORKBENCH", True
    reading.take()
    assert settings() == ("BLENDER_WORKBENCH", *own[1:3], [(name, True) for name, _ in own[3]])


def moved():
    bpy.data.objects["Key"].location.x += 1


def brightened():
    bpy.data.lights["Key"].energy *= 3


def deleted():
    bpy.data.objects.remove(bpy.data.objects["Key"])


def another_surface():
    bpy.data.materials[0].node_tree.nodes[0].location.x += 1  # without effect on the picture, which Blender cannot know
    bpy.data.materials[0].node_tree.update_tag()


@pytest.mark.parametrize("edit", [moved, brightened, deleted, another_surface])
def test_an_edit_after_the_scene_was_read_is_noticed(own, edit):
    """Record kept the earlier scene with the powers of the present one, which Apply multiplied, and named no change."""
    bpy.data.objects["Fill"].location.x += 1  # this one is read
    reading = AsRendered(bpy.context, at_once=True)
    bpy.context.view_layer.update()
    assert reading.edited_at is None
    edit()
    bpy.context.view_layer.update()
    assert reading.edited_at is not None
    reading.leave()


def recording_of(scene, edited_at):
    """The operator Record after it has read a scene that was edited then."""
    operator = _Translating()
    operator._uid, operator.stopping = scene.session_uid, threading.Event()
    operator._asked = SimpleNamespace(is_running=False, has_scene=True, edited_at=edited_at)
    return operator


def test_record_reads_an_edited_scene_again_when_the_artist_rests(stage, monkeypatch):
    again = SimpleNamespace(is_running=False, has_scene=True, edited_at=None)
    monkeypatch.setattr(dial_record, "AsRendered", lambda context, at_once: again)
    operator = recording_of(stage, time.monotonic())
    assert not operator.is_prepared() and operator._asked is not again
    operator._asked.edited_at -= 2 * dial_record.REST_S
    assert not operator.is_prepared() and operator._asked is again
    assert operator.is_prepared()


def wider():
    bpy.context.scene.render.filter_size = 3.0


def smaller():
    bpy.context.scene.render.resolution_percentage = 50


def with_fewer_bounces():
    bpy.context.scene.cycles.max_bounces = 2


def under_another_look():
    bpy.context.scene.spectral.viewport.look.kind = "LAMP"


def through_another_camera():
    bpy.context.scene.camera = bpy.data.objects.new("Other", bpy.data.cameras.new("Other"))


def without_world():
    bpy.context.scene.world = None


SETTINGS = [wider, smaller, with_fewer_bounces, under_another_look, through_another_camera, without_world]


@pytest.mark.parametrize("edit", SETTINGS)
def test_record_reads_a_scene_again_whose_settings_were_edited(stage, monkeypatch, edit):
    """The scene was recorded with the earlier settings, and Compare took the new ones for those of the recording."""
    operator = _Translating()
    operator.stopping = threading.Event()
    operator.prepare(bpy.context, at_once=True)
    try:
        assert not operator._waits_for_rest()
        edit()
        assert operator._waits_for_rest()
        again = SimpleNamespace(is_running=False, has_scene=True, edited_at=None, leave=lambda: None)
        operator._set_at -= 2 * dial_record.REST_S
        operator._asked.leave()
        monkeypatch.setattr(dial_record, "AsRendered", lambda context, at_once: again)
        assert operator._waits_for_rest() and operator._asked is again
        assert not operator._waits_for_rest()
    finally:
        operator.leave()


def test_record_names_what_an_edit_has_made_impossible(stage, monkeypatch):
    def refuse(context, at_once):
        raise InvalidInputError("no camera")

    monkeypatch.setattr(dial_record, "AsRendered", refuse)
    operator = recording_of(stage, time.monotonic() - 2 * dial_record.REST_S)
    assert not operator.is_prepared()
    assert operator.is_prepared()
    with pytest.raises(InvalidInputError, match="no camera"):
        operator.read(bpy.context)


@pytest.mark.parametrize("copy", [True, False])
def test_a_file_saved_while_the_scene_is_read_gets_its_own_settings_when_it_is_opened(own, tmp_path, copy):
    """Nothing is written before the save: Blender may save by itself, which calls no handler, and a render reads."""
    path = str(tmp_path / "meanwhile.blend")
    reading = AsRendered(bpy.context, at_once=True)
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=copy)
    reading.take()
    assert settings() == own
    bpy.ops.wm.open_mainfile(filepath=path)
    assert settings() == own
    assert bpy.context.scene.spectral.render.own_settings == ""


def test_a_reading_that_blender_ends_is_no_missing_camera(stage, monkeypatch):
    monkeypatch.setattr(
        "blender_addon.editing.dial.as_rendered._start_job", lambda _name: None
    )  # the job ends at once, as after Esc
    with pytest.raises(RenderCancelled, match="press the button again"):
        AsRendered(bpy.context, at_once=False).take()


def test_the_extension_is_disabled_while_it_reads_a_scene(own):
    """Its engine is removed first, and Blender refuses the name of an engine that is not registered."""
    from blender_addon.engine import SpectralRenderEngine

    bpy.context.scene.render.engine = "SPECTRAL"
    before = settings()
    reading = AsRendered(bpy.context, at_once=True)
    assert settings() != before
    bpy.utils.unregister_class(SpectralRenderEngine)
    try:
        reading.leave()
    finally:
        bpy.utils.register_class(SpectralRenderEngine)
    assert settings() == before
