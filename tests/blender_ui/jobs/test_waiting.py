# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that work on a thread: what they prepare, their answer, errors, and scenes that come and go."""

from __future__ import annotations

import threading
import time
from types import SimpleNamespace

import pytest

from spectral_core.errors import InvalidInputError

TIMER, MOUSE = SimpleNamespace(type="TIMER", value="NOTHING"), SimpleNamespace(type="MOUSEMOVE", value="NOTHING")


class Manager:
    """A window manager that counts timers."""

    def __init__(self):
        self.timers, self.handlers = 0, []

    def event_timer_add(self, _seconds, window):
        self.timers += 1
        return "timer"

    def event_timer_remove(self, _timer):
        self.timers -= 1

    def modal_handler_add(self, operator):
        self.handlers.append(operator)


@pytest.fixture
def context(blender):
    words = []
    workspace = SimpleNamespace(status_text_set=words.append)
    return SimpleNamespace(
        scene=blender.context.scene,
        window_manager=Manager(),
        window=None,
        workspace=workspace,
        screen=None,
        words=words,
    )


@pytest.fixture
def operator(blender, monkeypatch):
    from blender_addon.editing import waiting
    from blender_addon.editing.waiting import Waiting

    monkeypatch.setattr(waiting, "_waiting", [])

    class Operator(Waiting):
        bl_label = "Work"
        is_ready = False
        work = staticmethod(lambda: 7)

        def __init__(self):
            self.reports, self.answers, self.undone, self.left = [], [], [], 0

        def report(self, kind, text):
            self.reports.append((kind, text))

        def is_prepared(self):
            return self.is_ready

        def begin(self, context):
            return self.work

        def end(self, scene, answer):
            self.answers.append((scene, answer))

        def failed(self, scene):
            self.undone.append(scene)

        def leave(self):
            self.left += 1

    return Operator()


def finished(operator, context):
    """The result after the last timer event."""
    for _ in range(6000):
        found = operator.modal(context, TIMER)
        if found != {"PASS_THROUGH"}:
            return found
        time.sleep(0.01)
    raise AssertionError("the operator does not end")


def test_work_begins_when_it_is_prepared(operator, context):
    assert operator.start(context) == {"RUNNING_MODAL"}
    assert context.window_manager.timers == 1
    assert operator.modal(context, TIMER) == {"PASS_THROUGH"}
    assert operator.modal(context, MOUSE) == {"PASS_THROUGH"}, "the artist works on"
    assert operator._thread is None
    operator.is_ready = True
    assert finished(operator, context) == {"FINISHED"}
    assert operator.answers == [(context.scene, 7)]
    assert operator.left == 1
    assert context.window_manager.timers == 0
    assert context.words[-1] is None
    assert operator.undone == []
    assert operator.left == 1


def test_no_work_begins_in_a_round_that_has_paused_long(operator, context, monkeypatch):
    from blender_addon.editing import waiting

    monkeypatch.setattr(waiting, "paused_seconds", lambda: 0.05)
    operator.start(context)
    operator.is_ready = True
    assert operator.modal(context, TIMER) == {"PASS_THROUGH"}
    assert operator._thread is None
    monkeypatch.setattr(waiting, "paused_seconds", lambda: 0.0)
    assert finished(operator, context) == {"FINISHED"}


@pytest.mark.parametrize("error", [InvalidInputError("no lights"), OSError("disk full")])
def test_an_error_of_the_work_is_reported_once(operator, context, error):
    def work():
        raise error

    operator.is_ready, operator.work = True, work
    operator.start(context)
    assert finished(operator, context) == {"CANCELLED"}
    assert operator.reports == [({"ERROR"}, str(error))]
    assert operator.undone == [context.scene]
    assert operator.left == 1
    assert context.window_manager.timers == 0


def test_another_scene_in_the_window_before_the_beginning_is_an_error(operator, context, blender):
    operator.start(context)
    other = blender.data.scenes.new("other")
    first, context.scene, operator.is_ready = context.scene, other, True
    assert finished(operator, context) == {"CANCELLED"}
    assert "another scene" in operator.reports[0][1]
    assert operator.undone == [first]
    blender.data.scenes.remove(other)


def test_a_scene_that_is_deleted_meanwhile_ends_the_work(operator, context, blender):
    operator.is_ready, operator.work = True, lambda: time.sleep(0.05)
    context.scene = blender.data.scenes.new("short-lived")
    operator.start(context)
    blender.data.scenes.remove(context.scene)
    context.scene = blender.context.scene
    assert finished(operator, context) == {"CANCELLED"}
    assert operator.undone == []
    assert operator.left == 1
    assert operator.answers == []


def test_a_script_gets_the_answer_at_once(operator, context):
    operator.is_ready = True
    assert operator.execute(context) == {"FINISHED"}
    assert operator.answers == [(context.scene, 7)]
    assert operator.left == 1
    assert context.window_manager.timers == 0


