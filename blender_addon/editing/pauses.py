# SPDX-License-Identifier: GPL-3.0-or-later
"""Waits of the interface within one round of Blender's event loop: for the artist they are one pause.

A wanted color may wait for its solver, and the redraw of each view for its picture, before Blender takes the next
event.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

import bpy

_paused = [0.0]


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
