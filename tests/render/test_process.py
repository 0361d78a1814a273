# SPDX-License-Identifier: GPL-3.0-or-later
"""The render process: equal pictures, reuse, cancel, failure, restart, and no orphan processes."""

from __future__ import annotations

import os
import signal
import struct
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError, RenderError
from spectral_core.render import Bands, RenderProcess, render_scene
from spectral_core.render.process.interpreter import find_python
from spectral_core.render.process.renderer import CANCEL_GRACE_S, Worker
from spectral_core.scene import Film, PointLight, RenderSettings
from tests.render.scenes import lit_plane, matrix

pytest.importorskip("mitsuba")
LAMP = PointLight(name="lamp", world_from_light=matrix((0, 0, 3)), power_w=100)
SMALL = lit_plane(LAMP, film=Film(8, 6, samples=5, seed=3))
PATIENCE_S = 60.0
ENDLESS = replace(SMALL, film=Film(64, 64, samples=1 << 22))


@pytest.fixture(scope="module")
def process():
    with RenderProcess() as running:
        yield running


def test_the_process_gives_the_same_pixels(process):
    steps = []
    bands = Bands.uniform(400, 700, 4)
    result = process.render(SMALL, on_progress=lambda step: steps.append(step.samples), bands=bands)
    here = render_scene(SMALL, bands=bands)
    assert result.status == "done" and result.samples == 5
    assert steps[0] == 1 and steps[-1] == 5 and steps == sorted(set(steps))
    assert np.array_equal(result.pixels, here.pixels) and np.array_equal(result.band_pixels, here.band_pixels)
    assert result.plan == here.plan and result.variant == here.variant


def test_the_process_is_reused(process):
    process.render(SMALL)
    first = process.process_id
    process.render(SMALL)
    assert process.process_id == first


def test_cancel_returns_the_finished_samples(process):
    seen = []
    result = process.render(ENDLESS, on_progress=seen.append, should_stop=lambda: bool(seen))
    assert result.status == "cancelled" and result.pixels.shape == (64, 64, 4)
    assert result.samples >= 1 and result.pixels[..., 0].max() > 0


def test_cancel_ends_soon(process):
    """Measures elapsed time with a wide margin, as the machine may be busy: the render would take hours."""
    started = []

    def stop():
        if not started and process.process_id is not None:
            started.append(time.monotonic())
        return time.monotonic() - started[0] > 0.5 if started else False

    result = process.render(replace(ENDLESS, film=Film(1024, 1024, samples=1 << 20)), should_stop=stop)
    assert result.status == "cancelled"
    assert time.monotonic() - started[0] < 0.5 + CANCEL_GRACE_S + PATIENCE_S


def test_a_killed_process_is_an_error_and_the_next_render_works(process):
    process.render(SMALL)
    victim = process.process_id

    def kill(_):
        os.kill(victim, signal.SIGKILL)

    with pytest.raises(RenderError, match="killed by signal 9"):
        process.render(ENDLESS, on_progress=kill)
    assert process.process_id is None
    assert process.render(SMALL).status == "done"
    assert process.process_id != victim


def test_a_process_that_died_between_renders_is_replaced(process):
    process.render(SMALL)
    os.kill(process.process_id, signal.SIGKILL)
    while process.process_id is not None:  # the system needs a moment, longer if it is busy
        time.sleep(0.01)
    assert process.render(SMALL).status == "done"


def test_an_error_in_the_process_is_raised_in_the_session(process):
    wrong = replace(SMALL, settings=RenderSettings(variant="vulkan"))
    with pytest.raises(InvalidInputError, match="variant 'vulkan'"):
        process.render(wrong)
    with pytest.raises(InvalidInputError, match="bounces"):
        process.render(replace(SMALL, settings=RenderSettings(overrides=(("bounces", "many"),))))
    assert process.render(SMALL).status == "done"


