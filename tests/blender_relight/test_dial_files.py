# SPDX-License-Identifier: GPL-3.0-or-later
"""The file of a recording when the .blend is saved elsewhere, has several scenes, or loses a light meanwhile."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.editing.dial import live  # noqa: E402
from blender_addon.editing.dial.paths import transport_path  # noqa: E402


def shown(scene):
    """The picture of the dial's present mix."""
    image = live.show(scene)
    pixels = np.empty(4 * image.size[0] * image.size[1], np.float32)
    image.pixels.foreach_get(pixels)
    return pixels


def test_a_recording_follows_the_file_to_another_name(stage, dial, tmp_path):
    old, before = transport_path(dial), shown(stage)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "later.blend"))
    new = transport_path(dial)
    assert new != old and new.read_bytes() == old.read_bytes()
    live._sessions.clear()
    np.testing.assert_array_equal(shown(stage), before)


def test_a_recording_in_memory_is_used_while_its_file_is_missing(stage, dial, tmp_path):
    before = shown(stage)
    transport_path(dial).unlink()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "later.blend"))
    np.testing.assert_array_equal(shown(stage), before)
    assert bpy.ops.spectral.dial_keep(filepath=str(tmp_path / "kept.exr")) == {"FINISHED"}
    assert (tmp_path / "kept.exr").is_file()


def test_a_recording_of_an_unsaved_file_is_kept_when_it_is_saved(stage, tmp_path):
    bpy.ops.wm.read_homefile(use_empty=False, use_factory_startup=True)
    scene = bpy.context.scene
    scene.render.engine, scene.spectral.render.samples = "SPECTRAL", 4
    scene.render.resolution_x, scene.render.resolution_y = 16, 12
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    before = shown(scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "first.blend"))
    assert transport_path(scene.spectral.dial).parent == tmp_path
    live._sessions.clear()
    np.testing.assert_array_equal(shown(scene), before)


def test_a_recording_that_cannot_be_copied_is_named(stage, dial, tmp_path, monkeypatch):
    from blender_addon.editing.dial import paths

    def full(*_paths):
        raise OSError("no space left on device")

    monkeypatch.setattr(paths.shutil, "copyfile", full)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "later.blend"))
    assert "could not be copied" in dial.message and "Save Transport" in dial.message
    assert not transport_path(dial).exists()


def test_recordings_of_two_scenes_are_two_files(stage, dial):
    first, before = transport_path(dial), shown(stage)
    bpy.ops.scene.new(type="FULL_COPY")
    other = bpy.context.scene
    assert other != stage
    other.spectral.dial.scene_hash = ""
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    assert transport_path(other.spectral.dial) != first and transport_path(other.spectral.dial).is_file()
    live._sessions.clear()
    np.testing.assert_array_equal(shown(stage), before)


def test_a_light_that_is_deleted_while_it_is_recorded_does_not_lose_the_recording(stage, monkeypatch):
    from blender_addon.editing.dial.recording import Recording

    run = Recording.run

    def deleting(self):
        transport = run(self)
        bpy.data.objects.remove(bpy.data.objects["Fill"])
        return transport

    monkeypatch.setattr(Recording, "run", deleting)
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    bulbs = stage.spectral.dial.bulbs
    assert {bulb.name: len(bulb.members) for bulb in bulbs}["Fill"] == 0
    assert {bulb.name: len(bulb.members) for bulb in bulbs}["Key"] == 1
    assert shown(stage).any()
