# SPDX-License-Identifier: GPL-3.0-or-later
"""The search for a step: where the next trial lies, and where a search ends because another way is better."""

import math

import pytest

from spectral_core.volume.image import Stepping
from spectral_core.volume.pilot.rays import Pilot
from spectral_core.volume.pilot.trials import Trial, falls_behind, finest_worth, is_beaten, next_log_scale


def trial(scale: float, snr_db: float, *, steps: float = 10.0, samples: float = 8.0) -> Trial:
    return Trial(Stepping("uniform", "midpoint", scale), snr_db, samples, steps)


def test_one_trial_is_extrapolated_at_second_order():
    assert next_log_scale([trial(1.0, 40.0)], 60.0) == pytest.approx(math.log(10.0**-0.5))


@pytest.mark.parametrize("db_per_decade", [20.0, 30.0, 60.0])
def test_trials_below_the_target_are_extrapolated_by_their_slope(db_per_decade):
    trials = [trial(scale, 30.0 - db_per_decade * math.log10(scale)) for scale in (1.0, 0.7)]
    reached = math.log(10.0 ** (-20.0 / db_per_decade))
    assert next_log_scale(trials, 50.0) == pytest.approx(max(reached, math.log(0.7) - 2.0), abs=1e-9)


def test_trials_on_both_sides_of_the_target_are_interpolated():
    assert next_log_scale([trial(0.5, 60.0), trial(2.0, 40.0)], 50.0) == pytest.approx(0.0)
    # Never near an end, so that the interval shrinks where the curve is steep.
    assert next_log_scale([trial(1.0, 60.0), trial(math.e, 50.0)], 50.1) == pytest.approx(0.85)


def test_a_search_ends_only_where_a_rival_takes_less_time_and_fewer_samples():
    rival = trial(1.0, 51.0, steps=10.0, samples=8.0)
    assert is_beaten(trial(1.0, 45.0, steps=20.0, samples=9.0), rival, 50.0)
    assert not is_beaten(trial(1.0, 45.0, steps=20.0, samples=8.2), rival, 50.0)
    assert not is_beaten(trial(1.0, 45.0, steps=9.0, samples=9.0), rival, 50.0)
    assert not is_beaten(trial(1.0, 50.5, steps=20.0, samples=9.0), rival, 50.0)
    assert not is_beaten(trial(1.0, 45.0, steps=20.0, samples=9.0), trial(1.0, 49.0), 50.0)


def test_longer_steps_are_not_tried_where_the_longest_are_still_worse_than_a_rival():
    """Steps twice as long take half of them; 2 dB above the target count as 11 % fewer; a ray's begin is 1.6."""
    rival = trial(1.0, 51.0, steps=10.0, samples=8.0)  # costs 11.6
    assert falls_behind(trial(1.0, 52.0, steps=25.5, samples=19.1), rival, 2.0, 2.0)
    assert not falls_behind(trial(1.0, 52.0, steps=24.5, samples=19.1), rival, 2.0, 2.0)
    assert not falls_behind(trial(1.0, 52.0, steps=25.5, samples=18.9), rival, 2.0, 2.0)
    assert falls_behind(trial(1.0, 52.0, steps=25.5, samples=19.1), rival, 2.0, 1.9)


def test_a_search_goes_no_further_than_to_where_a_rival_is_better():
    rival = trial(1.0, 51.0, steps=20.0, samples=10.0)
    # half of the rival's steps and a quarter of its samples: steps of 0.236 take 1.06 times its samples
    assert finest_worth(trial(1.0, 30.0, steps=10.0, samples=2.5), rival) == pytest.approx(0.85 * 2.5 / 10.6)
    assert finest_worth(trial(0.4, 30.0, steps=5.0, samples=9.0), rival) == pytest.approx(0.85 * 0.4 * 0.25)
    assert finest_worth(trial(0.4, 30.0, steps=50.0, samples=90.0), rival) == pytest.approx(0.85 * 0.4)


class Steep(Pilot):
    """A pilot of uniform steps whose error falls slowly, so that a search by its slope goes far."""

    def __init__(self) -> None:
        self.asked: list[float] = []

    def try_out(self, stepping: Stepping) -> Trial:
        self.asked.append(stepping.scale)
        scale = stepping.scale
        return trial(scale, 30.0 - 10.0 * math.log10(scale), steps=10.0 / scale, samples=8.0 / scale)


def test_a_search_ends_soon_after_its_steps_are_worse_than_a_rivals():
    """Without the rival the finest steps are 0.005, and take 200 times the work."""
    pilot, way = Steep(), Stepping("uniform", "midpoint", 1.0)
    assert pilot.solve(way, 70.0, 2.0).snr_db < 70.0 and min(pilot.asked) < 0.01
    pilot.asked.clear()
    assert pilot.solve(way, 70.0, 2.0, rival=trial(0.5, 71.0, steps=40.0, samples=30.0)).snr_db < 70.0
    assert 0.15 < min(pilot.asked) < 0.25


class InTune(Pilot):
    """A pilot whose marches are a table: uniform steps reach the target at a few scales alone."""

    def __init__(self, lucky: tuple[float, float]) -> None:
        self._lucky, self.asked = lucky, []

    def try_out(self, stepping: Stepping) -> Trial:
        self.asked.append(stepping.scale)
        low, high = self._lucky
        return trial(stepping.scale, 52.0 if low <= stepping.scale <= high else 35.0, steps=1 / stepping.scale)


def test_uniform_steps_in_tune_with_the_voxels_are_found_beyond_the_search():
    """The search ended at 0.1 and 8 samples; a rival takes 2.5, which uniform steps of 0.32 take as well."""
    ended, rival = trial(0.1, 32.0, samples=8.0), trial(0.5, 51.0, samples=2.5)
    pilot = InTune((0.36, 0.42))
    found = pilot.in_tune(ended, 50.0, rival)
    assert 0.36 <= found.stepping.scale <= 0.42 and found.snr_db == 52.0
    assert min(pilot.asked) == pytest.approx(0.32) and max(pilot.asked) < 0.65
    assert (found.stepping.rule, found.stepping.quadrature) == ("uniform", "midpoint")
    # Without such steps none reaches the target, and steps finer than the search's own are never tried.
    assert InTune((2.0, 3.0)).in_tune(ended, 50.0, rival).snr_db < 50.0
    coarse = InTune((0.0, 0.0))
    coarse.in_tune(ended, 50.0, trial(0.5, 51.0, samples=20.0))
    assert min(coarse.asked) == pytest.approx(0.1)
