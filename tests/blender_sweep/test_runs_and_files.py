# SPDX-License-Identifier: GPL-3.0-or-later
"""A run and its panel when the scene is renamed or deleted, another file is opened, or the process ends by itself."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest

pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

import bpy

from blender_addon.editing.sweep import documents as sweep_documents
from blender_addon.editing.sweep import live as sweeps
from spectral_core.errors import FileWriteError, InvalidInputError
from tests.blender_sweep.test_sweep_in_blender import KEY, scene  # noqa: F401 - a fixture

WAITING = [sys.executable, "-c", "import time; time.sleep(300)"]


@pytest.fixture
def swept(scene: Any, monkeypatch: Any) -> Iterator[Any]:  # noqa: F811
    """A scene with a swept setting, whose run is a process that waits."""
    monkeypatch.setattr(sweeps, "command_line", lambda *_: WAITING)
    sweeps.add(scene, KEY)
    yield scene
    sweeps._forget()
    if bpy.app.timers.is_registered(sweeps.tick):
        bpy.app.timers.unregister(sweeps.tick)


def test_the_progress_of_a_renamed_scene_is_updated(swept: Any) -> None:
    sweeps.start(swept)
    swept.name = "Renamed"
    assert sweeps.tick() == sweeps.POLL_S
    assert swept.spectral.sweep.status == "0 of 3"


def test_another_file_ends_the_run_and_can_be_swept_itself(swept: Any) -> None:
    run = sweeps.start(swept)
    sweeps.watch()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    assert sweeps.running() is None and run.process.poll() is not None
    assert bpy.app.timers.is_registered(sweeps.tick)
    opened = bpy.context.scene
    assert "the sweep of the earlier file was ended" in opened.spectral.sweep.status
    assert sweeps.tick() is None
    sweeps.add(opened, KEY)
    assert sweeps.start(opened).process.poll() is None
    assert sweeps.tick() == sweeps.POLL_S and opened.spectral.sweep.status == "0 of 3"


def test_a_file_that_is_opened_without_a_run_keeps_its_status(swept: Any) -> None:
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    assert bpy.context.scene.spectral.sweep.status == ""


def test_a_cancelled_run_is_over_at_once(swept: Any) -> None:
    run = sweeps.start(swept)
    assert bpy.ops.spectral.sweep_cancel() == {"FINISHED"}
    assert sweeps.running() is None and run.process.poll() is not None
    assert swept.spectral.sweep.status == "cancelled; 0 of 3 points stay, and the next run continues"
    with pytest.raises(RuntimeError, match="no sweep is running"):
        bpy.ops.spectral.sweep_cancel()
    assert sweeps.tick() is None
    assert sweeps.start(swept).process.poll() is None


def test_a_process_that_has_ended_is_no_run(swept: Any) -> None:
    """Even before the timer has noticed it."""
    run = sweeps.start(swept)
    with pytest.raises(InvalidInputError, match="wait for it or cancel it"):
        sweeps.start(swept)
    run.process.kill()
    run.process.wait()
    assert sweeps.running() is None
    assert sweeps.start(swept).process.poll() is None and run.log.closed


def test_the_run_of_a_deleted_scene_ends(swept: Any) -> None:
    other = bpy.data.scenes.new("Other")
    sweeps.add(other, KEY)
    run = sweeps.start(other)
    bpy.data.scenes.remove(other)
    assert sweeps.tick() is None
    assert sweeps.running() is None and run.process.poll() is not None


def test_the_panel_of_another_scene_shows_the_run_of_the_file(swept: Any) -> None:
    from blender_addon.panels import sweep as panel

    other = bpy.data.scenes.new("Other")
    sweeps.start(swept)
    swept.spectral.sweep.done, swept.spectral.sweep.total = 3, 8
    shown = {}
    for scene_ in (swept, other):
        layout = MagicMock()
        panel._draw_run(layout, SimpleNamespace(scene=scene_, region=None, preferences=None))
        shown[scene_.name] = layout.row.return_value.progress.call_args.kwargs
    assert shown[swept.name] == {"factor": 3 / 8, "text": "3 of 8"}
    assert shown["Other"] == {"factor": 3 / 8, "text": f"{swept.name}: 3 of 8"}


def test_the_document_of_the_panel_is_read_whatever_the_names(swept: Any) -> None:
    """JSON writes characters such as an emoji as two escapes, which TOML does not read."""
    from spectral_core.explore.sweep.document import read_sweep

    bpy.data.lights["Key"].name = 'Lamp \U0001f4a1 "a\\b", \x7f'
    sweep = swept.spectral.sweep
    sweep.parameters.clear()
    path = f'bpy.data.lights["{bpy.utils.escape_identifier(bpy.data.lights[0].name)}"].energy'
    sweeps.add(swept, path)
    document = sweep_documents.write_documents(swept).document
    (parameter,) = read_sweep(document).space.parameters
    assert parameter.path == path and parameter.name == sweep.parameters[0].label


def test_the_folders_of_a_linked_scene_count_from_its_library(swept: Any, tmp_path: Any) -> None:
    from blender_addon.editing import recipe as recipes
    from blender_addon.editing import texture_job

    (tmp_path / "library").mkdir()
    swept.spectral.sweep.folder = "//out.cdb"
    swept.spectral.texture.folder = "//texture"
    swept.spectral.recipe.kind, swept.spectral.recipe.library = "LAMP", "FILE"
    swept.spectral.recipe.filepath = "//leds.csv"
    (tmp_path / "library/leds.csv").write_text("nm,a\n400,1\n700,1\n")
    library = str(tmp_path / "library/scenes.blend")
    bpy.data.libraries.write(library, {swept}, path_remap="NONE")
    with bpy.data.libraries.load(library, link=True) as (_, wanted):
        wanted.scenes = [swept.name]
    linked = wanted.scenes[0].spectral
    assert sweep_documents.folder_of(linked.sweep) == tmp_path / "library/out.cdb"
    assert texture_job.folder_of(linked.texture) == tmp_path / "library/texture"
    assert [each.name for each in recipes._library(linked.recipe)] == ["a"]


def test_the_progress_stays_if_the_ledger_cannot_be_opened(swept: Any) -> None:
    """The timer of the panel would end with the error; the process of the run reports it."""
    run = sweeps.start(swept)
    run._count._done = 2
    run.folder.mkdir()
    (run.folder / "ledger.sqlite").write_bytes(b"no ledger" * 100)
    assert sweeps.tick() == sweeps.POLL_S
    assert swept.spectral.sweep.status.startswith("2 of 3")


@pytest.mark.parametrize(("entry", "value"), [("percentage", 0), ("percentage", 40000), ("samples", 2.5)])
def test_entries_of_the_document_beyond_blenders_limits_are_refused(swept: Any, entry: str, value: Any) -> None:
    from pathlib import Path

    from blender_addon.editing.sweep.node import blend_node
    from spectral_core.explore.sweep.parameters import Parameter, Space

    space = Space((Parameter("energy", 1.0, 2.0, path=KEY),))
    with pytest.raises(InvalidInputError, match=f"{entry} = {value}; expected a whole number from 1 to"):
        blend_node({"blend": "scene.blend", entry: value}, space, Path(bpy.data.filepath).parent)


def test_a_copy_of_the_file_that_cannot_be_written_is_one_message(swept: Any, tmp_path: Any) -> None:
    """Blender raises its own error, which would be shown as a traceback."""
    swept.spectral.sweep.folder = str(tmp_path / "heights.cdb")
    (tmp_path / "heights.sweep.blend").mkdir()
    with pytest.raises(FileWriteError, match=r"the copy of the file for the sweep could not be written: .*folder"):
        sweeps.start(swept)
    with pytest.raises(RuntimeError) as told:
        bpy.ops.spectral.sweep_run()
    assert "Traceback" not in str(told.value)


def test_the_message_of_a_failed_process_is_not_blenders_last_line(swept: Any, monkeypatch: Any) -> None:
    told = "ImportError: no such name\\n\\nError: script failed, exiting.\\nBlender 5.2.2 LTS\\n\\nBlender quit"
    monkeypatch.setattr(sweeps, "command_line", lambda *_: [sys.executable, "-c", f'print("{told}"); exit(1)'])
    sweeps.start(swept).process.wait()
    assert sweeps.tick() is None
    assert swept.spectral.sweep.status == "ImportError: no such name"


def _table(scene: Any, path: str) -> Any:  # noqa: F811
    """The folder of a sweep with one finished point, as a run leaves it."""
    from spectral_core.explore.sweep.designs import Design
    from spectral_core.explore.sweep.parameters import Parameter, Space
    from spectral_core.explore.sweep.project import Project
    from spectral_core.explore.sweep.region import RegionOfInterest
    from spectral_core.explore.sweep.store import Store

    entry = scene.spectral.sweep.parameters[0]
    space = Space((Parameter(entry.label, entry.low, entry.high, path=path),))
    project = Project(space, RegionOfInterest(), Design(budget=1), fingerprint="x")
    with Store.create(sweep_documents.folder_of(scene.spectral.sweep), project) as store:
        store.enter([{entry.label: 25.0}])
        store.ledger.commit(store.key({entry.label: 25.0}), {"v": 1.0}, {}, 0.1)
    return store.folder


def test_the_documents_of_another_scene_stay(swept: Any) -> None:
    """A second scene with the same folder replaced the copy of the file and the sweep's document before it failed."""
    folder = _table(swept, KEY)
    sweeps.start(swept)
    sweeps.cancel()
    document = folder.with_suffix(".sweep.toml").read_bytes()
    other = bpy.data.scenes.new("Other")
    sweeps.add(other, 'bpy.data.objects["Camera"].location[0]')
    with pytest.raises(InvalidInputError, match="its parameters differ .the scene 'Scene' has this folder, too"):
        sweeps.start(other)
    assert folder.with_suffix(".sweep.toml").read_bytes() == document
    other.spectral.sweep.folder = "//other.cdb"
    sweeps.start(other)


