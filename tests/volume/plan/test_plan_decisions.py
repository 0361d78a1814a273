# SPDX-License-Identifier: GPL-3.0-or-later
"""Decisions of a volume's plan, with trials whose errors and costs are written in the test: no ray is traced."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from spectral_core.volume.image import Stepping
from spectral_core.volume.pilot.rays import MOST_RAYS
from spectral_core.volume.pilot.trials import Trial
from spectral_core.volume.plan import _choose, _interval, _seen_everywhere, _stated, _tried

MIDPOINT, TABLE = Stepping("uniform", "midpoint"), Stepping("uniform", "preintegrated")
ERROR, CELLS = Stepping("error", "midpoint"), Stepping("cells", "preintegrated")


def trial(way: Stepping, snr_db: float, steps: float, **rest: Any) -> Trial:
    return Trial(way, snr_db, steps, steps, **rest)


class Answers:
    """A pilot that answers with given trials, and remembers the rival of each."""

    def __init__(self, *trials: Trial) -> None:
        self.trials = {each.stepping: each for each in trials}
        self.rivals: dict[Stepping, Trial | None] = {}
        self.tuned_again: list[tuple[Trial, float, Trial]] = []

    def tuned(self, way: Stepping, quality_db: float, within_db: float, rival: Trial | None) -> Trial:
        self.rivals[way] = rival
        return self.trials[way]

    def in_tune(self, base: Trial, quality_db: float, rival: Trial) -> Trial:
        self.tuned_again.append((base, quality_db, rival))
        return replace(base, snr_db=quality_db)


def test_the_cheapest_way_that_reaches_the_target_is_the_rival_of_the_later_ones() -> None:
    """From the last way to the first; one that is cheap because it misses the target is none."""
    dear, cheap = trial(CELLS, 55.0, 100.0), trial(TABLE, 50.0, 40.0)
    missing = trial(ERROR, 49.9, 5.0)
    ways = [MIDPOINT, TABLE, ERROR, CELLS]
    pilot = Answers(trial(MIDPOINT, 50.0, 90.0), cheap, missing, dear)
    found = _tried(pilot, ways, 50.0)  # type: ignore[arg-type]
    assert [each.stepping for each in found] == ways
    assert pilot.rivals == {CELLS: None, ERROR: dear, TABLE: dear, MIDPOINT: cheap}


def test_a_uniform_march_below_the_target_is_compared_with_the_rival_at_equal_error() -> None:
    short, good = trial(MIDPOINT, 45.0, 10.0), trial(CELLS, 51.0, 20.0)
    pilot = Answers(short, good)
    found = _tried(pilot, [MIDPOINT, CELLS], 50.0)  # type: ignore[arg-type]
    assert pilot.tuned_again == [(short, 50.0, good)]
    assert found == (replace(short, snr_db=50.0), good)
    fewest, rest = replace(short, snr_db=51.0), replace(good, snr_db=49.0)
    for first, second in ((trial(ERROR, 45.0, 10.0), good), (short, rest), (fewest, good)):
        pilot = Answers(first, second)
        assert _tried(pilot, [first.stepping, CELLS], 50.0) == (first, second)  # type: ignore[arg-type]
        assert pilot.tuned_again == []


def test_a_uniform_march_of_more_samples_than_its_rival_is_tried_with_as_few() -> None:
    """Its search ended at 1,722 samples of a hard wall; steps in tune take 575, and the rival took 1,282."""
    many, fewer = trial(MIDPOINT, 69.9, 1722.0), trial(TABLE, 62.4, 1282.0)
    pilot = Answers(many, fewer)
    found = _tried(pilot, [MIDPOINT, TABLE], 60.0)  # type: ignore[arg-type]
    assert pilot.tuned_again == [(many, 60.0, fewer)]
    assert found == (replace(many, snr_db=60.0), fewer)


def test_of_ways_that_all_miss_the_target_the_best_is_taken() -> None:
    trials = trial(MIDPOINT, 30.0, 1.0), trial(ERROR, 44.0, 9.0), trial(CELLS, 40.0, 2.0)
    assert _choose(trials, 60.0) is trials[1]


def test_another_way_replaces_uniform_midpoint_only_if_it_saves_samples_and_time() -> None:
    base = trial(MIDPOINT, 50.0, 100.0)
    saving = trial(CELLS, 50.0, 30.0)
    assert _choose((base, saving), 50.0) is saving
    many_samples, slow = replace(saving, samples=100.0), replace(saving, iteration=20.0)
    assert _choose((base, many_samples), 50.0) is base
    assert _choose((base, slow), 50.0) is base
    for factor, expected in ((0.999, True), (1.001, False)):
        fewer = replace(saving, samples=95.0 * factor)
        faster = replace(saving, begin=0.93 * base.begin, steps=93.0 * factor, samples=30.0)
        for other in (fewer, faster):
            assert (_choose((base, other), 50.0) is other) is expected
    # without uniform midpoint among those that reach the target, cost alone counts
    assert _choose((replace(base, snr_db=20.0), many_samples, trial(ERROR, 50.0, 90.0)), 50.0) is many_samples
    assert _choose((replace(base, stepping=TABLE), many_samples), 50.0) is many_samples


def test_what_a_trial_overshoots_is_subtracted_by_the_fourth_power_up_to_a_limit() -> None:
    limit = 2.0
    fine, exact = trial(CELLS, 50.0 + limit, 100.0, begin=0.0), trial(ERROR, 50.0, 0.0, begin=0.0)
    equal = 100.0 * 10 ** (-limit / 40)
    for steps, expected in ((equal * 1.01, fine), (equal * 0.99, replace(exact, steps=equal * 0.99))):
        assert _choose((fine, replace(exact, steps=steps)), 50.0) == expected
    far = replace(fine, snr_db=50.0 + 20 * limit)
    assert _choose((far, replace(exact, steps=equal * 0.99)), 50.0).stepping == ERROR


def test_the_interval_is_log_normal_and_contains_the_error_of_the_reference() -> None:
    for spread, reference_db in ((0.1, math.inf), (0.0, 70.0), (0.05, 56.0), (0.2, 40.0)):
        low, high = _interval(trial(CELLS, 50.0, 1.0, spread=spread), reference_db)
        own = min(2 * 10 ** ((50.0 - reference_db) / 20), 1.0)
        width = 10 * np.log10(np.e) * np.sqrt((1.96 * spread) ** 2 + own**2)
        assert (low, high) == pytest.approx((50.0 - width, 50.0 + width))
    assert _interval(trial(CELLS, math.inf, 1.0), 70.0) == (math.inf, math.inf)
    assert _interval(trial(CELLS, 90.0, 1.0, is_bound=True), 70.0) == (90.0, math.inf)


class Refining:
    """A pilot whose reference and number of rays grow, and what was asked of it."""

    def __init__(self, reference_db: float, count: int, spread: Callable[[int], float]) -> None:
        self.reference_db, self.count, self.quality_db, self.spread = reference_db, count, 60.0, spread
        self.done: list[str] = []
        self.is_rounded = self.is_whole = False
        self.signal_spread = 0.0

    def sharper(self) -> Refining:
        self.done.append("sharper")
        self.reference_db, self.quality_db = self.reference_db + 10.0, self.quality_db + 10.0
        return self

    def denser(self, quality_db: float) -> Refining:
        self.done.append(f"denser for {quality_db:g} dB")
        self.count *= 4
        return self

    def try_out(self, way: Stepping) -> Trial:
        return trial(way, 50.0, 1.0, spread=self.spread(self.count))

    def solve(self, way: Stepping, quality_db: float, within_db: float, *, tries: int) -> Trial:
        return trial(way, quality_db, 1.0, spread=self.spread(self.count))


def test_a_trial_as_good_as_its_reference_is_measured_against_better_ones() -> None:
    clear = 12.0
    for reference_db, expected in ((50.0 + clear, 0), (50.0 + clear - 0.1, 1), (50.0 + clear - 10.1, 2)):
        pilot = Refining(reference_db, 100, lambda _: 0.0)
        _stated(pilot, pilot.try_out(CELLS), 50.0)  # type: ignore[arg-type]
        assert pilot.done == ["sharper"] * expected
    pilot = Refining(-1000.0, 100, lambda _: 0.0)
    pilot.quality_db = 90.0 - 15.0
    _stated(pilot, pilot.try_out(CELLS), 50.0)  # type: ignore[arg-type]
    assert pilot.done == ["sharper"] * 2
    pilot = Refining(0.0, 100, lambda _: 0.0)
    _stated(pilot, trial(CELLS, math.inf, 1.0), 50.0)  # type: ignore[arg-type]
    assert pilot.done == []
    pilot = Refining(0.0, 100, lambda _: 0.0)
    pilot.is_rounded = True  # shorter steps have the same rounding
    _stated(pilot, pilot.try_out(CELLS), 50.0)  # type: ignore[arg-type]
    assert pilot.done == []


def test_rays_are_added_until_the_error_is_certain_or_there_are_enough() -> None:
    limit = 0.1
    pilot = Refining(200.0, 100, lambda count: 3.0 * limit if count < 1600 else limit)
    found = _stated(pilot, pilot.try_out(CELLS), 50.0)  # type: ignore[arg-type]
    assert pilot.done == ["denser for 60 dB"] * 2
    assert found[1].spread == limit
    pilot = Refining(200.0, MOST_RAYS // 4, lambda _: 1.0)
    _stated(pilot, pilot.try_out(CELLS), 50.0)  # type: ignore[arg-type]
    assert pilot.done == ["denser for 60 dB"]


class Sight:
    """A pilot that looks at every pixel: each way reaches 41 dB until its odd pixels are joined, then what is given."""

    is_whole, opacity, places, signal_spread = False, 9.0, SimpleNamespace(pixels=100), 0.0

    def __init__(self, true_db: dict[Stepping, float]) -> None:
        self.true_db, self.joined_ways, self.asked = true_db, [], []

    def _way(self, stepping: Stepping) -> Stepping:
        return replace(stepping, scale=1.0)

    def odd_pixels(self, best: Trial, *, always: bool) -> np.ndarray:
        self.asked.append(best.stepping)
        is_known = best.stepping in self.joined_ways or self.true_db[self._way(best.stepping)] >= 40.0
        return np.zeros((0 if is_known else 1, 2), np.int64)

    def joined(self, odd: np.ndarray) -> Sight:
        self.joined_ways.append(self.asked[-1])
        return self

    def try_out(self, stepping: Stepping) -> Trial:
        is_seen = stepping in self.joined_ways
        return trial(stepping, self.true_db[self._way(stepping)] if is_seen else 41.0, 5.0)

    def tuned(self, way: Stepping, quality_db: float, within_db: float, rival: Trial | None) -> Trial:
        cost = 5.0 if way == MIDPOINT else 50.0
        return trial(replace(way, scale=0.9 ** len(self.joined_ways)), 41.0, cost)

    def solve(self, way: Stepping, quality_db: float, within_db: float) -> Trial:
        return trial(way, 41.0, 5.0)


def test_a_way_that_is_wrong_in_other_pixels_each_time_is_left_out() -> None:
    """Each step length hit a thin film in other pixels: the third choice was never looked at."""
    ways = [MIDPOINT, CELLS]
    pilot = Sight({MIDPOINT: 12.0, CELLS: 44.0})
    start = trial(MIDPOINT, 41.0, 5.0)
    _, trials, best = _seen_everywhere(pilot, ways, (start,), start, 40.0)  # type: ignore[arg-type]
    assert best.stepping.rule == "cells" and best.snr_db == 41.0
    assert [each.rule for each in pilot.asked] == ["uniform", "uniform", "cells"]
    assert [each.stepping.rule for each in trials] == ["uniform", "cells"]


def test_if_every_choice_is_wrong_somewhere_the_best_is_stated_as_it_is() -> None:
    pilot = Sight({MIDPOINT: 12.0, CELLS: 31.0})
    start = trial(MIDPOINT, 41.0, 5.0)
    _, _, best = _seen_everywhere(pilot, [MIDPOINT, CELLS], (start,), start, 40.0)  # type: ignore[arg-type]
    assert best.stepping.rule == "cells" and best.snr_db == 31.0
    assert len(pilot.asked) == 5
