# SPDX-License-Identifier: GPL-3.0-or-later
"""Time budgets by a clock that the test advances: what is traced fits in, whatever happens to the speed."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from spectral_core.render.cost import adaptive, asked, probe, rounds
from spectral_core.render.cost.errors import Wide
from spectral_core.render.cost.work import Spent
from spectral_core.render.steps import FEW_PATHS, pass_sizes
from spectral_core.render.trace.chosen_pixels import Sums
from spectral_core.scene import Camera, Film, Scene

LAUNCH_S = 0.02


class Clock:
    """Stands for the module ``time``; ``speed``: seconds of a path at a moment."""

    def __init__(self, speed):
        self.now, self.speed = 100.0, speed

    def perf_counter(self):
        return self.now


class Tracer:
    """Stands for ``ChosenPixels``: independent noise on gray, half of the picture with ten times as much."""

    band_count = 0

    def __init__(self, clock):
        self.clock, self.rng, self.launches = clock, np.random.default_rng(1), []

    def trace_halves(self, pixels, done, more):
        pixels, more = np.tile(pixels, 2), np.tile(more, 2)
        self.launches.append(int(more.sum()))
        self.clock.now += LAUNCH_S + self.clock.speed(self.clock.now) * more.sum()
        spread = np.where(pixels < 1536, 0.02, 0.2) * np.sqrt(more)
        gray = 0.4 * more + spread * self.rng.normal(size=len(pixels))
        return Sums(gray[:, None] * np.ones(3), np.zeros(len(pixels)), 0)


def _traced_until(monkeypatch, speed, budget=10.0):
    clock = Clock(speed)
    monkeypatch.setattr(adaptive, "time", clock)
    monkeypatch.setattr(rounds, "time", clock)
    tracer = Tracer(clock)
    job = SimpleNamespace(chosen_pixels=lambda: tracer, scene=SimpleNamespace(film=Film(64, 48)))
    fixed = SimpleNamespace(
        launch_s=LAUNCH_S,
        seconds_per_path=speed(0.0),
        slowness=1.0,
        wide=lambda: Wide(np.zeros(1, np.int64)),
        compared=lambda *_: None,
        rarity=lambda *_, **__: 1.0,
    )
    picture = adaptive.AdaptivePicture(job, fixed)
    rounds.until_time(picture, clock.now + budget, 8, lambda _: False)
    return picture, tracer, clock.now - 100.0


@pytest.mark.parametrize(
    ("what", "speed"),
    [
        ("even", lambda now: 1e-5),
        ("other programs start", lambda now: 1e-5 if now < 105 else 4e-5),
        ("other programs end", lambda now: 4e-5 if now < 105 else 1e-5),
        ("unsteady", lambda now: 1e-5 * (2 + np.sin(5 * now))),
    ],
)
def test_a_time_budget_is_kept_whatever_other_programs_do(monkeypatch, what, speed):
    picture, tracer, taken = _traced_until(monkeypatch, speed)
    assert 9.0 <= taken <= 10.5, what
    assert sum(tracer.launches) == 2 * picture.counts.sum()  # both halves have all their samples
    bright = picture.picture()[..., 0]
    assert bright.mean() == pytest.approx(0.4, abs=0.01)
    counts = picture.counts.reshape(48, 64)
    assert counts[24:].mean() > 2 * counts[:24].mean()  # the noisy half has more samples


def test_a_launch_without_paths_is_told_from_long_paths(monkeypatch):
    """One launch of few samples is mostly paths: of them alone, a path would seem five times shorter than it is."""
    clock = Clock(lambda now: 2e-5)

    class Meter:
        def __init__(self):
            self.begun = clock.now

        def read(self):
            return Spent(clock.now - self.begun, clock.now - self.begun)

    monkeypatch.setattr(probe, "Meter", Meter)
    tracer = Tracer(clock)
    job = SimpleNamespace(chosen_pixels=lambda: tracer, scene=SimpleNamespace(film=Film(64, 48)))
    found = probe.Probe(job)
    found.trace_to(1)
    assert found.launch_s == pytest.approx(LAUNCH_S, rel=0.05)
    assert found.seconds_per_path == pytest.approx(2e-5, rel=0.05)


def test_a_prediction_counts_the_launches_that_follow():
    """Two samples are traced by one launch and compared once, however many rounds other pictures take."""
    fixed = SimpleNamespace(launch_s=1.0)
    assert asked._beside_paths(fixed, 2.0, 0.0) == 1
    assert asked._beside_paths(fixed, 2.0, 0.5) == 1.5
    assert asked._beside_paths(fixed, 100.0, 0.0) == 2 + asked._ROUNDS


def test_a_small_picture_has_two_passes_and_a_large_one_more():
    small, large = (
        Scene(camera=Camera(world_from_camera=np.eye(4)), film=Film(*size, samples=64))
        for size in ((40, 30), (320, 200))
    )
    assert 40 * 30 * 64 <= FEW_PATHS < 320 * 200 * 64
    assert pass_sizes(small) == [1, 63]
    assert pass_sizes(large) == [1, 3, 12, 48]
