# SPDX-License-Identifier: GPL-3.0-or-later
"""Waits in one round of Blender's events count as one pause; the next round begins anew."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

pytest.importorskip("bpy")


@pytest.fixture
def window(monkeypatch):
    """The module in a session with a window, with a clock and timers that the test runs."""
    from blender_addon.editing import pauses

    clock, timers = SimpleNamespace(now=5.0), []
    app = SimpleNamespace(background=False, timers=SimpleNamespace(
        is_registered=lambda call: call in timers,
        register=lambda call, persistent: timers.append(call),
    ))  # fmt: skip
    monkeypatch.setattr(pauses, "bpy", SimpleNamespace(app=app))
    monkeypatch.setattr(pauses, "time", SimpleNamespace(monotonic=lambda: clock.now))
    monkeypatch.setattr(pauses, "_paused", [0.0])
    monkeypatch.setattr(pauses, "_by_timers", [0.0])
    return SimpleNamespace(pauses=pauses, clock=clock, timers=timers, app=app)


def waited(window, seconds):
    with window.pauses.pause():
        window.clock.now += seconds


def test_pauses_of_a_round_add_up_and_the_next_round_begins_anew(window):
    waited(window, 0.25)
    window.clock.now += 1.0  # Blender's own work
    waited(window, 0.5)
    assert window.pauses.paused_seconds() == 0.75
    (next_round,) = window.timers
    assert next_round() is None  # Blender drops the timer
    assert window.pauses.paused_seconds() == 0.0


def test_a_block_that_fails_counts_too(window):
    with pytest.raises(ZeroDivisionError), window.pauses.pause():
        window.clock.now += 0.5
        raise ZeroDivisionError
    assert window.pauses.paused_seconds() == 0.5


def test_without_a_window_nothing_is_counted(window):
    window.app.background = True
    waited(window, 0.5)
    assert window.pauses.paused_seconds() == 0.0 and not window.timers


def test_a_pause_within_another_counts_once(window):
    with window.pauses.pause():
        window.clock.now += 0.25
        waited(window, 0.5)
        assert window.pauses.paused_seconds() == 0.75
    assert window.pauses.paused_seconds() == 0.75


def test_the_pause_of_a_timer_counts_in_the_round_that_it_begins(window):
    waited(window, 0.5)
    (next_round,) = window.timers
    with window.pauses.pause(of_timer=True):  # Blender calls it before the timer that ends the round before
        window.clock.now += 0.25
    assert next_round() == 0.0 and window.pauses.paused_seconds() == 0.25
    assert next_round() is None and window.pauses.paused_seconds() == 0.0
