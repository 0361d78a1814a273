# SPDX-License-Identifier: GPL-3.0-or-later
"""The pilot against a renderer whose error is a power of its step: statements, spread, search, places of rays."""

from __future__ import annotations

import math
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping, palette_matrix
from spectral_core.volume.march.march_input import REFERENCE, USUAL
from spectral_core.volume.pilot import rays as module
from spectral_core.volume.pilot.places import pilot_places
from spectral_core.volume.pilot.rays import Pilot, snr_db
from spectral_core.volume.pilot.trials import Trial, cheapest, next_log_scale
from spectral_core.volume.view import View
from tests.volume.cases import two_tents


class Law:
    """A renderer with amounts 1 + error, error ∝ scale²; ``jumps``: share of rays that carry all of the error."""

    def __init__(self, *, order: float = 2.0, size: float = 0.01, share: float = 1.0, floor: float = 0.0) -> None:
        self.volume = ScalarVolume("v", np.zeros((8, 8, 8), np.uint8))
        self.types = SimpleNamespace(Float64=np.asarray)
        self.order, self.size, self.share, self.floor = order, size, share, floor
        self.calls: list[tuple[Stepping, Any]] = []

    parts = 1

    def rounding_at(self, values: np.ndarray) -> np.ndarray:
        return np.zeros(len(values))

    @property
    def sight(self) -> Law:
        return self

    def palette(self, transfer: Any) -> np.ndarray:
        return palette_matrix(transfer)

    def shown_corners(self, transfer: Any) -> np.ndarray:
        return self.volume.corners_world

    def trace(self, view: View, transfer: Any, stepping: Stepping, pixels: Any, limits: Any) -> list[np.ndarray]:
        self.calls.append((stepping, limits))
        count = len(pixels[0])
        error = self.floor + self.size * stepping.scale**self.order * (5.0 if stepping.rule == "uniform" else 1.0)
        wrong = np.arange(count) < max(1, round(self.share * count))
        amount = 1.0 + np.where(wrong, error / math.sqrt(self.share), 0.0)
        samples, steps = np.full(count, 30.0 / stepping.scale), np.full(count, 20.0 / stepping.scale)
        return [amount, np.zeros(count), np.full(count, 0.5), samples, steps]


def begun(law: Law, quality_db: float = 40.0, pixels: int = 256, count: int = 400) -> Pilot:
    view = View.around(law.volume, width=pixels, height=pixels, fov_deg=None)
    return Pilot(law, view, two_tents(), quality_db, count)


def test_a_trial_states_the_error_against_the_reference() -> None:
    law = Law()
    pilot = begun(law)
    trial = pilot.try_out(Stepping("error", "midpoint", 1.0))
    assert trial.snr_db == pytest.approx(-20 * math.log10(0.01), abs=0.3)
    assert (trial.samples, trial.steps) == (30.0, 20.0)
    assert pilot.try_out(Stepping("error", "midpoint", 1.0)) is trial  # each stepping once
    assert law.calls[-1] == (Stepping("error", "midpoint", 1.0), USUAL)
    assert trial.cost == pytest.approx(1.6 + trial.iteration * 20.0)


