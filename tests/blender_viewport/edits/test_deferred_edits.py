# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits that wait for a timer are answered before Blender draws them, once, and finished after a rest."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")


class Timers:
    """A stand-in for Blender's timers, which need a window."""

    def __init__(self) -> None:
        self.waiting: dict[object, float] = {}

    def register(self, timer, first_interval):
        self.waiting[timer] = first_interval

    def unregister(self, timer):
        del self.waiting[timer]

    def is_registered(self, timer):
        return timer in self.waiting


@pytest.fixture
def window(blender, monkeypatch):
    """Timers of a session with a window; ``renders`` becomes true during a render."""
    from blender_addon.editing import deferred

    state = SimpleNamespace(timers=Timers(), renders=False)
    app = SimpleNamespace(background=False, timers=state.timers, is_job_running=lambda _kind: state.renders)
    monkeypatch.setattr(deferred, "bpy", SimpleNamespace(app=app, data=bpy.data, types=bpy.types, context=bpy.context))
    return state


def test_an_edit_is_answered_before_it_is_drawn(window):
    from blender_addon.editing.deferred import Deferred

    done: list[str] = []
    scene = bpy.context.scene
    work = Deferred(
        lambda _scene: done.append("followed"), lambda _scene: done.append("finished"),
        delay_seconds=0.005, rest_seconds=0.3,
    )  # fmt: skip
    work.flush(scene)
    assert not done, "nothing was edited"
    work.request(scene)
    work.request(scene)
    assert not done, "further edits of the same event are answered together"
    window.renders = True
    work.flush(scene)
    assert not done, "a render reads the same data"
    window.renders = False
    work.flush(scene)
    work.flush(scene)
    assert done == ["followed"]
    ((timer, seconds),) = window.timers.waiting.items()
    assert seconds == 0.3
    assert timer() is None
    assert done == ["followed", "finished"]


def test_the_palette_is_solved_when_blender_evaluates_an_edit(window, monkeypatch):
    from blender_addon.editing.palette import live

    solved: list[str] = []
    monkeypatch.setattr(live.LIVE, "_follow", lambda scene: solved.append(scene.name))
    bpy.ops.spectral.palette_preset(preset="METAMER_PAIR")
    scene = bpy.context.scene
    palette = scene.spectral.palette
    palette.live = True
    solved.clear()
    palette.materials[0].cells[0].target = (0.3, 0.4, 0.5)
    assert not solved
    scene.update_tag()
    bpy.context.view_layer.update()
    assert solved == [scene.name]
    live.LIVE.cancel()
