# SPDX-License-Identifier: GPL-3.0-or-later
"""Time budgets by a clock that the test advances: what is traced fits in, whatever happens to the speed."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from spectral_core.render.cost import adaptive, asked, probe, rounds
from spectral_core.render.cost.errors import Wide, expected_errors
from spectral_core.render.cost.work import Spent
from spectral_core.render.passes import finish
from spectral_core.render.steps import FEW_PATHS, pass_sizes
from spectral_core.render.trace.chosen_pixels import Sums
from spectral_core.scene import Camera, Film, Passes, RenderSettings, Scene
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb

LAUNCH_S = 0.02


class Clock:
    """Stands for the module ``time``; ``speed``: seconds of a path at a moment."""

    def __init__(self, speed):
        self.now, self.speed = 100.0, speed

    def perf_counter(self):
        return self.now


HALF_NOISY = np.where(np.arange(64 * 48) < 1536, 0.02, 0.2)


class Tracer:
    """Stands for ``ChosenPixels``: independent noise on gray, half of the picture with ten times as much."""

    band_count = 0

    def __init__(self, clock, deviations=HALF_NOISY, seed=1):
        self.clock, self.rng, self.launches = clock, np.random.default_rng(seed), []
        self.deviations = deviations

    def trace_halves(self, pixels, done, more, parts=1):
        pixels, more = np.tile(pixels, 2 * parts), np.tile(more, 2 * parts)
        self.launches.append(int(more.sum()))
        self.clock.now += LAUNCH_S + self.clock.speed(self.clock.now) * more.sum()
        spread = self.deviations[pixels] * np.sqrt(more)
        gray = 0.4 * more + spread * self.rng.normal(size=len(pixels))
        return Sums(gray[:, None] * np.ones(3), np.zeros(len(pixels)), 0)


def _picture(tracer, size=(64, 48)):
    job = SimpleNamespace(
        chosen_pixels=lambda: tracer, scene=Scene(camera=Camera(world_from_camera=np.eye(4)), film=Film(*size))
    )
    fixed = SimpleNamespace(
        launch_s=LAUNCH_S,
        seconds_per_path=tracer.clock.speed(0.0),
        slowness=1.0,
        wide=lambda: Wide(np.zeros(1, np.int64)),
        compared=lambda *_: None,
        seen=lambda *_, **__: None,
        rarity=lambda *_, **__: 1.0,
    )
    return adaptive.AdaptivePicture(job, fixed)


class SteepTracer(Tracer):
    """A second sample of a pixel takes away five sixths of the noise of the first, as in sampled volumes."""

    def __init__(self, clock):
        super().__init__(clock, np.full(48 * 36, 0.2))
        self.first = self.rng.normal(size=(2, 48 * 36)) * self.deviations

    def trace_halves(self, pixels, done, more, parts=1):
        sums = super().trace_halves(pixels, done, more, parts)
        noise = self.first[:, pixels] * np.select([done + more == 1, done == 0], [1.0, 1 / 3], -2 / 3)
        start = done + np.zeros(len(pixels), np.int64)
        noise = np.where((start < 2)[None], noise, 0.0)
        gray = 0.4 * np.tile(np.broadcast_to(more, len(pixels)), 2) + noise.ravel()
        return Sums(gray[:, None] * np.ones(3), sums.covered, 0)


@pytest.mark.parametrize("part", [0.99, 0.95, 0.9, 0.7, 0.5, 0.3])
def test_a_remainder_is_met_with_few_tiles_where_the_error_falls_steeply(part):
    picture = _picture(SteepTracer(Clock(lambda now: 1e-5)), (48, 36))
    begun = []
    rounds.until_error(picture, 1e3, 1, lambda found: bool(begun.append(found.delta_e)))
    picture = _picture(SteepTracer(Clock(lambda now: 1e-5)), (48, 36))
    found = rounds.until_error(picture, part * begun[0], 1, lambda _: False, lambda _: -2.6)
    assert 0.75 * part * begun[0] < found.delta_e <= part * begun[0]


@pytest.mark.parametrize("part", [0.45, 0.35])
def test_no_tile_of_little_error_is_doubled_while_steep_ones_remain(part):
    begun = []
    picture = _picture(SteepTracer(Clock(lambda now: 1e-5)), (48, 36))
    rounds.until_error(picture, 1e3, 1, lambda found: bool(begun.append(found.delta_e)))
    picture = _picture(SteepTracer(Clock(lambda now: 1e-5)), (48, 36))
    law = lambda samples: -2.6 if samples < 3 else -0.65  # noqa: E731
    found = rounds.until_error(picture, part * begun[0], 1, lambda _: False, law)
    assert 0.85 * part * begun[0] < found.delta_e <= part * begun[0]
    assert picture.counts.max() == 2


def _traced_until(monkeypatch, speed, budget=10.0):
    clock = Clock(speed)
    monkeypatch.setattr(adaptive, "time", clock)
    monkeypatch.setattr(rounds, "time", clock)
    tracer = Tracer(clock)
    picture = _picture(tracer)
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


def _traced(monkeypatch, samples, size, deviations, seed=1):
    """A picture of ``samples`` of each half."""
    clock = Clock(lambda now: 1e-5)
    monkeypatch.setattr(adaptive, "time", clock)
    picture = _picture(Tracer(clock, deviations, seed), size)
    picture.divide(samples)
    picture.add(np.full(size[0] * size[1], samples))
    return picture


def _error(pixels):
    lab = [lab_from_linear_rgb(np.maximum(each, 0)) for each in (pixels, np.full(3, 0.4))]
    return float(delta_e_2000(*lab).mean())


@pytest.mark.parametrize(("samples", "told_well"), [(11, False), (16, True)])
def test_later_samples_tell_the_error_of_a_picture_from_a_few_on(monkeypatch, samples, told_well):
    """Columns of little and of much noise in turn: neighbors lend theirs to the quiet ones."""
    deviations = np.where(np.arange(64 * 48) % 2, 0.4, 0.004)
    picture = _traced(monkeypatch, samples // 4, (64, 48), deviations)
    picture.remember()
    picture.add(np.full(64 * 48, samples - samples // 4))
    true = _error(picture.halves().mean(axis=0))
    assert expected_errors(picture.halves(), picture._pools, picture._wide).mean() > 1.25 * true
    assert (0.93 * true < picture.estimate().delta_e < 1.1 * true) == told_well


def test_the_parts_of_a_small_picture_tell_its_error(monkeypatch):
    """A hundred pixels in two halves tell the error to a tenth, eight parts of each half to a thirtieth."""
    noise = np.random.default_rng(0).normal(size=(20000, 1)) * np.ones(3)
    expected = _error(0.4 + 0.3 / np.sqrt(128) * noise)
    pictures = [_traced(monkeypatch, 64, (12, 9), np.full(108, 0.3), seed) for seed in range(12)]
    assert all(len(picture._sums) == 8 and np.all(picture.counts == 64) for picture in pictures)
    ratios = [picture.errors().mean() / expected for picture in pictures]
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.05) and np.std(ratios) < 0.05
    assert pictures[0].picture()[..., 0].mean() == pytest.approx(0.4, abs=0.02)


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
    job = SimpleNamespace(
        chosen_pixels=lambda: tracer, scene=Scene(camera=Camera(world_from_camera=np.eye(4)), film=Film(64, 48))
    )
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
    assert pass_sizes(small) == [1, 63] and pass_sizes(small, watched=False) == [64]
    assert pass_sizes(large) == pass_sizes(large, watched=False) == [1, 3, 12, 48]


@pytest.mark.parametrize("speed", [lambda now: 1e-3, lambda now: 1e-3 if now < 104 else 4e-3, lambda now: 0.4])
def test_the_light_of_passes_is_traced_as_long_as_there_is_time(monkeypatch, speed):
    """It was traced again with all samples of the picture: 4 s requested with light passes took 20 s."""
    clock, traced = Clock(speed), []
    monkeypatch.setattr(finish, "time", clock)

    def trace(samples):
        traced.append(samples)
        clock.now += LAUNCH_S + speed(clock.now) * samples

    finish._trace_until(SimpleNamespace(trace=trace), 100_000, 110.0)
    assert 109.0 <= clock.now <= 110.5 and len(traced) < 40
    traced.clear()
    finish._trace_until(SimpleNamespace(trace=trace), 3, clock.now + 1e6)
    assert sum(traced) == 3
    finish._trace_until(SimpleNamespace(trace=trace), 7, None)
    assert traced[-1] == 7


def test_light_passes_take_half_of_a_requested_time():
    def share(passes, budget):
        settings = RenderSettings(time_budget_s=budget, passes=passes)
        camera = Camera(world_from_camera=np.eye(4))
        return asked.time_of_picture(Scene(camera=camera, film=Film(8, 8), settings=settings))

    assert [share(each, 8.0) for each in (None, Passes(("Depth",)), Passes(("Diffuse Direct",)))] == [8.0, 8.0, 4.0]
    assert share(Passes((), light_groups=("key",)), 8.0) == 4.0 and share(Passes(("Diffuse Direct",)), None) is None
