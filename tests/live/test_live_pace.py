# SPDX-License-Identifier: GPL-3.0-or-later
"""The time of launches: what is fixed, what their samples take, and the grid and the samples that follow."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render.live.area import PixelArea
from spectral_core.render.live.messages import AreaName
from spectral_core.render.live.pace import COARSEST_STRIDE, EMPTY_LAUNCHES, FIRST_STRIDE, MOST_SAMPLES, Pace
from spectral_core.render.live.picture import ViewPicture
from spectral_core.render.live.server import Server
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.scene import Scene
from tests.live import test_live_session as session
from tests.live.test_live_session import HEIGHT, WIDTH

scene = session.scene

SMALL, LARGE = 96 * 64, 960 * 540


class Machine:
    """A renderer whose launches take exactly ``fixed_s`` and ``sample_s`` for each sample of a pixel, and the number of
    its launches and their time.
    """

    def __init__(self, fixed_s: float, sample_s: float) -> None:
        self.fixed_s, self.sample_s = fixed_s, sample_s
        self.launches, self.spent_s = 0, 0.0

    def takes(self, samples: int) -> float:
        took = self.fixed_s + self.sample_s * samples
        self.launches += 1
        self.spent_s += took
        return took

    def picture(self, pace: Pace, pixels: int, samples: int) -> int:
        """Trace a picture as the server does, with no renderer; its stride."""
        stride = pace.stride(pixels)
        lanes, has, sweep, is_first = pixels // stride**2, 0, 1, True
        while has < samples:
            some = min(sweep, samples - has)
            for _ in range(stride**2):
                took = self.takes(some * lanes)
                pace.note(some * lanes, took)
                if not is_first and pace.wants_fixed(took):
                    pace.note_fixed(self.takes(0))
                is_first = False
            has, sweep = has + some, pace.sweep(some, took)
        return stride


@pytest.mark.parametrize("fixed_s", [0.03, 0.065, 0.4])
def test_a_long_fixed_time_does_not_keep_the_grid_coarse(fixed_s: float) -> None:
    """It did: blocks of 16 × 16 pixels and one sample for each launch."""
    machine, pace = Machine(fixed_s, 1e-6), Pace()
    for _ in range(3):
        machine.picture(pace, SMALL, 64)
    before = machine.launches
    assert machine.picture(pace, SMALL, 64) == 1
    assert machine.launches - before <= 40  # there were 256 for each sample
    assert pace.fixed_s == pytest.approx(fixed_s, rel=0.1)


def test_the_samples_of_a_large_view_take_no_longer_than_a_long_fixed_time() -> None:
    """No grid avoids the fixed time; a change waits for twice of it at most."""
    machine, pace = Machine(0.065, 1e-6), Pace()
    machine.picture(pace, LARGE, 4)
    assert machine.picture(pace, LARGE, 64) == 4  # 32 ms of samples; 130 ms with a step of 2
    spent, machine.spent_s = machine.spent_s, 0.0
    machine.picture(pace, LARGE, 64)
    assert spent > 0 and machine.spent_s < 3.2 * 64 * LARGE * 1e-6  # 9 times with blocks of 8 × 8


@pytest.mark.parametrize(("sample_s", "stride"), [(2e-8, 4), (4e-7, 4), (8e-7, 8), (5e-6, 8), (2e-5, 16)])
def test_a_short_fixed_time_leaves_the_grid_as_the_samples_permit(sample_s: float, stride: int) -> None:
    machine, pace = Machine(0.001, sample_s), Pace()
    assert machine.picture(pace, LARGE, 2) == FIRST_STRIDE
    assert machine.picture(pace, LARGE, 2) == stride


def test_a_fixed_time_that_was_measured_too_long_is_corrected() -> None:
    """Another program slows down all launches without samples: the next launches must not become long."""
    machine, pace = Machine(0.002, 1e-6), Pace()
    pace.note(LARGE // 16, machine.takes(LARGE // 16))
    while pace.left:
        pace.note_fixed(5.0)
    launches = []
    for _ in range(12):
        samples = LARGE // pace.stride(LARGE) ** 2
        launches.append(machine.takes(samples))
        pace.note(samples, launches[-1])
    assert max(launches) < 0.15 and sum(launch > 0.05 for launch in launches) == 1
    assert pace.stride(LARGE) == 8 and pace.fixed_s == pytest.approx(0.002)


def test_redraws_beside_launches_do_not_count_as_fixed_time() -> None:
    """Blender's redraw of each picture uses both processors: first pictures took 200 to 500 ms where this counted."""
    machine, pace = Machine(0.002, 1e-6), Pace()
    pace.note(LARGE // 16, machine.takes(LARGE // 16))
    for seconds in (0.04, 0.03, 0.06, 0.002):
        assert pace.wants_fixed(0.03)
        pace.note_fixed(seconds)
    assert (pace.fixed_s, pace.left, pace.stride(LARGE)) == (0.0, 0, 8)


def test_a_single_slow_launch_does_not_make_the_grid_coarser() -> None:
    machine, pace = Machine(0.001, 4e-7), Pace()
    machine.picture(pace, LARGE, 4)
    before = pace.stride(LARGE)
    pace.note(LARGE // 16, 3.0)
    assert pace.stride(LARGE) in (before, 2 * before)


def test_a_scene_becomes_coarser_as_its_launches_become_slower() -> None:
    pace = Pace()
    for sample_s in np.geomspace(1e-7, 1e-4, 200):
        machine = Machine(0.001, float(sample_s))
        pace.note(LARGE // 256, machine.takes(LARGE // 256))
    assert pace.stride(LARGE) == COARSEST_STRIDE
    assert pace.sweep(MOST_SAMPLES, machine.takes(MOST_SAMPLES * LARGE // 256)) == MOST_SAMPLES // 2


def test_the_server_measures_the_fixed_time_of_slow_launches_once(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The second picture of a view whose launches take long whatever their size has each pixel at once."""
    launch, empty = ViewPicture._launch, [0]

    def slow(self: ViewPicture, numbers: Any, sums: Any) -> tuple[Any, float]:
        samples = int(numbers[5]) - int(numbers[4])
        empty[0] += samples == 0
        return launch(self, numbers, sums)[0], 0.065 + 1e-6 * samples * self.columns * self.rows

    monkeypatch.setattr(ViewPicture, "_launch", slow)
    told: list[tuple[str, Any]] = []
    server = Server(told.append)
    area = PixelArea.make((WIDTH + 8) * (HEIGHT + 8))
    place = AreaName(area.path, area.pixels)
    request = ViewRequest("stage", Viewpoint.of_camera(scene.camera, scene.film), WIDTH, HEIGHT, 4, 1)
    try:
        server.hear("scene", ("stage", scene))
        server.hear("view", ("view", request, place))
        while not server.is_idle:
            server.work()
        first = area.read(told[-1][1].place)
        assert (told[0][1].level, empty[0]) == (FIRST_STRIDE, EMPTY_LAUNCHES)
        for generation in (2, 3, 4):
            told.clear()
            request = replace(request, generation=generation, exposure=generation / 2)
            server.hear("view", ("view", request, place))
            while not server.is_idle:
                server.work()
        assert (told[0][1].level, told[0][1].samples, empty[0]) == (1, 1, EMPTY_LAUNCHES)
        second = area.read(told[-1][1].place)
        assert first is not None and second is not None
        np.testing.assert_allclose(second[..., :3], 2.0 * first[..., :3], rtol=1e-5)  # the same samples
    finally:
        area.remove()
