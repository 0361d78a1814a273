# SPDX-License-Identifier: GPL-3.0-or-later
"""Work and waits of the interface within one round of Blender's event loop: for the artist they are one pause.

A wanted color may wait for its solver, an operator reads the scene, and the redraw of each view waits for its picture,
before Blender takes the next event. While a thread of the extension computes, Python lets the main thread wait for it,
too, after each wait and each large operation of NumPy: 5 ms by default.
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
_by_timers = [0.0]
"""Time of pauses by timers which the end of the round before must not take away."""
_open: list[float] = []
"""Time on the clock at which each open pause began, the outermost first."""
_usual: list[float] = []
_round = [0]
"""Number of rounds with pauses so far."""


def paused_seconds() -> float:
    """Time of all pauses of this round, of one that is not over, too."""
    return _paused[0] + (time.monotonic() - _open[0] if _open else 0.0)


def round_number() -> int | None:
    """Number of this round of Blender's events, in which the extension has paused; None without a window."""
    return None if bpy.app.background else _round[0]


@contextmanager
def pause(*, of_timer: bool = False) -> Iterator[None]:
    """Add the time of a block to the pauses of this round; a pause within another one counts once.

    ``of_timer``: True if a timer runs the block. Blender calls its timers one after another at the beginning of a
    round, and the one that ends the round before may be the last of them.
    """
    _open.append(time.monotonic())
    try:
        yield
    finally:
        began = _open.pop()
        if not _open and not bpy.app.background:  # in the background there are no rounds
            _add(time.monotonic() - began, of_timer)


def _add(seconds: float, of_timer: bool) -> None:
    _paused[0] += seconds
    if not bpy.app.timers.is_registered(_next_round):
        bpy.app.timers.register(_next_round, persistent=True)
    elif of_timer:
        _by_timers[0] += seconds


def _next_round() -> float | None:
    """Blender calls its timers at the beginning of each round."""
    _round[0] += 1
    _paused[0], _by_timers[0] = _by_timers[0], 0.0
    return 0.0 if _paused[0] else None


def register() -> None:
    """Let the main thread wait less for other threads."""
    _usual[:] = [sys.getswitchinterval()]
    sys.setswitchinterval(min(SWITCH_S, _usual[0]))


def unregister() -> None:
    """Restore Python's setting."""
    if _usual:
        sys.setswitchinterval(_usual.pop())
