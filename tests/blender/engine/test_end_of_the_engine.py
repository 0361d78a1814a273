# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension is disabled only after its renders: Blender crashes if the class of a running engine is removed."""

from __future__ import annotations

import threading
import time
from types import SimpleNamespace

import pytest

pytest.importorskip("bpy")


@pytest.fixture
def jobs(_extension, monkeypatch):
    from blender_addon import jobs

    monkeypatch.setattr(jobs, "_running", [0])
    monkeypatch.setattr(jobs, "_ending", threading.Event())
    monkeypatch.setattr(jobs, "FREE_S", 0.1)
    monkeypatch.setattr(jobs, "NEXT_S", 0.5)
    monkeypatch.setattr(jobs, "END_S", 20.0)
    return jobs


def in_a_window(monkeypatch, jobs, *, is_rendering):
    app = SimpleNamespace(background=False, is_job_running=lambda _kind: is_rendering)
    monkeypatch.setattr(jobs, "bpy", SimpleNamespace(app=app))


@pytest.mark.parametrize("calls", [1, 3])
def test_the_end_waits_for_every_call_of_the_engine(jobs, monkeypatch, calls):
    """Blender calls the engine again for the next frame or view layer."""
    in_a_window(monkeypatch, jobs, is_rendering=True)
    begun, ended = threading.Event(), []

    def render():
        for _ in range(calls):
            with jobs.under_way():
                begun.set()
                while not jobs.is_ending():
                    time.sleep(0.001)
                time.sleep(0.15)
                ended.append(time.monotonic())
            time.sleep(0.02)

    thread = threading.Thread(target=render)
    thread.start()
    begun.wait(10)
    jobs.end_renders()
    assert len(ended) == calls and time.monotonic() >= ended[-1] + 0.05
    thread.join()


def test_a_render_that_is_about_to_begin_is_awaited(jobs, monkeypatch):
    in_a_window(monkeypatch, jobs, is_rendering=True)
    ended = []

    def render():
        time.sleep(0.25)  # Blender evaluates the scene
        with jobs.under_way():
            ended.append(jobs.is_ending())

    thread = threading.Thread(target=render)
    thread.start()
    jobs.end_renders()
    assert ended == [True]
    thread.join()


def test_nothing_is_awaited_where_nothing_is_rendered(jobs, monkeypatch):
    in_a_window(monkeypatch, jobs, is_rendering=False)
    waits: list[float] = []
    monkeypatch.setattr(jobs, "time", SimpleNamespace(monotonic=time.monotonic, sleep=waits.append))
    jobs.end_renders()
    assert waits == []
