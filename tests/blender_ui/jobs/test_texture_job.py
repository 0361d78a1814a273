# SPDX-License-Identifier: GPL-3.0-or-later
"""A design of a texture when its scene is renamed or deleted, another file is opened, or the process ends by itself."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest

pytest.importorskip("bpy")
pytest.importorskip("OpenEXR")

import bpy

from blender_addon.editing import texture_job
from spectral_core.errors import InvalidInputError
from tests.blender_ui.panels.test_texture_panel import design, image  # noqa: F401 - a fixture

WORDS = "print('progress 0.25 solving colors', flush=True); import time; time.sleep(300)"


@pytest.fixture
def scene(design: Any, tmp_path: Any, monkeypatch: Any) -> Iterator[Any]:  # noqa: F811
    """A saved file whose design is a process that prints one line and waits."""
    design.first, _ = image(bpy, "first", 1)
    design.second, _ = image(bpy, "second", 2)
    for each in (design.first, design.second):
        each.pack()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    monkeypatch.setattr(texture_job.child, "command", lambda *_: [sys.executable, "-c", WORDS])
    yield bpy.context.scene
    texture_job._forget()
    if bpy.app.timers.is_registered(texture_job.tick):
        bpy.app.timers.unregister(texture_job.tick)


def started(scene: Any) -> Any:
    """The process of a new design, which has printed its line."""
    texture_job.start(scene)
    job = texture_job._job
    assert job is not None
    while not job.lines() and job.process.poll() is None:
        time.sleep(0.01)
    return job.process


def test_the_progress_of_a_renamed_scene_is_updated(scene: Any) -> None:
    started(scene)
    scene.name = "Renamed"
    assert texture_job.tick() == texture_job.POLL_S
    assert (scene.spectral.texture.status, scene.spectral.texture.progress) == ("solving colors", 0.25)


def test_another_file_ends_the_design_and_can_have_its_own(scene: Any) -> None:
    process = started(scene)
    texture_job.watch()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    assert not texture_job.running() and process.poll() is not None
    assert bpy.app.timers.is_registered(texture_job.tick)
    opened = bpy.context.scene
    assert "the design of the earlier file was ended" in opened.spectral.texture.status
    assert texture_job.tick() is None
    started(opened)
    assert texture_job.tick() == texture_job.POLL_S and opened.spectral.texture.status == "solving colors"


def test_a_cancelled_design_is_over_at_once(scene: Any) -> None:
    process = started(scene)
    assert bpy.ops.spectral.texture_cancel() == {"FINISHED"}
    assert not texture_job.running() and process.poll() is not None
    assert scene.spectral.texture.status == "cancelled"
    with pytest.raises(RuntimeError, match="no texture is being designed"):
        bpy.ops.spectral.texture_cancel()


def test_an_undo_of_a_later_edit_keeps_the_designed_texture(scene: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr(texture_job.child, "command", lambda *_: [sys.executable, "-c", "print('done', flush=True)"])
    monkeypatch.setattr(texture_job, "_take_over", lambda found, _: setattr(found, "texture_file", "made.exr"))
    bpy.ops.ed.undo_push(message="before")
    started(scene).wait()
    assert texture_job.tick() is None
    before, scene.render.resolution_x = scene.render.resolution_x, 123
    bpy.ops.ed.undo_push(message="moved")
    bpy.ops.ed.undo()
    assert bpy.context.scene.render.resolution_x == before != 123
    assert bpy.context.scene.spectral.texture.texture_file == "made.exr"


def test_files_of_a_design_that_cannot_be_read_are_an_error_of_it(scene: Any, monkeypatch: Any) -> None:
    """The timer ended in a traceback, and the panel kept the status of the last step."""
    monkeypatch.setattr(texture_job.child, "command", lambda *_: [sys.executable, "-c", "print('progress 0.5')"])
    started(scene).wait()
    assert texture_job.tick() is None
    told = bpy.context.scene.spectral.texture
    assert told.failed and "cannot be read" in told.status and "design it again" in told.status


def test_a_process_that_has_ended_is_no_design(scene: Any) -> None:
    """Even before the timer has noticed it."""
    process = started(scene)
    with pytest.raises(InvalidInputError, match="wait for it or cancel it"):
        texture_job.start(scene)
    process.kill()
    process.wait()
    assert not texture_job.running()
    assert started(scene).poll() is None


def test_the_design_of_a_deleted_scene_ends(scene: Any) -> None:
    other = scene.copy()
    process = started(other)
    bpy.data.scenes.remove(other)
    assert texture_job.tick() is None
    assert not texture_job.running() and process.poll() is not None


def test_a_copy_of_the_scene_does_not_say_that_the_design_goes_on(scene: Any) -> None:
    """*New Scene, Copy Settings* during a design: the copy said "starting" from then on, also in its file."""
    started(scene)
    copied = scene.copy().spectral.texture
    assert copied.is_under_way
    texture_job.tick()
    assert (copied.status, copied.is_under_way) == ("", False)
    assert scene.spectral.texture.status == "solving colors" and scene.spectral.texture.is_under_way


def test_the_panel_of_another_scene_shows_the_design_of_the_file(scene: Any) -> None:
    from blender_addon.panels import texture as panel

    other = bpy.data.scenes.new("Other")
    started(scene)
    texture_job.tick()
    shown = {}
    for each in (scene, other):
        layout = MagicMock()
        panel._draw_run(layout, SimpleNamespace(scene=each), each.spectral.texture)
        shown[each.name] = layout.row.return_value.progress.call_args.kwargs
    assert shown[scene.name] == {"factor": 0.25, "text": "solving colors"}
    assert shown["Other"] == {"factor": 0.25, "text": f"{scene.name}: solving colors"}
    layout, other.spectral.texture.texture_file = MagicMock(), "texture.exr"
    panel._draw_outcome(layout, SimpleNamespace(scene=other, region=None, preferences=None), other.spectral.texture)
    assert layout.row.called  # its own result stays


def test_disabling_the_extension_ends_what_runs_and_says_so(scene: Any) -> None:
    """The panel showed the last step of it when the extension was enabled again."""
    from blender_addon.editing.sweep import live as sweeps

    process = started(scene)
    scene.spectral.sweep.is_under_way, scene.spectral.sweep.status = True, "3 of 7 points"
    for module in (texture_job, sweeps):
        module.unregister()
        module.register()
    assert process.poll() is not None
    for group, button in ((scene.spectral.texture, "Design Texture"), (scene.spectral.sweep, "Run Sweep")):
        assert not group.is_under_way
        assert group.status == f"the extension was disabled while this ran; press {button} again"


@pytest.mark.parametrize("saved", [True, False])
def test_a_texture_in_a_temporary_folder_is_named(scene: Any, saved: bool, tmp_path: Any) -> None:
    """It is deleted at the end of the session, also if the .blend is saved afterward."""
    if not saved:
        bpy.ops.wm.read_factory_settings(use_empty=True)
    design = bpy.context.scene.spectral.texture  # noqa: F811
    design.folder = "//spectral_texture"
    folder = texture_job.folder_of(design)
    folder.mkdir(exist_ok=True)
    (folder / "report.json").write_text('{"pictures": []}', "utf-8")
    report, texture_job.report_lines = texture_job.report_lines, lambda _figures: ["made"]
    try:
        texture_job._take_over(design, folder)
    finally:
        texture_job.report_lines = report
    assert design.report == "made"
    assert ("is deleted at the end of the session" in design.status) == (not saved)


def test_a_step_made_during_a_design_does_not_say_that_it_goes_on(scene: Any) -> None:
    bpy.ops.ed.undo_push(message="before")
    started(scene)
    bpy.context.scene.frame_end = 77
    bpy.ops.ed.undo_push(message="edited meanwhile")
    bpy.context.scene.frame_end = 78
    bpy.ops.ed.undo_push(message="edited again")
    bpy.ops.ed.undo()
    now = bpy.context.scene.spectral.texture
    assert now.status == "starting" and texture_job.running(), "the design goes on"
    bpy.ops.ed.redo()
    texture_job.cancel()
    bpy.ops.ed.undo()
    now = bpy.context.scene.spectral.texture
    assert bpy.context.scene.frame_end == 77 and (now.status, now.is_under_way) == ("", False)


def test_a_file_saved_during_a_design_says_so(scene: Any, tmp_path: Any) -> None:
    started(scene)
    path = str(tmp_path / "meanwhile.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    texture_job.cancel()
    bpy.ops.wm.open_mainfile(filepath=path)
    now = bpy.context.scene.spectral.texture
    assert "saved while this ran; press Design Texture" in now.status and not now.is_under_way


def test_the_texture_of_another_scene_is_not_overwritten(scene: Any, tmp_path: Any) -> None:
    """A full copy of a scene has the same folder."""
    own = scene.spectral.texture
    own.texture_file, own.designed_as = str(tmp_path / "spectral_texture" / "texture.exr"), scene.name
    bpy.ops.scene.new(type="FULL_COPY")
    copy = bpy.context.scene
    assert copy != scene
    with pytest.raises(InvalidInputError, match=f"has the texture of the scene {scene.name!r}, which would be lost"):
        texture_job.start(copy)
    started(scene)
    texture_job.cancel()
    copy.spectral.texture.folder = "//another"
    started(copy)
