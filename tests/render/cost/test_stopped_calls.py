# SPDX-License-Identifier: GPL-3.0-or-later
"""A plan or a cost curve that nobody wants any more ends at once, and the process serves the next request."""

from __future__ import annotations

import time

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.errors import RenderCancelled
from spectral_core.render.process.renderer import RenderProcess
from spectral_core.scene import Camera, Film, Scene


def empty_scene() -> Scene:
    return Scene(camera=Camera(world_from_camera=np.eye(4)), film=Film(8, 8, samples=1))


@pytest.mark.parametrize("name", ["plan", "cost_curve"])
def test_a_stop_ends_the_work_within_a_moment(name: str) -> None:
    with RenderProcess() as process:
        worker = process._running()
        answered: list[int] = []

        def never(_wait_s: float) -> None:  # a process that works for hours
            answered.append(1)
            time.sleep(0.005)

        worker.next_message = never
        began = time.monotonic()
        with pytest.raises(RenderCancelled, match="stopped"):
            getattr(process, name)(empty_scene(), should_stop=lambda: len(answered) >= 3)
        assert time.monotonic() - began < 5
        assert not worker.alive and not process.is_busy
        assert process._running() is not worker


def test_a_stop_before_its_turn_starts_nothing() -> None:
    with RenderProcess() as process:
        with pytest.raises(RenderCancelled):
            process.plan(empty_scene(), should_stop=lambda: True)
        assert process.process_id is None