def test_the_reference_is_marched_until_two_agree_and_states_its_own_error() -> None:
    """Error rule first, then uniform steps of a sixteenth and less, and at last rays beside; all with the limits of
    references.
    """
    law = Law(size=0.01)
    pilot = begun(law, quality_db=60.0)
    *steppings, beside = [stepping for stepping, limits in law.calls]
    assert beside == Stepping("uniform", "preintegrated", 1 / 16)
    assert all(limits is REFERENCE for _, limits in law.calls)
    first = [s.scale for s in steppings if s.rule == "error"]
    assert first == [0.5 * 0.5**k for k in range(len(first))]
    uniform = [s.scale for s in steppings if s.rule == "uniform"]
    assert uniform == [2.0**-4 * 0.5**k for k in range(len(uniform))]
    assert {s.quadrature for s in steppings} == {"preintegrated"}

    def between(a: float, b: float) -> float:
        return -20 * math.log10(abs(a - b))

    errors = [0.01 * scale**2 for scale in first]
    agreed = [between(a, b) for a, b in pairwise(errors)]
    assert agreed[-1] > 66.0 and all(each <= 66.0 for each in agreed[:-1])
    even = [errors[-1], *(0.05 * scale**2 for scale in uniform)]
    agreed = [between(a, b) for a, b in pairwise(even)]
    assert agreed[-1] > 76.0 and all(each <= 76.0 for each in agreed[:-1])
    assert len(uniform) == 1  # the order of an agreement between two rules is not known: nothing is added to it
    assert pilot.reference_db == pytest.approx(min(agreed[-1], 90.0), abs=0.1)
    assert pilot.reference_scale == min(first[-1], uniform[-1])
    # what is better than the reference cannot be measured
    exact = pilot.try_out(Stepping("uniform", "midpoint", pilot.reference_scale))
    assert exact.snr_db == pilot.reference_db


def test_at_most_90_decibels_are_stated_and_references_end() -> None:
    assert begun(Law(size=1e-6)).reference_db == 90.0
    stubborn = Law(order=0.0, size=0.1)  # marches of any step differ alike between the rules
    pilot = begun(stubborn, quality_db=60.0)
    assert [s.scale for s, _ in stubborn.calls if s.rule == "uniform"][-1] >= REFERENCE.shortest_step / 2
    assert pilot.reference_db == math.inf  # two uniform marches agree exactly
    noisy = Law(order=0.2, size=0.1)
    begun(noisy, quality_db=60.0)
    scales = [s.scale for s, _ in noisy.calls if s.rule == "error"]
    assert 0.01 <= scales[-1] < 0.02  # halved no further than a fiftieth


@pytest.mark.parametrize("share", [1.0, 0.25, 0.01])
def test_the_spread_is_the_standard_error_of_the_sum_of_energies(share: float) -> None:
    pilot = begun(Law(share=share))
    trial = pilot.try_out(Stepping("error", "midpoint", 1.0))
    assert not pilot.is_whole and pilot.count == 400
    assert trial.spread == pytest.approx(1 / math.sqrt(max(1, round(400 * share))), rel=1e-6)
    whole = begun(Law(share=share), pixels=16)
    assert whole.is_whole and whole.try_out(Stepping("error", "midpoint", 1.0)).spread == 0.0


def test_denser_and_sharper_pilots() -> None:
    pilot = begun(Law())
    assert (pilot.denser(40.0).count, pilot.denser(30.0).quality_db) == (1600, 30.0)
    assert pilot.sharper().quality_db == 65.0 and pilot.sharper().count == 400
    assert module.PILOT_RAYS == 4096 and module.MOST_RAYS == 65536


def test_the_time_of_an_iteration_grows_with_its_work() -> None:
    """Adaptive 5 %, ends at faces 5 %, pre-integrated 5 %, and 10 % for each further packet of eight table columns."""
    pilot = begun(Law())
    columns = 2 + 0  # two materials that do not emit light
    for rule, quadrature in (
        ("uniform", "midpoint"),
        ("error", "midpoint"),
        ("error", "preintegrated"),
        ("cells", "midpoint"),
    ):
        found = pilot._iteration(Stepping(rule, quadrature, 1.0))
        entries = 2 + (3 if quadrature == "preintegrated" else 2) * columns
        expected = (
            1
            + 0.05 * (rule != "uniform")
            + 0.05 * (rule == "cells")
            + 0.05 * (quadrature == "preintegrated")
            + 0.1 * (math.ceil(entries / 8) - 1)
        )
        assert found == pytest.approx(expected)
        # And before the first one, a ray reads the value from which its first pre-integrated step begins.
        begin = pilot.try_out(Stepping(rule, quadrature, 1.0)).begin
        assert begin == pytest.approx(2.2 if quadrature == "preintegrated" else 1.6)


