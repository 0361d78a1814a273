# SPDX-License-Identifier: GPL-3.0-or-later
"""The file of a recording when the .blend is saved elsewhere, has several scenes, or loses a light meanwhile."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.editing.dial import kept_mix, live, recording  # noqa: E402
from blender_addon.editing.dial.paths import transport_path  # noqa: E402

pytestmark = pytest.mark.usefixtures("without_rays")


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
    kept_mix._sessions.clear()
    np.testing.assert_array_equal(shown(stage), before)


@pytest.mark.parametrize("is_saved", [True, False])
def test_a_recording_beside_the_file_by_a_chosen_name_follows_it(stage, tmp_path, is_saved):
    """It stayed in the earlier folder, or in that of the program for an unsaved file, and the new file lacked it."""
    if not is_saved:
        bpy.ops.wm.read_homefile(use_empty=False)
        stage = bpy.context.scene
        stage.render.engine, stage.render.resolution_x, stage.render.resolution_y = "SPECTRAL", 8, 8
        stage.spectral.render.samples = 2
    stage.spectral.dial.filepath = "//kept/räume.exr"
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    before = shown(stage)
    (tmp_path / "later").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "later" / "later.blend"), relative_remap=False)
    assert transport_path(stage.spectral.dial) == tmp_path / "later" / "kept" / "räume.exr"
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    np.testing.assert_array_equal(shown(bpy.context.scene), before)


def test_a_file_in_the_way_of_a_recording_that_follows_is_named(stage, tmp_path):
    stage.spectral.dial.filepath = "//chosen.exr"
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    (tmp_path / "later").mkdir()
    (tmp_path / "later" / "chosen.exr").write_text("other")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "later" / "later.blend"), relative_remap=False)
    assert "chosen.exr is another file" in stage.spectral.dial.message
    assert (tmp_path / "later" / "chosen.exr").read_text() == "other"


def test_a_path_of_the_current_folder_is_written(stage, dial, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert bpy.ops.spectral.dial_save(filepath="plain.png") == {"FINISHED"}
    assert (tmp_path / "plain.png").stat().st_size > 100


@pytest.mark.filterwarnings("ignore:.*does not support blend relative:RuntimeWarning")
def test_a_path_beside_an_unsaved_file_is_refused(_extension):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with pytest.raises(RuntimeError, match="//a.toml is beside the .blend file, which was never saved"):
        bpy.ops.spectral.palette_import(filepath="//a.toml")


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
    kept_mix._sessions.clear()
    np.testing.assert_array_equal(shown(scene), before)


def test_a_recording_that_cannot_be_copied_is_named(stage, dial, tmp_path, monkeypatch):
    from blender_addon.editing.dial import paths

    def full(*_paths):
        raise OSError("no space left on device")

    monkeypatch.setattr(paths.shutil, "copyfile", full)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "later.blend"))
    assert "could not be copied" in dial.message and "Save Transport" in dial.message
    assert not transport_path(dial).exists()


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


def test_a_recording_follows_a_file_that_is_saved_under_another_name_meanwhile(stage, tmp_path, monkeypatch):
    from blender_addon.editing.dial.recording import Recording

    run = Recording.run

    def saving(self):
        transport = run(self)
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "meanwhile.blend"))
        return transport

    monkeypatch.setattr(Recording, "run", saving)
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    assert transport_path(stage.spectral.dial).name == "meanwhile.transport.exr"
    before = shown(stage)
    kept_mix._sessions.clear()
    np.testing.assert_array_equal(shown(stage), before)


def test_the_recording_of_the_earlier_name_stays_when_the_file_is_saved_under_another_one_meanwhile(stage, dial):
    """The thread writes its file where the dial looks for it at the end."""
    from blender_addon.operators.dial_record import _Translating

    operator = _Translating()
    operator._uid, operator._recording = stage.session_uid, SimpleNamespace(path=transport_path(dial))
    bpy.ops.wm.save_as_mainfile(filepath=bpy.data.filepath.replace("stage", "meanwhile"))
    operator.modal(bpy.context, SimpleNamespace(type="MOUSEMOVE"))
    assert operator._recording.path == transport_path(dial)
    assert operator._recording.path.name == "meanwhile.transport.exr"


def test_an_unreadable_recording_is_named_by_the_thread_that_reads_it(stage, dial):
    """Reading it once more on the main thread would stop the interface at each turn of the dial."""
    live._was_read(("", 0, 0), stage, live._read(transport_path(dial), "another"))
    assert "was recorded from another scene" in dial.message


def test_a_recording_is_not_exchanged_for_that_of_a_file_that_is_saved_over(stage, dial, tmp_path):
    """Save As over an older version, beside which its own recording lies."""
    first, before = transport_path(dial), shown(stage)
    older = tmp_path / "older.blend"
    older.with_suffix(".transport.exr").write_bytes(first.read_bytes()[:-7])
    bpy.ops.wm.save_as_mainfile(filepath=str(older))
    kept_mix._sessions.clear()
    np.testing.assert_array_equal(shown(stage), before)
    bpy.ops.wm.open_mainfile(filepath=str(older))
    np.testing.assert_array_equal(shown(bpy.context.scene), before)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "stage.blend"))
    kept_mix._sessions.clear()
    np.testing.assert_array_equal(shown(bpy.context.scene), before)


def test_a_saved_copy_leaves_the_open_file_its_recording(stage, dial, tmp_path):
    first = transport_path(dial)
    (tmp_path / "copy.transport.exr").write_bytes(b"another")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "copy.blend"), copy=True)
    assert transport_path(dial) == first
    (tmp_path / "blocked.transport.exr").write_bytes(b"another")
    (tmp_path / "blocked.blend").mkdir()
    with pytest.raises(RuntimeError, match=r"Cannot|cannot"):
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "blocked.blend"))
    assert transport_path(dial) == first


def test_an_undo_of_a_recording_does_not_show_it_with_the_powers_of_the_one_before(stage, dial):
    bpy.ops.ed.undo_push(message="recorded")
    bpy.data.lights["Key"].energy *= 3
    bpy.ops.ed.undo_push(message="brighter")
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="recorded again")
    again = shown(bpy.context.scene)
    bpy.ops.ed.undo()
    undone = bpy.context.scene
    with pytest.raises(Exception, match="was recorded from another scene, from this one before a change"):
        live.show(undone)
    bpy.ops.ed.redo()
    np.testing.assert_array_equal(shown(bpy.context.scene), again)


def test_a_file_of_another_type_is_refused_before_the_recording(stage, tmp_path, monkeypatch):
    """An EXR file was written as .png, which no program opened, and Load Transport did not offer."""
    monkeypatch.setattr(recording.Recording, "run", lambda _: pytest.fail("it was recorded"))
    stage.spectral.dial.filepath = "//picture.png"
    with pytest.raises(RuntimeError, match=r"picture\.png does not end in \.exr"):
        bpy.ops.spectral.dial_record()
    assert not (tmp_path / "picture.png").exists()


def test_transport_is_saved_as_exr_only(stage, dial, tmp_path):
    with pytest.raises(RuntimeError, match=r"keep\.png does not end in \.exr"):
        bpy.ops.spectral.dial_keep(filepath=str(tmp_path / "keep.png"))
    assert dial.filepath == "" and not (tmp_path / "keep.png").exists()


def test_a_recording_without_a_file_has_an_undo_step(stage, tmp_path, monkeypatch):
    """It is in memory, and its bulbs are in the dial: Blender makes a step only for operators that finish."""
    from blender_addon.editing.waiting import Waiting
    from blender_addon.operators.dial_record import SPECTRAL_OT_dial_record

    results, ended = [], Waiting._ended

    def noted(self, scene, answer):
        results.append(ended(self, scene, answer))
        return results[-1]

    monkeypatch.setattr(SPECTRAL_OT_dial_record, "_ended", noted, raising=False)
    (tmp_path / "file").write_text("no folder")
    stage.spectral.dial.filepath = str(tmp_path / "file" / "kept.exr")
    with pytest.raises(RuntimeError, match="The recording is in memory: write it elsewhere with Save Transport"):
        bpy.ops.spectral.dial_record()
    assert results == [{"FINISHED"}]
    assert len(stage.spectral.dial.bulbs) == 4 and shown(stage).any()


def test_an_undo_of_a_recording_of_other_bulbs_uncovers_the_camera_view(stage, dial):
    """The scene is the same, so its file was taken for that of the dial, and its picture stayed."""

    def covers():
        present = bpy.context.scene
        return [each.image for each in present.camera.data.background_images] == [present.spectral.dial.picture]

    bpy.ops.ed.undo_push(message="recorded")
    stage.spectral.dial.one_per_light = False
    bpy.ops.spectral.dial_record()
    bpy.ops.ed.undo_push(message="recorded in groups")
    assert covers()
    bpy.ops.ed.undo()
    present = bpy.context.scene.spectral.dial
    assert len(present.bulbs) == 4 and "record it again" in present.message
    assert not covers()
    bpy.ops.ed.redo()
    assert covers() and not bpy.context.scene.spectral.dial.message