@pytest.mark.parametrize("module", ["spectral_core.render.process.worker", "spectral_core.render.live.server"])
def test_a_message_that_cannot_be_read_ends_the_process(module):
    """Its session waits for an answer; one that had lost its reader never gave any."""
    worker = Worker(find_python(), module)
    try:
        assert worker.process.stdin is not None
        worker.process.stdin.write(struct.pack("<IQ", 1, 3) + b"odd")
        worker.process.stdin.flush()
        assert worker.process.wait(PATIENCE_S) == 1
    finally:
        worker.end()


def test_an_exception_of_the_caller_leaves_no_pending_result(process):
    class Interrupt(Exception):
        pass

    def interrupt(_):
        raise Interrupt

    with pytest.raises(Interrupt):
        process.render(ENDLESS, on_progress=interrupt)
    assert process.render(SMALL).samples == 5


def test_an_answer_that_cannot_be_read_is_an_error_and_the_next_render_works(process, monkeypatch):
    process.render(SMALL)

    def no_memory(_stream):
        raise MemoryError("no room for 33 GB")

    monkeypatch.setattr("spectral_core.render.process.renderer.receive", no_memory)
    end = time.monotonic() + PATIENCE_S  # the render went on without end
    with pytest.raises(RenderError, match="could not be read .MemoryError: no room for 33 GB"):
        process.render(ENDLESS, should_stop=lambda: time.monotonic() > end)
    monkeypatch.undo()
    assert process.render(SMALL).samples == 5


def test_a_process_that_another_thread_closes_is_an_error_and_the_next_render_works(process):
    begun = threading.Event()
    closer = threading.Thread(target=lambda: begun.wait(PATIENCE_S) and process.close())
    closer.start()
    with pytest.raises(RenderError, match="was closed before it answered"):
        process.render(ENDLESS, on_progress=lambda _: begun.set())
    closer.join()
    assert process.render(SMALL).samples == 5


def test_the_process_ends_with_its_session(tmp_path):
    """The render process of a killed session ends."""
    script = (
        "import os, sys; from tests.render.test_process import *\n"
        "process = RenderProcess()\n"
        "process.render(ENDLESS, on_progress=lambda step: print(process.process_id, flush=True))\n"
    )
    root = Path(__file__).resolve().parents[2]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(root), *filter(None, sys.path)])}
    session = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, env=environment, cwd=root)
    child = int(session.stdout.readline())
    session.kill()
    session.wait()
    session.stdout.close()
    for _ in range(200):
        if not _runs(child):
            return
        time.sleep(0.05)
    raise AssertionError("the render process still runs 10 s after its session was killed")


def _runs(process_id):
    try:
        state = Path(f"/proc/{process_id}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state != "Z"


def test_an_interpreter_of_this_version_is_found(monkeypatch):
    assert "python" in Path(find_python()).name
    find_python.cache_clear()
    monkeypatch.setattr(sys, "executable", "/usr/bin/env")  # as inside Blender, whose executable is no Python
    assert "python" in Path(find_python()).name
    find_python.cache_clear()


def test_a_stop_that_comes_while_the_last_render_is_cleaned_up_counts(monkeypatch):
    """It was forgotten when its render began, and the session ended the process with all that it had compiled."""
    from spectral_core.render.process import worker

    heard, seen = [], []

    def collect():
        if len(seen) == 1:
            heard[0](("render", ("second", {})))
            heard[0](("stop", None))

    def answer(_tell, scene, _options, stop):
        seen.append((scene, stop.is_set()))
        if len(seen) == 2:
            raise EOFError

    def begin(hear):
        heard.append(hear)
        hear(("render", ("first", {})))
        return lambda _message: None

    monkeypatch.setattr(worker.serving, "begin", begin)
    monkeypatch.setattr(worker.gc, "collect", collect)
    monkeypatch.setattr(worker.gc, "freeze", lambda: None)
    monkeypatch.setattr(worker, "_answer", answer)
    with pytest.raises(EOFError):
        worker.main()
    assert seen == [("first", False), ("second", True)]