def test_a_point_of_another_setting_is_not_applied(swept: Any) -> None:
    """A column of the same name was set in the setting that is swept now: the radius got the energy."""
    entry = swept.spectral.sweep.parameters[0]
    _table(swept, KEY)
    entry.name = 'bpy.data.objects["Camera"].location[0]'
    with pytest.raises(RuntimeError, match=r"is of bpy.data.lights\\?..Key\\?..*choose another folder"):
        bpy.ops.spectral.sweep_apply(row=1)
    assert bpy.data.objects["Camera"].location[0] == 0.0
    entry.name = KEY
    assert bpy.ops.spectral.sweep_apply(row=1) == {"FINISHED"}
    assert bpy.data.lights["Key"].energy == 25.0
    bpy.data.lights["Key"].name = "Renamed"  # the setting is the same, and has another path
    entry.name = KEY.replace("Key", "Renamed")
    assert bpy.ops.spectral.sweep_apply(row=1) == {"FINISHED"}


@pytest.mark.parametrize("end", ["cancelled", "driven"])
def test_a_run_that_began_no_sweep_leaves_no_copy_of_the_file(scene: Any, monkeypatch: Any, end: str) -> None:  # noqa: F811
    """It was cancelled before its first point, or the setting cannot be swept; the copy may be large."""
    from pathlib import Path

    if end == "cancelled":
        monkeypatch.setattr(sweeps, "command_line", lambda *_: WAITING)
    else:
        bpy.data.lights["Key"].driver_add("energy").driver.expression = "25"
    sweeps.add(scene, KEY)
    folder = Path(bpy.data.filepath).parent
    before = set(folder.iterdir())
    sweeps.start(scene)
    assert {each.name for each in set(folder.iterdir()) - before} >= {"sweep.sweep.blend", "sweep.sweep.toml"}
    if end == "cancelled":
        sweeps.cancel()
    else:
        with pytest.raises(Exception, match="a driver"):
            sweeps.wait(scene)
    assert set(folder.iterdir()) == before


