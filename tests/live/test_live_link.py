# SPDX-License-Identifier: GPL-3.0-or-later
"""The session's side of a live view: Blender's main thread waits for no copy, and the processes give way to it."""

from __future__ import annotations

import os
import threading
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core import child
from spectral_core.render.live.area import Place
from spectral_core.render.live.link import LiveLink
from spectral_core.render.live.messages import Frame
from spectral_core.render.live.running import MOST_CRASHES
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.render.process.interpreter import find_python
from spectral_core.render.process.renderer import Worker
from spectral_core.scene import Camera, Color, Film, Scene, World

PATIENCE_S = 30.0
FRAME = Frame("view", 1, Place(0, 1, 2, 2), 1, (0, 0), 1, True, 0.1, 1, "", False, 0)


class SlowArea:
    """Pixels whose copy ends when the test says so."""

    def __init__(self):
        self.is_reading, self.may_end, self.pixels = threading.Event(), threading.Event(), 10**6

    def read(self, _place):
        self.is_reading.set()
        assert self.may_end.wait(PATIENCE_S)
        return np.ones((2, 2, 4), np.float32)

    def remove(self):
        pass


@pytest.fixture
def link(monkeypatch):
    """A link with a view, and a worker that is not there."""
    link = LiveLink()
    monkeypatch.setattr(link, "_start", lambda: None)
    viewpoint = Viewpoint.of_camera(Camera(world_from_camera=np.eye(4)), Film(4, 4, samples=1))
    link.look("view", ViewRequest("stage", viewpoint, 4, 4, 1, 0), lambda: None)
    link._views["view"].area.remove()
    link._views["view"].area = SlowArea()
    link._worker = SimpleNamespace(end=lambda: None)
    return link


def copied_beside(link, act):
    """Let a picture arrive, and do ``act`` while it is copied; it must not wait for the end of the copy."""
    area, done = link._views["view"].area, threading.Event()
    reader = threading.Thread(target=link._hear, args=(link._worker, "frame", FRAME))
    reader.start()
    assert area.is_reading.wait(PATIENCE_S)
    other = threading.Thread(target=lambda: (act(), done.set()))
    other.start()
    try:
        assert done.wait(PATIENCE_S), "it waits for the copy of a picture"
    finally:
        area.may_end.set()
        reader.join(PATIENCE_S)
        other.join(PATIENCE_S)


def test_nothing_waits_for_the_copy_of_a_picture(link):
    copied_beside(link, lambda: (link.latest("view"), link.trouble("view")))
    assert link.latest("view").frame is FRAME


def test_a_picture_of_a_view_that_was_closed_meanwhile_is_dropped(link):
    copied_beside(link, lambda: link.close_view("view"))
    assert link.latest("view") is None


def test_a_picture_of_a_process_that_was_replaced_meanwhile_is_dropped(link):
    copied_beside(link, lambda: setattr(link, "_worker", SimpleNamespace(end=lambda: None)))
    assert link.latest("view") is None


def test_the_end_of_a_process_is_not_waited_for_by_others(link):
    """A process of some gigabytes takes the system a while."""
    ending, may_end = threading.Event(), threading.Event()
    worker = link._worker
    worker.end = lambda: (ending.set(), may_end.wait(PATIENCE_S))
    replacer = threading.Thread(target=link._replace, args=(worker,))
    replacer.start()
    assert ending.wait(PATIENCE_S)
    done = threading.Event()
    threading.Thread(target=lambda: (link.latest("view"), done.set()), daemon=True).start()
    assert done.wait(PATIENCE_S)
    may_end.set()
    replacer.join(PATIENCE_S)
    assert link.restarts == 1


@pytest.mark.skipif(not hasattr(os, "getpriority"), reason="priorities of this system are not asked for")
@pytest.mark.parametrize("module", ["process.worker", "live.server"])
def test_processes_run_below_the_priority_of_their_session(module):
    worker = Worker(find_python(), f"spectral_core.render.{module}", niceness=3)
    try:
        own = os.getpriority(os.PRIO_PROCESS, 0)
        assert os.getpriority(os.PRIO_PROCESS, worker.process.pid) == min(own + 3, 19)
    finally:
        worker.end()


@pytest.mark.parametrize(("is_done", "restarts"), [(False, 3), (True, 6)])
def test_crashes_are_counted_until_a_view_is_finished(link, monkeypatch, is_done, restarts):
    """A scene that crashes each process is not tried forever; a process that drew its picture is no such case."""
    monkeypatch.setattr(link, "_start", lambda: setattr(link, "_worker", SimpleNamespace(end=lambda: None)))
    area = link._views["view"].area
    area.may_end.set()
    for _ in range(6):
        link._worker = link._worker or SimpleNamespace(end=lambda: None)
        link._hear(link._worker, "frame", replace(FRAME, is_done=is_done))
        link._after_crash(link._worker, "it ended")
    assert link.restarts == restarts
    assert ("after the next change" in link.trouble("view")) is not is_done


SHORT_LIVED = """
import json, os, sys
from pathlib import Path

counted = Path(os.environ["COUNTED"])
counted.write_text(counted.read_text() + "I")
if len(counted.read_text()) <= int(os.environ["DYING"]):
    print("no module is here", file=sys.stderr, flush=True)
    os._exit(9)
sys.path[:] = json.loads(os.environ["SPECTRAL_SCENE_SYS_PATH"])
from spectral_core.render.live.server import main

main()
"""


@pytest.fixture
def dying(tmp_path, monkeypatch):
    """A function that lets the next processes of a link end before they answer; the file counts the starts."""
    module, counted = tmp_path / "short_lived.py", tmp_path / "starts"
    module.write_text(SHORT_LIVED)
    counted.write_text("")
    monkeypatch.setattr(child, "command", lambda python, _module, *rest: [python, *child.ISOLATED, str(module), *rest])

    def let(count):
        monkeypatch.setenv("COUNTED", str(counted))
        monkeypatch.setenv("DYING", str(count))
        return counted

    return let


def asked_of(link):
    """Ask for a picture of an empty scene; the link, once it has one or trouble that nothing will end."""
    film = Film(4, 4, samples=1)
    camera = Camera(world_from_camera=np.eye(4))
    link.show("stage", Scene(camera=camera, film=film, world=World(color=Color(np.ones(3)))))
    generation = link.look("view", ViewRequest("stage", Viewpoint.of_camera(camera, film), 4, 4, 1, 0), lambda: None)
    end = time.monotonic() + 4 * PATIENCE_S
    while time.monotonic() < end and not link.wait("view", generation, 0.1):
        if "after the next change" in link.trouble("view"):
            break
    return link


@pytest.mark.parametrize(("count", "is_shown"), [(2, True), (9, False)])
def test_a_process_that_ends_before_it_answers_is_started_again(dying, count, is_shown):
    """The view stayed empty until the next change."""
    counted, link = dying(count), LiveLink()
    try:
        asked_of(link)
        assert (link.latest("view") is not None) is is_shown
        assert len(counted.read_text()) == (count + 1 if is_shown else MOST_CRASHES + 1)
        assert ("no module is here" in link.trouble("view")) is not is_shown
    finally:
        link.close()