@pytest.mark.parametrize("target", [30.0, 47.0, 70.0])
@pytest.mark.parametrize("order", [1.0, 2.0, 3.5])
def test_the_search_ends_just_above_the_target(target: float, order: float) -> None:
    pilot = begun(Law(order=order), quality_db=target)
    found = pilot.solve(Stepping("error", "midpoint", 1.0), target, within_db=1.0)
    assert target <= found.snr_db < target + 1.0
    assert len(pilot._tried) <= 7
    exact = 10 ** (-target / 20) / 0.01
    assert found.stepping.scale <= exact ** (1 / order) * (1.5 if order == 1.0 else 1.01)


def test_a_search_without_success_returns_the_best_and_stays_within_scales() -> None:
    pilot = begun(Law(order=0.5, size=0.9), quality_db=30.0)
    found = pilot.solve(Stepping("error", "midpoint", 1.0), 60.0, within_db=1.0)
    tried = list(pilot._tried.values())
    assert found.snr_db == max(trial.snr_db for trial in tried) < 60.0
    assert min(trial.stepping.scale for trial in tried) >= 5e-3
    easy = begun(Law(order=2.0, size=1e-6), quality_db=10.0)
    coarse = easy.solve(Stepping("error", "midpoint", 1.0), 5.0, within_db=1.0)
    assert coarse.stepping.scale <= 64.0 and coarse.snr_db >= 5.0


def test_a_tuned_way_tries_coarser_steps_and_keeps_what_reaches() -> None:
    pilot = begun(Law())
    way = Stepping("uniform", "midpoint", 1.0)
    base = pilot.solve(way, 40.0, 3.0)
    before = len(pilot._tried)
    found = pilot.tuned(way, 40.0, 3.0)
    assert found.snr_db >= 40.0 and found.stepping.scale >= base.stepping.scale
    factors = sorted(s.scale / base.stepping.scale for s in list(pilot._tried)[before:])
    np.testing.assert_allclose(factors, [1.07, 1.15, 1.23, 1.32, 1.41, 1.52, 1.62, 1.74, 1.87], rtol=1e-9)
    adaptive = begun(Law())
    base = adaptive.solve(Stepping("error", "midpoint", 1.0), 40.0, 3.0)
    before = len(adaptive._tried)
    adaptive.tuned(Stepping("error", "midpoint", 1.0), 40.0, 3.0)
    np.testing.assert_allclose(
        sorted(s.scale / base.stepping.scale for s in list(adaptive._tried)[before:]), [1.12, 1.26, 1.41], rtol=1e-9
    )


def trial(scale: float, snr: float, steps: float = 10.0) -> Trial:
    return Trial(Stepping("error", "midpoint", scale), snr, steps, steps)


def test_the_cheapest_of_those_that_reach_and_the_best_of_others() -> None:
    trials = [trial(1.0, 50.0, 9.0), trial(2.0, 41.0, 5.0), trial(4.0, 30.0, 1.0)]
    assert cheapest(trials, 40.0) is trials[1]
    assert cheapest(trials, 41.0) is trials[1] and cheapest(trials, 41.1) is trials[0]
    assert cheapest(trials, 60.0) is trials[0]
    assert (trial(1, 1, 10.0).cost, Trial(Stepping("error", "midpoint", 1), 1, 1, 10, iteration=1.5).cost) == (
        11.6,
        16.6,
    )