def test_another_file_ends_the_work_and_its_words_in_the_status_bar(context, operator):
    operator.is_ready = True
    assert operator.invoke(context, MOUSE) == {"RUNNING_MODAL"}
    assert context.words[-1] == "Work … Esc stops it"
    operator.cancel(context)
    assert context.words[-1] is None and operator.left == 1
    operator.invoke(context, MOUSE)
    operator.cancel(SimpleNamespace(workspace=None))  # a window that is closed has none
    assert operator.left == 2


def test_a_dialog_or_file_browser_that_is_closed_before_the_beginning_leaves_nothing(context, operator):
    operator.cancel(context)  # Blender calls it, though the work has not begun
    assert context.words == [] and operator.left == 0


@pytest.mark.parametrize("step", ["prepare", "is_prepared", "begin"])
@pytest.mark.parametrize("how", ["now", "in a window"])
def test_an_unexpected_error_takes_back_what_was_prepared(operator, context, step, how):
    def fail(*_arguments, **_options):
        raise RuntimeError("a bug")

    if how == "now" and step == "is_prepared":
        pytest.skip("nothing is waited for")
    if how == "in a window":
        assert operator.start(context) == {"RUNNING_MODAL"}
        operator.is_ready = True
    setattr(operator, step, fail)
    with pytest.raises(RuntimeError, match="a bug"):
        operator.execute(context) if how == "now" or step == "prepare" else operator.modal(context, TIMER)
    assert operator.left == 1
    assert context.window_manager.timers == (1 if how == "in a window" and step == "prepare" else 0)


ESC = SimpleNamespace(type="ESC", value="PRESS")


def test_esc_before_the_beginning_stops_the_work(operator, context):
    operator.start(context)
    assert operator.modal(context, ESC) == {"RUNNING_MODAL"}, "nothing else may take this Esc"
    assert operator.modal(context, TIMER) == {"PASS_THROUGH"}, "what was prepared has to end first"
    operator.is_ready = True
    assert finished(operator, context) == {"CANCELLED"}
    assert operator._thread is None and operator.answers == []
    assert operator.reports == [({"WARNING"}, "stopped; nothing has changed")]
    assert (operator.left, operator.undone, context.window_manager.timers) == (1, [context.scene], 0)
    assert context.words[-1] is None


@pytest.mark.parametrize("can_be_left", [True, False])
def test_esc_during_the_work(operator, context, can_be_left):
    """Work that writes files ends by itself, since its files and the answer belong together."""
    goes_on = threading.Event()
    operator.is_ready, operator.work, operator.can_be_left = True, lambda: goes_on.wait(60) and 7, can_be_left
    operator.start(context)
    assert operator.modal(context, TIMER) == {"PASS_THROUGH"}
    operator.modal(context, ESC)
    found = operator.modal(context, TIMER)
    goes_on.set()
    if can_be_left:
        assert found == {"CANCELLED"} and operator.answers == []
        assert operator.reports == [({"WARNING"}, "stopped; nothing has changed")]
    else:
        assert found == {"PASS_THROUGH"} and "stopping" in context.words[-1]
        assert finished(operator, context) == {"FINISHED"}
        assert operator.answers == [(context.scene, 7)]
    assert (operator.left, context.window_manager.timers) == (1, 0)


def test_the_end_clears_the_status_bar_of_the_workspace_in_which_it_began(operator, context, monkeypatch):
    """A window that shows another workspace by now came back to "Record … 12 %; Esc stops it", long after the end."""
    from blender_addon.editing import waiting

    first, words = context.workspace, context.words
    known = SimpleNamespace(workspaces=[first, SimpleNamespace(status_text_set=lambda _text: None)])
    monkeypatch.setattr(
        waiting.bpy, "data", SimpleNamespace(workspaces=known.workspaces, scenes=waiting.bpy.data.scenes)
    )
    operator.start(context)
    assert words[-1] == "Work … Esc stops it"
    operator.is_ready, context.workspace = True, known.workspaces[1]
    assert finished(operator, context) == {"FINISHED"}
    assert words[-1] is None


def test_the_end_of_the_extension_ends_what_waits(operator, context, blender, monkeypatch):
    """Blender frees the operators of a class that is removed, and calls none of their functions."""
    from blender_addon.editing import waiting

    def abandoned_timer(timer):
        assert timer == "timer"
        context.window_manager.timers -= 1

    fake = SimpleNamespace(event_timer_remove=abandoned_timer)
    words = {"old": "Work …"}
    monkeypatch.setattr(
        waiting, "bpy",
        SimpleNamespace(
            context=SimpleNamespace(window_manager=fake),
            data=SimpleNamespace(workspaces=[SimpleNamespace(status_text_set=lambda text: words.update(old=text))]),
        ),
    )  # fmt: skip
    operator.start(context)
    assert waiting.is_waiting(context.scene, type(operator))
    waiting.end_all()
    assert (operator.left, operator.is_stopped, context.window_manager.timers, words["old"]) == (1, True, 0, None)
    assert not waiting.is_waiting(context.scene, type(operator))
    waiting.end_all()
    assert operator.left == 1
