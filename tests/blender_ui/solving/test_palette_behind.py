# SPDX-License-Identifier: GPL-3.0-or-later
"""Solves on a thread, as in a Blender with a window: the table takes the answer that fits it, and asks again."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import pytest

PRESET = "METAMER_PAIR"


class Timers:
    """Timers that the test runs itself."""

    def __init__(self):
        self.waiting = []

    def register(self, call, first_interval=0.0):
        self.waiting.append(call)

    def is_registered(self, call):
        return call in self.waiting

    def unregister(self, call):
        self.waiting.remove(call)


@pytest.fixture
def window(blender, monkeypatch):
    """A session whose solves run on a thread that waits for ``gate``."""
    from blender_addon.editing import behind
    from blender_addon.editing.palette import live

    blender.ops.spectral.palette_preset(preset=PRESET)
    scene = blender.context.scene
    scene.spectral.palette.live = True
    app = SimpleNamespace(background=False, timers=Timers(), is_job_running=lambda _name: False)
    monkeypatch.setattr(behind, "bpy", SimpleNamespace(app=app, data=blender.data))
    monkeypatch.setattr(behind, "PATIENCE_SECONDS", 0.0)
    gate = threading.Event()
    solves = behind.Behind("test")
    run = solves.run
    monkeypatch.setattr(live, "SOLVES", solves)
    monkeypatch.setattr(solves, "run", lambda scene, work, done: run(scene, lambda: gate.wait(30) and work(), done))
    yield SimpleNamespace(scene=scene, palette=scene.spectral.palette, gate=gate, solves=solves, live=live)
    gate.set()
    solves.stop()


def arrive(window):
    """Let the thread answer, and hand the answer on."""
    window.gate.set()
    for found in list(window.solves.running.values()):
        found.answer.result(30)
    return window.solves.collect()


def test_an_edit_is_answered_later_and_the_table_is_outdated_until_then(window):
    palette = window.palette
    palette.materials[0].cells[0].target = (0.2, 0.5, 0.3)
    window.live._follow(window.scene)
    assert palette.is_stale
    arrive(window)
    assert not palette.is_stale
    assert palette.status


def test_an_edit_during_a_solve_is_solved_after_it(window, monkeypatch):
    asked = []
    monkeypatch.setattr(window.live.LIVE, "request", asked.append)
    palette, cell = window.palette, window.palette.materials[0].cells[0]
    cell.target = (0.2, 0.5, 0.3)
    window.live._follow(window.scene)
    cell.target = (0.6, 0.5, 0.3)
    window.live._follow(window.scene)
    assert len(window.solves.running) == 1, "a scene has one solve at a time"
    before = tuple(cell.actual)
    asked.clear()
    arrive(window)
    assert tuple(cell.actual) != before, "an answer for earlier numbers is shown while the next one is computed"
    assert palette.is_stale
    assert asked == [window.scene]


def test_an_edit_does_not_wait_for_the_finish_before_it(window, monkeypatch):
    from blender_addon.editing import behind
    from blender_addon.editing.palette import solve

    finishes, gate = behind.Behind("finish"), threading.Event()
    run = finishes.run
    monkeypatch.setattr(window.live, "FINISHES", finishes)
    monkeypatch.setattr(finishes, "run", lambda scene, work, done: run(scene, lambda: gate.wait(30) and work(), done))
    palette, cell = window.palette, window.palette.materials[0].cells[0]
    window.live._finish(window.scene)
    assert finishes.running
    cell.target = (0.2, 0.5, 0.3)
    window.live._follow(window.scene)
    assert not finishes.running, "its answer is of the table before the edit"
    arrive(window)
    assert not palette.is_stale
    newest = solve._last[window.scene.session_uid]
    gate.set()
    finishes.collect()
    finishes.stop()
    assert solve._last[window.scene.session_uid] is newest


def test_an_answer_for_another_table_is_dropped(window):
    palette = window.palette
    palette.materials[0].cells[0].target = (0.2, 0.5, 0.3)
    window.live._follow(window.scene)
    palette.live = False
    window.scene.spectral.palette.materials.remove(1)
    before = palette.milliseconds
    arrive(window)
    assert palette.is_stale
    assert palette.milliseconds == before


def test_a_deleted_scene_ends_the_wait(window, blender):
    window.palette.materials[0].cells[0].target = (0.2, 0.5, 0.3)
    window.live._follow(window.scene)
    window.solves.running[-1] = window.solves.running.pop(window.scene.session_uid)
    assert arrive(window) is None
    assert not window.solves.running


def test_a_solver_that_fails_leaves_its_text(window, monkeypatch):
    from blender_addon.editing.palette import solve

    def broken(_uid, _problem):
        raise ValueError("no such matrix")

    monkeypatch.setattr(solve, "live_solution", broken)
    monkeypatch.setattr(solve.traceback, "print_exc", lambda: None)  # keeps it out of the output of the tests
    window.palette.materials[0].cells[0].target = (0.2, 0.5, 0.3)
    window.live._follow(window.scene)
    arrive(window)
    assert "no such matrix" in window.palette.message
    assert window.palette.is_stale


def test_an_answer_for_rows_that_were_moved_is_not_stored(window, monkeypatch):
    asked = []
    monkeypatch.setattr(window.live.LIVE, "request", asked.append)
    palette = window.palette
    palette.materials[0].cells[1].target = (0.9, 0.2, 0.1)
    window.live._follow(window.scene)
    palette.active_row = 0
    assert window.scene.spectral.palette.materials[0].uid != palette.materials[1].uid
    before = {item.uid: tuple(item.cells[1].actual_linear) for item in palette.materials}
    palette.materials.move(0, 1)
    arrive(window)
    assert {item.uid: tuple(item.cells[1].actual_linear) for item in palette.materials} == before
    assert palette.is_stale


@pytest.mark.parametrize(("is_fast", "reads"), [(True, 1), (False, 2)])
def test_the_table_is_read_again_only_for_a_later_answer(window, monkeypatch, is_fast, reads):
    from blender_addon.editing.palette import solve

    count, read = [], solve.palette_problem
    monkeypatch.setattr(solve, "palette_problem", lambda palette: count.append(1) or read(palette))
    if is_fast:  # as without a window, or within the patience
        monkeypatch.setattr(window.solves, "run", lambda scene, work, done: done(scene, work()))
    window.palette.materials[0].cells[0].target = (0.2, 0.5, 0.3)
    count.clear()
    window.live._follow(window.scene)
    arrive(window)
    assert len(count) == reads
    assert not window.palette.is_stale


@pytest.mark.parametrize("how", ["opened", "copied"])
def test_a_table_that_was_saved_or_copied_before_its_solution_is_solved(window, monkeypatch, tmp_path, how):
    """It stated "Solving …" until the next edit, and Apply was not offered."""
    import bpy

    live = window.live
    asked = []
    monkeypatch.setattr(live.LIVE, "request", asked.append)
    window.palette.materials[0].cells[0].target = (0.2, 0.5, 0.3)
    window.live._follow(window.scene)
    asked.clear()
    monkeypatch.setattr(live, "bpy", SimpleNamespace(app=SimpleNamespace(background=False), data=bpy.data))
    if how == "opened":
        path = str(tmp_path / "stale.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
    else:
        bpy.ops.scene.new(type="FULL_COPY")
        arrive(window)
    scene = bpy.context.scene
    assert scene.spectral.palette.is_stale and asked and set(asked) == {scene}
    asked.clear()
    scene.spectral.palette.message = "the table is empty"
    live._resume(scene)
    assert not asked, "a table that cannot be solved is not solved again and again"


def test_an_answer_for_a_cleared_table_is_no_error_of_the_empty_one(window, blender):
    window.palette.materials[0].cells[0].target = (0.2, 0.5, 0.3)
    window.live._follow(window.scene)
    blender.ops.spectral.palette_clear()
    arrive(window)
    assert (window.palette.message, window.palette.status, window.palette.is_stale) == ("", "", False)
