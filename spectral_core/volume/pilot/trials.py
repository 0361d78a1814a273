# SPDX-License-Identifier: GPL-3.0-or-later
"""Trials of steppings on pilot rays: their record, the cheapest of them, and the next scale to try."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from spectral_core.volume.image import Stepping

RAY = 1.6
"""Time of a ray before its first iteration, in iterations of a uniform midpoint march; fitted as those of ``Pilot``."""
# Times the samples of a rival, and times its time, at which a search ends: more than auto asks a rival to save.
_MORE, _LONGER = 1.06, 1.08


@dataclass(frozen=True)
class Trial:
    """A stepping tried on the pilot rays: SNR in dB, and samples and iterations of the loop per ray.

    ``spread`` is the standard error of the error energy relative to that energy: 0 if the rays are all pixels.
    ``iteration`` is the time of one iteration and ``begin`` the time of a ray before its first one; the unit of both is
    one iteration of a uniform midpoint march. ``is_bound``: the error is smaller than that of the reference, so that
    ``snr_db`` is the least value that it may have.
    """

    stepping: Stepping
    snr_db: float
    samples: float
    steps: float
    spread: float = 0.0
    iteration: float = 1.0
    is_bound: bool = False
    begin: float = RAY

    @property
    def cost(self) -> float:
        """Time of the march in iterations of a midpoint march, per ray."""
        return self.begin + self.iteration * self.steps


def is_beaten(trial: Trial, rival: Trial, quality_db: float) -> bool:
    """True if a trial is short of the target and takes more time and more samples than one that reaches it."""
    return (
        trial.snr_db < quality_db <= rival.snr_db and trial.cost > rival.cost and trial.samples > _MORE * rival.samples
    )


def falls_behind(trial: Trial, rival: Trial, longer: float, within_db: float) -> bool:
    """True if no steps up to ``longer`` times those of a trial that reaches the target are better than a rival's.

    Their number falls by that factor at most, and a trial up to ``within_db`` above the target counts as one of fewer.
    """
    fewer = 10.0 ** (-within_db / 40.0) / longer
    least = trial.begin + trial.iteration * trial.steps * fewer
    return least > _LONGER * rival.cost and trial.samples * fewer > _MORE * rival.samples


def finest_worth(trial: Trial, rival: Trial) -> float:
    """Scale of the steps at which a search below the target falls behind a rival, if steps grow with their scale.

    It is somewhat below, because adaptive steps grow less than their scale.
    """
    steps = (rival.cost - trial.begin) / trial.iteration
    factors = trial.steps / max(steps, 1e-9), trial.samples / (_MORE * max(rival.samples, 1e-9))
    return 0.85 * trial.stepping.scale * min(*factors, 1.0)


def cheapest(trials: list[Trial], quality_db: float) -> Trial:
    """The trial of least cost that reaches ``quality_db``; the one of greatest SNR if none does."""
    reaching = [trial for trial in trials if trial.snr_db >= quality_db]
    return min(reaching, key=lambda t: t.cost) if reaching else max(trials, key=lambda t: t.snr_db)


def next_log_scale(trials: list[Trial], target_db: float) -> float:
    """Log of the scale at which the SNR is expected to be ``target_db``."""
    second_order = -40.0 / math.log(10.0)  # dB per unit of log scale
    above = [t for t in trials if t.snr_db >= target_db]
    below = [t for t in trials if t.snr_db < target_db]
    nearest = min(trials, key=lambda t: abs(t.snr_db - target_db))
    if above and below:
        # Interpolate between the coarsest scale that reaches it and the finest that does not, if in that order.
        high = max(above, key=lambda t: t.stepping.scale)
        low = min(below, key=lambda t: t.stepping.scale)
        a, b = math.log(high.stepping.scale), math.log(low.stepping.scale)
        if a < b:
            part = (high.snr_db - target_db) / max(high.snr_db - low.snr_db, 1e-9)
            # Stay away from the ends, so that the interval shrinks even where the curve is steep or jumps.
            return a + (b - a) * float(np.clip(part if math.isfinite(part) else 0.5, 0.15, 0.85))
    distance = float(np.clip(target_db - nearest.snr_db, -100.0, 100.0)) / second_order
    slopes = sorted(trials, key=lambda t: t.stepping.scale)[:2]
    if len(slopes) == 2 and below and not above:
        # No trial reaches it: extrapolate the slope at the fine end, if it is steep enough.
        run = math.log(slopes[1].stepping.scale / slopes[0].stepping.scale)
        slope = (slopes[1].snr_db - slopes[0].snr_db) / run
        distance *= float(np.clip(second_order / slope if slope < 0 else 2.5, 0.5, 2.5))
        nearest = slopes[0]
    return math.log(nearest.stepping.scale) + float(np.clip(distance, -2.0, 2.0))
