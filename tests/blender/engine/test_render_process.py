# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages and exit status in Blender if the renderer is killed, or is cancelled."""

from __future__ import annotations

import os
import re
import signal
import time

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")


@pytest.fixture
def endless(build):
    """A scene whose render would take hours."""
    from blender_addon import jobs

    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL"
    scene.render.resolution_x, scene.render.resolution_y = 32, 32
    scene.spectral.render.samples = 1 << 22
    build.plane(material=build.material())
    build.light("POINT")
    build.camera()
    jobs.records.clear()
    return scene


@pytest.fixture
def shown(monkeypatch):
    """A growing list of the number of samples of each displayed picture."""
    from blender_addon import engine

    seen = []
    write = engine.SpectralRenderEngine._write

    def watch(self, pixels, layer, *rest, **options):
        seen.append(time.monotonic())
        return write(self, pixels, layer, *rest, **options)

    monkeypatch.setattr(engine.SpectralRenderEngine, "_write", watch)
    return seen


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="kill -9 is a POSIX thing")
def test_kill_9_is_an_error_and_the_next_render_works(endless, shown, monkeypatch):
    from blender_addon import engine, jobs

    def kill_once_something_is_shown(self):
        if len(shown) == 2:
            os.kill(jobs.process.process_id, signal.SIGKILL)
            shown.append(0.0)
        return False

    monkeypatch.setattr(engine.SpectralRenderEngine, "_should_stop", kill_once_something_is_shown)
    with pytest.raises(RuntimeError, match=r"render process was killed by signal 9.*rendering again starts a new one"):
        bpy.ops.render.render()
    assert [record.status for record in jobs.records] == ["failed"]
    endless.spectral.render.samples = 2
    bpy.ops.render.render()
    assert jobs.records[-1].status == "done" and jobs.records[-1].samples == 2


def test_cancel_keeps_the_rendered_samples_and_ends_soon(endless, shown, monkeypatch):
    from blender_addon import engine, jobs

    asked = []

    def stop(self):
        if len(shown) >= 3 and not asked:
            asked.append(time.monotonic())
        return bool(asked)

    monkeypatch.setattr(engine.SpectralRenderEngine, "_should_stop", stop)
    bpy.ops.render.render()
    answered = time.monotonic()
    record = jobs.records[-1]
    assert record.status == "cancelled" and record.samples >= 3
    assert np.isfinite(record.result.pixels).all() and record.result.pixels[..., :3].any()
    assert answered - asked[0] < 60, "half a second is promised past the pass in flight; this only guards against hours"


def test_a_render_tells_samples_time_left_and_memory(endless, monkeypatch):
    from blender_addon import engine

    texts, usual = [], engine._state
    monkeypatch.setattr(engine, "_state", lambda progress: texts.append(usual(progress)) or texts[-1])
    endless.spectral.render.samples = 8
    bpy.ops.render.render()
    assert len(texts) > 1 and re.fullmatch(r"Sample 8/8 \| \d+\.\d s \| 0 s left \| \d+ MB", texts[-1])
    assert int(texts[-1].split()[-2]) > 100, "a process with Mitsuba is larger"
