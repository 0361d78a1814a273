# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender ends the timers of a file when another one is opened: edits in the new file are followed all the same."""

from __future__ import annotations

import threading
import time
from types import SimpleNamespace

import pytest

pytest.importorskip("bpy")


class Timers:
    """Timers that the test runs itself, as Blender does."""

    def __init__(self) -> None:
        self.waiting: list = []

    def register(self, call, first_interval=0.0, persistent=False):
        self.waiting.append(call)

    def is_registered(self, call):
        return call in self.waiting

    def unregister(self, call):
        self.waiting.remove(call)

    def run_all(self):
        """Call each once; those that return None end."""
        for call in list(self.waiting):
            if call() is None:
                self.waiting.remove(call)


@pytest.fixture
def timers() -> Timers:
    return Timers()


def windowed(blender, timers):
    """bpy as the modules see it in a session with a window."""
    app = SimpleNamespace(background=False, timers=timers, is_job_running=lambda _name: False)
    return SimpleNamespace(app=app, data=blender.data)


def test_an_edit_is_followed_although_the_file_before_had_an_unanswered_one(blender, timers, monkeypatch) -> None:
    from blender_addon.editing import deferred

    monkeypatch.setattr(deferred, "bpy", windowed(blender, timers))
    followed: list[str] = []
    live = deferred.Deferred(lambda scene: followed.append(scene.name), delay_seconds=1.0)
    live.request(blender.context.scene)
    blender.ops.wm.read_factory_settings(use_empty=True)
    timers.waiting.clear()  # as Blender does
    blender.context.scene.name = "Newly Opened"
    live.request(blender.context.scene)
    timers.run_all()
    assert followed == ["Newly Opened"]
    live.request(blender.context.scene)
    live.request(blender.context.scene)
    assert len(timers.waiting) == 1, "edits until the answer share a timer"


@pytest.fixture
def asked(blender, timers, monkeypatch):
    """The module of *Possible?*, in a session with a window."""
    from blender_addon.editing import behind
    from blender_addon.editing.palette import possible

    for module in (possible, behind):
        monkeypatch.setattr(module, "bpy", windowed(blender, timers))
    monkeypatch.setattr(possible, "redraw", lambda *_: None)
    yield possible
    possible.ANSWERS.stop()


def answers(timers: Timers) -> None:
    end = time.monotonic() + 60
    while timers.waiting and time.monotonic() < end:
        timers.run_all()
        time.sleep(0.01)


def test_possible_colors_are_told_although_the_file_before_had_an_unanswered_question(blender, timers, asked) -> None:
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    asked.follow(blender.context.scene)
    blender.ops.wm.read_factory_settings(use_empty=True)
    timers.waiting.clear()  # as Blender does
    blender.ops.spectral.palette_preset(preset="METAMER_PAIR")
    palette = blender.context.scene.spectral.palette
    asked.follow(blender.context.scene)
    answers(timers)
    assert palette.possible.words
    assert palette.possible.material_uid == palette.materials[0].uid


def test_possible_colors_are_told_in_two_scenes_that_ask_at_once(blender, timers, asked) -> None:
    first = blender.context.scene
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    blender.ops.scene.new(type="NEW")
    second = blender.context.scene
    blender.ops.spectral.palette_preset(preset="METAMER_PAIR")
    asked.follow(first)
    asked.follow(second)
    answers(timers)
    for scene in (first, second):
        assert scene.spectral.palette.possible.words, scene.name


def test_nothing_is_written_while_a_render_reads(blender, timers, monkeypatch) -> None:
    from blender_addon.editing import texture_job
    from blender_addon.editing.deferred import RENDER_SECONDS
    from blender_addon.editing.dial import paths
    from blender_addon.editing.sweep import live as sweep

    scene = blender.context.scene
    state = SimpleNamespace(renders=True)
    for module in (sweep, texture_job, paths):
        seen = windowed(blender, timers)
        seen.app.is_job_running = lambda _name: state.renders
        monkeypatch.setattr(module, "bpy", seen)
    copied = threading.Thread(target=int)
    copied.start()
    copied.join()
    assert paths._report(scene.session_uid, copied, ["lost"]) == RENDER_SECONDS
    assert sweep.tick() == texture_job.tick() == RENDER_SECONDS
    monkeypatch.setattr(sweep, "_served_uid", scene.session_uid)
    done: list[str] = []
    sweep._on_main_thread(scene.session_uid, lambda target: done.append(target.name))
    timers.run_all()
    assert not done
    assert scene.spectral.dial.message == ""
    state.renders = False
    timers.run_all()
    assert done == [scene.name]
    assert paths._report(scene.session_uid, copied, ["lost"]) is None
    assert scene.spectral.dial.message == "lost"


def test_an_error_in_one_answer_does_not_keep_the_next_scene_waiting(blender, timers, monkeypatch, capsys) -> None:
    from blender_addon.editing import behind

    monkeypatch.setattr(behind, "bpy", windowed(blender, timers))
    work = behind.Behind("test")
    scenes = [blender.context.scene, blender.data.scenes.new("Second")]
    hold, done = threading.Event(), []

    def answered(scene, _answer) -> None:
        done.append(scene.name)
        raise OSError(f"of {len(done)}")

    for scene in scenes:
        work.run(scene, hold.wait, answered, patience_seconds=0.0)
    hold.set()
    answers(timers)
    work.stop()
    assert done == [scene.name for scene in scenes]
    told = capsys.readouterr().err
    assert "OSError: of 1" in told and "OSError: of 2" in told
