# SPDX-License-Identifier: GPL-3.0-or-later
"""A run and its panel when the scene is renamed or deleted, another file is opened, or the process ends by itself."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

import bpy

from blender_addon.editing import sweep as sweeps
from spectral_core.errors import InvalidInputError
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
