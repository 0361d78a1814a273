# SPDX-License-Identifier: GPL-3.0-or-later
"""Recordings of several scenes of one .blend: each has its own file."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

from blender_addon.editing.dial import kept_mix  # noqa: E402
from blender_addon.editing.dial.paths import transport_path  # noqa: E402
from tests.blender_relight.dial.test_dial_files import shown  # noqa: E402

pytestmark = pytest.mark.usefixtures("without_rays")


def test_recordings_of_two_scenes_are_two_files(stage, dial):
    first, before = transport_path(dial), shown(stage)
    bpy.ops.scene.new(type="FULL_COPY")
    other = bpy.context.scene
    assert other != stage
    other.spectral.dial.scene_hash = ""
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    assert transport_path(other.spectral.dial) != first and transport_path(other.spectral.dial).is_file()
    kept_mix._sessions.clear()
    np.testing.assert_array_equal(shown(stage), before)


def test_two_scenes_that_are_recorded_at_once_have_two_files(stage, monkeypatch):
    """Two windows show them: the second recording was written over the first, of which only its bulbs were left."""
    from blender_addon.editing.dial.recording import Recording

    run = Recording.run

    def run_both(self):
        monkeypatch.setattr(Recording, "run", run)
        bpy.ops.scene.new(type="FULL_COPY")
        next(each for each in bpy.context.scene.objects if each.type == "LIGHT").location.x += 1
        assert bpy.ops.spectral.dial_record() == {"FINISHED"}
        bpy.context.window.scene = stage
        return run(self)

    monkeypatch.setattr(Recording, "run", run_both)
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    assert len({transport_path(scene.spectral.dial) for scene in bpy.data.scenes}) == 2
    pictures = [shown(scene) for scene in bpy.data.scenes]
    kept_mix._sessions.clear()
    for scene, before in zip(bpy.data.scenes, pictures, strict=True):
        np.testing.assert_array_equal(shown(scene), before)


def test_a_chosen_file_with_the_recording_of_another_scene_is_not_overwritten(stage, dial, tmp_path):
    assert bpy.ops.spectral.dial_keep(filepath=str(tmp_path / "kept.exr")) == {"FINISHED"}
    before = shown(stage)
    bpy.ops.scene.new(type="FULL_COPY")
    next(each for each in bpy.context.scene.objects if each.type == "LIGHT").location.x += 1
    with pytest.raises(RuntimeError, match="kept.exr has the recording of the scene 'Scene'; choose another File"):
        bpy.ops.spectral.dial_record()
    kept_mix._sessions.clear()
    np.testing.assert_array_equal(shown(stage), before)
    bpy.context.scene.spectral.dial.filepath = ""
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
