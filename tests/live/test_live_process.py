# SPDX-License-Identifier: GPL-3.0-or-later
"""How a link runs its process: starts that fail, answers and messages that fail, what a new process is sent."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render.live import link as link_module
from spectral_core.render.live.link import LiveLink
from spectral_core.render.live.messages import Trouble
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.scene import Camera, Film, Scene
from tests.live import test_live_link as linked
from tests.live.test_live_link import FRAME, PATIENCE_S

link = linked.link


class Fake:
    """A process that a test answers for: ``answer`` gives its next message, or raises an error."""

    def __init__(self, answer=lambda: None, *, refused=""):
        self.answer, self.refused, self.alive = answer, refused, True
        self.posted, self.is_busy = [], threading.Event()

    def next_message(self, wait_s):
        message = self.answer()
        if message is None:
            self.is_busy.wait(0.01)
        return message

    def post(self, message):
        if message[0] == self.refused:
            raise TypeError("cannot pickle a test")
        self.posted.append(message)

    def end(self):
        self.alive = False


def failing(error):
    def fail(*_):
        raise error

    return fail


@pytest.fixture
def faked(monkeypatch):
    """A function that gives a link whose processes are the given ones, one after another; an error is raised."""
    links = []

    def make(*workers):
        left = list(workers)

        def start(*_, **__):
            worker = left.pop(0)
            if isinstance(worker, Exception):
                raise worker
            return worker

        monkeypatch.setattr(link_module, "Worker", start)
        links.append(LiveLink("python"))
        return links[0]

    yield make
    for link in links:
        link.close()


def looked(link, view="view", width=4):
    viewpoint = Viewpoint.of_camera(Camera(world_from_camera=np.eye(4)), Film(4, 4, samples=1))
    return link.look(view, ViewRequest("stage", viewpoint, width, 4, 1, 0), lambda: None)


def until(holds):
    end = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < end, "it never came true"
        time.sleep(0.005)


def kinds(worker):
    return [kind for kind, _ in worker.posted]


def test_a_start_that_fails_in_an_unforeseen_way_is_said_and_tried_again(faked):
    """The view waited for a process that nothing started."""
    worker = Fake()
    link = faked(OSError(28, "No space left on device"), worker)
    looked(link)
    until(lambda: "No space left on device" in link.trouble("view"))
    assert "the next change tries again" in link.trouble("view")
    looked(link)
    until(lambda: "view" in kinds(worker))
    assert link.trouble("view") == ""


def test_a_system_without_another_thread_is_said_and_asked_again(faked, monkeypatch):
    worker = Fake()
    link = faked(worker)
    with monkeypatch.context() as patched:
        patched.setattr(threading.Thread, "start", failing(RuntimeError("can't start new thread")))
        looked(link)
    assert "can't start new thread" in link.trouble("view")
    looked(link)
    until(lambda: "view" in kinds(worker))


@pytest.mark.parametrize("answer", [failing(ValueError("no message")), lambda: ("frame", "no picture")])
def test_answers_that_cannot_be_read_count_as_a_crash(faked, answer):
    """Nobody read the answers of the process any more, and the view stayed as it was."""
    first, second = Fake(answer), Fake()
    link = faked(first, second)
    looked(link)
    until(lambda: "view" in kinds(second))
    until(lambda: not first.alive)
    assert link.restarts == 1
    assert "could not be read" in link.trouble("view") and "started again" in link.trouble("view")


def test_a_message_that_cannot_be_sent_counts_as_a_crash(faked):
    first, second = Fake(refused="view"), Fake()
    link = faked(first, second)
    looked(link)
    until(lambda: "view" in kinds(second))
    until(lambda: not first.alive)
    assert link.restarts == 1
    assert "'view' could not be sent" in link.trouble("view")


def test_a_view_that_cannot_be_drawn_does_not_end_the_reading(link):
    link._views["view"].area.may_end.set()
    link._views["view"].on_news = failing(ReferenceError("its engine is gone"))
    link._hear(link._worker, "frame", FRAME)
    link._say("it ended")
    assert link.latest("view").frame is FRAME and link.trouble("view") == "it ended"


def test_trouble_of_an_earlier_request_is_not_shown(link):
    """The process tells it of a view whose file the session has deleted, because it has closed or enlarged the view."""
    link._hear(link._worker, "trouble", Trouble("view", 0, "its file is gone"))
    assert link.trouble("view") == ""
    link._hear(link._worker, "trouble", Trouble("view", 1, "it is too dark"))
    assert link.trouble("view") == "it is too dark"


def test_a_scene_whose_change_was_lost_is_sent_anew(faked):
    lost = [("lost", "closed"), ("lost", "stage")]
    worker = Fake(lambda: lost.pop(0) if lost else None)
    link = faked(worker)
    scene = Scene(camera=Camera(world_from_camera=np.eye(4)), film=Film(4, 4, samples=1))
    link.show("stage", scene)
    looked(link)
    until(lambda: kinds(worker).count("scene") == 2)
    assert [content for kind, content in worker.posted if kind == "scene"] == [("stage", scene)] * 2


def test_pauses_are_sent_once_and_to_a_new_process_before_the_view(faked):
    is_broken = threading.Event()
    first, second = Fake(lambda: failing(ValueError("it broke"))() if is_broken.is_set() else None), Fake()
    link = faked(first, second)
    link.pause("view", is_paused=True)  # nothing was asked for, and nothing is traced
    looked(link)
    until(lambda: kinds(first) == ["view"])
    for is_paused in (False, True, True):
        link.pause("view", is_paused=is_paused)
    until(lambda: first.posted[1:] == [("pause", ("view", True))])
    looked(link, width=400)  # the pause stays with a larger area
    until(lambda: kinds(first)[-1] == "view")
    is_broken.set()
    until(lambda: "view" in kinds(second))
    assert kinds(second) == ["pause", "view"]
    link.pause("view", is_paused=False)
    until(lambda: second.posted[-1] == ("pause", ("view", False)))


def test_a_view_keeps_its_pixels_if_a_larger_area_cannot_be_made(faked, monkeypatch):
    link = faked(Fake())
    looked(link)
    before = link._views["view"]
    monkeypatch.setattr(link_module.PixelArea, "make", failing(OSError(28, "No space left on device")))
    with pytest.raises(OSError, match="No space"):
        looked(link, width=400)
    assert link._views["view"] is before and Path(before.area.path).exists() and not before.area._map.closed
