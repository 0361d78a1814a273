# SPDX-License-Identifier: GPL-3.0-or-later
"""Waits of the interface within one round of Blender's event loop: for the artist they are one pause.

A wanted color may wait for its solver, and the redraw of each view for its picture, before Blender takes the next
event. While a thread of the extension computes, Python lets the main thread wait for it, too, after each wait and each
large operation of NumPy: 5 ms by default.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import bpy

SWITCH_S = 0.001
"""Longest time for which a thread that runs Python keeps the main thread waiting."""
_paused = [0.0]
_usual: list[float] = []


def paused_seconds() -> float:
    """Time of all pauses of this round."""
    return _paused[0]


@contextmanager
def pause() -> Iterator[None]:
    """Add the time of a block to the pauses of this round. One pause is not within another."""
    began = time.monotonic()
    try:
        yield
    finally:
        if not bpy.app.background:  # otherwise there are no rounds
            _paused[0] += time.monotonic() - began
            _end_with_round()


def _end_with_round() -> None:
    if not bpy.app.timers.is_registered(_next_round):
        bpy.app.timers.register(_next_round, persistent=True)


def _next_round() -> None:
    """Blender calls its timers at the beginning of each round."""
    _paused[0] = 0.0


def register() -> None:
    """Let the main thread wait less for other threads."""
    _usual[:] = [sys.getswitchinterval()]
    sys.setswitchinterval(min(SWITCH_S, _usual[0]))


def unregister() -> None:
    """Restore Python's setting."""
    if _usual:
        sys.setswitchinterval(_usual.pop())