def test_a_step_or_file_made_during_a_run_does_not_say_that_it_goes_on(swept: Any, tmp_path: Any) -> None:
    path = str(tmp_path / "meanwhile.blend")
    bpy.ops.ed.undo_push(message="before")
    sweeps.start(swept)
    sweeps.tick()
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    bpy.context.scene.frame_end = 77
    bpy.ops.ed.undo_push(message="edited meanwhile")
    bpy.context.scene.frame_end = 78
    bpy.ops.ed.undo_push(message="edited again")
    bpy.ops.ed.undo()
    assert bpy.context.scene.spectral.sweep.status == "0 of 3" and sweeps.running(), "the run goes on"
    copied = bpy.context.scene.copy()
    assert copied.spectral.sweep.is_under_way
    sweeps.tick()
    assert (copied.spectral.sweep.status, copied.spectral.sweep.is_under_way) == ("", False)
    assert bpy.context.scene.spectral.sweep.is_under_way and sweeps.running()
    bpy.data.scenes.remove(copied)
    bpy.ops.ed.redo()
    sweeps.cancel()
    bpy.ops.ed.undo()
    now = bpy.context.scene.spectral.sweep
    assert bpy.context.scene.frame_end == 77 and (now.status, now.is_under_way) == ("", False)
    bpy.ops.wm.open_mainfile(filepath=path)
    now = bpy.context.scene.spectral.sweep
    assert "saved while this ran; press Run Sweep" in now.status and not now.is_under_way