def test_the_next_scale_at_the_limits_of_its_rules() -> None:
    decade = math.log(10)
    # one trial above: coarser at second order, by at most two e-folds
    assert next_log_scale([trial(1.0, 50.0)], 40.0) == pytest.approx(10 / 40 * decade)
    assert next_log_scale([trial(1.0, 500.0)], 40.0) == pytest.approx(2.0)
    assert next_log_scale([trial(2.0, math.inf)], 40.0) == pytest.approx(math.log(2) + 2.0)
    # interpolation on both sides keeps fifteen hundredths from either end
    both = [trial(1.0, 60.0), trial(math.e, 40.0)]
    for target, part in ((41.0, 0.85), (59.0, 0.15), (50.0, 0.5), (55.0, 0.25)):
        assert next_log_scale(both, target) == pytest.approx(part)
    assert next_log_scale([trial(1.0, math.inf), trial(math.e, 40.0)], 50.0) == pytest.approx(0.5)
    # where the finer trial is the worse one, the nearest decides
    odd = [trial(1.0, 30.0), trial(2.0, 44.0)]
    assert next_log_scale(odd, 40.0) == pytest.approx(math.log(2) + 4 / 40 * decade)
    # none reaches it: the slope at the fine end, at most two and a half times the second-order distance
    for slope_db, factor in ((-5.0, 2.5), (-20.0, 2.0), (-80.0, 0.5), (-200.0, 0.5), (+5.0, 2.5)):
        below = [trial(1.0, 20.0), trial(10.0, 20.0 + slope_db)]
        left = min(10.0, 10.0 - slope_db)
        expected = -min(2.0, left / 40 * decade * factor)
        assert next_log_scale(below, 30.0) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("fov", [None, 40.0])
def test_rays_lie_over_the_projection_of_the_field(fov: float | None) -> None:
    volume = ScalarVolume("v", np.zeros((8, 8, 8), np.uint8))
    view = View.looking((30, 3.5, 3.5), (3.5, 3.5, 3.5), width=200, height=100, fov_deg=fov, ortho_width=40.0)
    x, y, is_whole = pilot_places(view, volume.corners_world, 512)
    if fov is None:
        half = (4 / 40 * 200, 4 / 40 * 200)
    else:
        focal = 100 / math.tan(math.radians(20))
        half = (4 / (30 - 7.5) * focal,) * 2
    assert not is_whole and len(x) == 512
    for place, center, reach, size in ((x, 100, half[0], 200), (y, 50, half[1], 100)):
        low, high = max(0, center - reach), min(size, center + reach)
        assert low <= place.min() < low + 0.05 * (high - low) and high - 0.05 * (high - low) < place.max() <= high
        assert np.mean(place) == pytest.approx(center, abs=0.02 * size)
        counts = np.histogram(place, 8, (low, high))[0]
        assert counts.min() > 50 and counts.max() < 78


def test_few_pixels_are_all_taken_in_tiles() -> None:
    volume = ScalarVolume("v", np.zeros((8, 8, 8), np.uint8))
    view = View.looking((30, 3.5, 3.5), (3.5, 3.5, 3.5), width=40, height=20, fov_deg=None, ortho_width=40.0)
    x, y, is_whole = pilot_places(view, volume.corners_world, 60)
    assert is_whole and len(x) == 64  # up to three tenths more than requested
    assert {(a, b) for a, b in zip(x, y, strict=True)} == {
        (c + 0.5, r + 0.5) for c in range(16, 24) for r in range(6, 14)
    }
    assert np.ptp(x[:16]) <= 7 and np.ptp(y[:4]) <= 3
    assert not pilot_places(view, volume.corners_world, 49)[2]
    # a camera inside the field looks at the whole picture
    inside = View.looking((3, 3, 3), (5, 5, 5), width=100, height=100)
    x, y, is_whole = pilot_places(inside, volume.corners_world, 256)
    assert not is_whole and x.min() < 3 and x.max() > 97 and y.min() < 3 and y.max() > 97
    away = View.looking((30, 3.5, 3.5), (60, 3.5, 3.5), width=100, height=100)
    assert len(pilot_places(away, volume.corners_world, 256)[0]) > 0


def test_signal_to_noise() -> None:
    assert snr_db(np.array([3.0, 4.0]), np.array([0.3, 0.4])) == pytest.approx(20.0)
    assert snr_db(np.ones(2), np.zeros(2)) == math.inf and snr_db(np.zeros(2), np.ones(2)) == -math.inf
    assert snr_db(np.zeros(2), np.zeros(2)) == math.inf
