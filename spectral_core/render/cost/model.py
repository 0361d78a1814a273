# SPDX-License-Identifier: GPL-3.0-or-later
"""The fitted law of a scene: error by samples and time by samples, with predictions for a requested error or time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MOST_SAMPLES = 1 << 17
LATER = 4
"""Ratio of the numbers of samples of two errors that are drawn from the noise of the measured ones."""
_PROBE_SHARE, _NEXT_STEP = 0.15, 4.0
"""Largest part of a time budget that a probe takes, and how many times as long it takes after its next step."""
DRAWN = 3
"""Number of such errors."""


@dataclass(frozen=True, slots=True)
class RareLight:
    """Light that samples hardly contain. ``delta_e``: mean ΔE2000 of the part that is missing, 0 if only ``limit`` is
    known: an upper limit of it at 95 % confidence, None if none is known. ``what``: the light, for messages.
    """

    delta_e: float
    limit: float | None
    what: str

    @property
    def text(self) -> str:
        """A sentence for notes and panels."""
        if self.delta_e:
            missing = f"about ΔE {self.delta_e:.2g} of it is"
        else:
            missing = f"up to ΔE {self.limit:.2g} of it may be" if self.limit is not None else "a part of it may be"
        return (
            f"The error is at least as large as stated: {self.what} arrives on paths so rare that samples hardly "
            f"contain it, and {missing} missing. A larger source of equal power sends it on more paths."
        )

    def added_to(self, delta_e: float) -> float:
        """An error of noise together with that of the missing light."""
        return float(np.hypot(delta_e, self.delta_e))

    def noise_for(self, wanted: float) -> float:
        """The error of noise that leaves a wanted error in all; at least half of that."""
        return wanted * float(np.sqrt(max(0.25, 1 - (self.delta_e / wanted) ** 2)))


@dataclass(frozen=True, slots=True)
class Prediction:
    """Predicted ``samples`` per pixel in the mean, ``seconds``, and ``delta_e`` of the noise of a render.

    ``work``: seconds of processor time; ``seconds``: elapsed time, if other programs use as much of the processor as
    during the measurement. ``rare``: light that the measurement hardly contains, whose missing part is in ``delta_e``:
    this is then a lower bound.
    """

    samples: float
    seconds: float
    delta_e: float
    work: float = 0.0
    rare: RareLight | None = None

    def with_rare(self, rare: RareLight | None) -> Prediction:
        """The prediction with light that the measurement hardly contains."""
        return self if rare is None else replace(self, delta_e=rare.added_to(self.delta_e), rare=rare)


@dataclass(frozen=True, slots=True)
class CostModel:
    """``counts`` and ``errors``: samples per pixel and measured ΔE2000 of noise, ascending in samples.

    ``seconds_per_sample``: of the whole picture; ``fixed_s``: loading and launches; both in seconds of the processor,
    and ``slowness``: seconds on the wall per such second. ``later``: errors after 4, 16, … times the samples of the
    last measured count, drawn from the noise of those. Between all these counts the law is linear in logarithms, beyond
    the last it goes on with the last measured slope, held within ``SLOPES``. Evenly spread numbers, for which the
    measured slope is steeper than -1/2, make the later errors smaller.
    """

    counts: tuple[int, ...]
    errors: tuple[float, ...]
    seconds_per_sample: float
    fixed_s: float
    slowness: float = 1.0
    later: tuple[float, ...] = ()

    SLOPES = (-0.62, -0.42)

    def error(self, samples: float) -> float:
        """ΔE2000 of noise after ``samples`` per pixel."""
        counts, logs = self._law()
        at = float(np.log(max(samples, 0.25)))
        if at <= counts[0]:
            return float(np.exp(logs[0] - 0.5 * (at - counts[0])))
        if at <= counts[-1]:
            return float(np.exp(np.interp(at, counts, logs)))
        return float(np.exp(logs[-1] + self.slope * (at - counts[-1])))

    def _law(self) -> tuple[Array, Array]:
        """Logarithms of the measured and drawn counts, and of their errors."""
        steps = np.log(LATER) * np.arange(1, len(self.later) + 1)
        # evenly spread numbers go on to pay as measured for as many samples again
        steeper = min(0.0, self.slope + 0.5) * steps + min(0.0, self.last_slope - self.slope) * np.log(2)
        counts = np.concatenate([np.log(self.counts), np.log(self.counts[-1]) + steps])
        errors = np.concatenate([self.errors, np.exp(steeper) * self.later])
        return counts, np.log(np.maximum(np.minimum.accumulate(errors), 1e-6))

    @property
    def slope(self) -> float:
        """Exponent of the error as a function of samples, beyond the measured range: -1/2 for independent numbers."""
        return float(np.clip(self.last_slope, *self.SLOPES))

    @property
    def last_slope(self) -> float:
        """The measured exponent at the end of the measured range, at most as steep as that of a grid of numbers."""
        if len(self.counts) < 2:
            return -0.5
        measured = np.log(max(self.errors[-1], 1e-6) / max(self.errors[-2], 1e-6)) / np.log(
            self.counts[-1] / self.counts[-2]
        )
        return float(np.clip(measured, -1.0, self.SLOPES[1]))

    def slope_from(self, samples: float) -> float:
        """The exponent from ``samples`` to twice as many where both are measured, else the last measured one."""
        if 2 * samples > self.counts[-1]:
            return self.last_slope
        return float(np.log2(self.error(2 * samples) / self.error(samples)))

    def work(self, samples: float) -> float:
        """Seconds of the processor of a whole render with ``samples`` per pixel."""
        return self.fixed_s + self.seconds_per_sample * samples

    def seconds(self, samples: float) -> float:
        """The same as elapsed time."""
        return self.slowness * self.work(samples)

    def for_samples(self, samples: float) -> Prediction:
        """Prediction for a number of samples."""
        return Prediction(samples, self.seconds(samples), self.error(samples), self.work(samples))

    def for_error(self, delta_e: float) -> Prediction:
        """Prediction for a requested error, with equal samples everywhere."""
        low, high = 1.0, float(MOST_SAMPLES)
        for _ in range(60):
            middle = np.sqrt(low * high)
            low, high = (middle, high) if self.error(middle) > delta_e else (low, middle)
        return self.for_samples(high if self.error(1.0) > delta_e else 1.0)

    def for_time(self, seconds: float) -> Prediction:
        """Prediction for a time."""
        samples = (seconds / self.slowness - self.fixed_s) / max(self.seconds_per_sample, 1e-12)
        return self.for_samples(float(np.clip(samples, 1.0, MOST_SAMPLES)))


def measured_model(
    probe: Any,
    *,
    share: float = 0.05,
    least: int = 16,
    most: int = 256,
    fixed_s: float = 0.0,
    asked: float | None = None,
    budget_s: float | None = None,
    timed_s: float = 0.0,
) -> CostModel:
    """Trace a probe further until its law covers the request, within a ``share`` of the render's time.

    Parameters
    ----------
    probe
        A ``Probe``.
    share
        Share of the whole render's time that the probe may take beyond ``least`` samples.
    least
        Samples of each half, at least.
    most
        Samples of each half, at most.
    fixed_s
        Processor time of the render apart from its paths.
    asked
        The requested error.
    budget_s
        The requested time.
    timed_s
        Least processor time of the paths from which the time of a path is measured.
    """
    width, height = probe.film.size
    counts: list[int] = []
    spent, count = 0.0, 1
    while True:
        before = probe.samples
        probe.trace_to(count)
        counts.append(count)
        spent += 2 * (count - before) * len(probe.pixels) * probe.seconds_per_path
        hurries = budget_s is not None and _NEXT_STEP * probe.seconds > _PROBE_SHARE * budget_s
        if count >= least or hurries:
            # later samples tell more of the noise of the earlier ones
            known = tuple(probe.error_of(each) for each in counts)
            rate = probe.seconds_per_path * width * height
            model = CostModel(tuple(counts), known, rate, fixed_s, probe.slowness, _later(probe))
            if hurries or count >= most:
                return model
        if count >= least and spent >= timed_s:
            wanted = model.for_error(asked) if asked is not None else None
            wanted = model.for_time(budget_s) if budget_s is not None else wanted
            enough = wanted is not None and (count >= wanted.samples or spent > share * wanted.work)
            if enough or (wanted is None and count >= 64):
                return model
        count *= 4 if 4 <= count < 16 else 2


def _later(probe: Any) -> tuple[float, ...]:
    found = probe.later([LATER**k for k in range(1, DRAWN + 1)], of_half=True)
    return tuple(found @ probe.shares)
