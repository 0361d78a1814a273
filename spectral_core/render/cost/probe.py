# SPDX-License-Identifier: GPL-3.0-or-later
"""A probe: a few thousand pixels of the full picture, in short runs spread over it, traced in two halves.

The pixels belong to the picture at full size, so the mean error of the sample estimates that of the picture.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.cost.errors import Estimate, estimate, rarity, rarity_after
from spectral_core.render.cost.work import Meter
from spectral_core.render.job import RenderJob
from spectral_core.scene import Film

RUN = 16
"""Neighboring pixels in a run, which the processor traces together."""
PIXELS = 4096
_MANY = 8
"""Samples of a step whose time is that of its paths."""


def probe_pixels(film: Film, count: int = PIXELS) -> NDArray[np.int64]:
    """Numbers of at most ``count`` pixels, in runs of RUN within rows, one in each of equal parts of the picture."""
    width, height = film.size
    if width * height <= count:
        return np.arange(width * height)
    run = min(RUN, width)
    across = max(1, width // run)
    wanted = max(1, count // run)
    places = across * height
    rng = np.random.default_rng(film.seed)
    # one random position in each of equal parts of a curve that fills the picture column by column
    edges = np.linspace(0, places, wanted + 1)
    chosen = np.unique((edges[:-1] + rng.random(wanted) * np.diff(edges)).astype(np.int64))
    column, row = chosen // height, chosen % height
    first = row * width + np.minimum(column * run, width - run)
    return np.asarray((first[:, None] + np.arange(run)).ravel())


class Probe:
    """Pixels of a job that are traced with growing numbers of samples.

    ``launch_s``: time of a launch without its paths; ``seconds_per_path``: time of a path. Both are processor time,
    which other programs on the machine do not change.
    """

    def __init__(self, job: RenderJob, pixels: NDArray[np.int64] | None = None) -> None:
        self.film = job.scene.film
        self.pixels = probe_pixels(self.film) if pixels is None else pixels
        self._tracer = job.chosen_pixels()
        self._sums = np.zeros((2, len(self.pixels), 3))
        self.samples = 0
        """Samples of each half so far."""
        self.seconds_per_path = 0.0
        self._earlier: list[tuple[int, NDArray[np.float64]]] = []
        self._launch(0, 1, 0)  # compiles the kernels
        launches = []
        for half in (0, 1):
            meter = Meter()
            self._launch(0, 1, half)
            launches.append(meter.read())
        self._spent = min(launches, key=lambda spent: spent.work)
        self.launch_s = self._spent.work
        self._timed: list[tuple[int, float]] = [(1, 2 * self.launch_s)]
        """Samples of each half in a step, and the work of the step."""
        self._sums[:] = 0.0

    @property
    def slowness(self) -> float:
        """Seconds on the wall per second of the processor, all its cores together, while the probe was traced."""
        return self._spent.slowness

    def _launch(self, done: int, more: int, half: int) -> Any:
        none = np.zeros(len(self.pixels), np.int64)
        sums = self._tracer.trace(self.pixels, none + done, none + more, half)
        self._sums[half] += sums.colors
        return sums

    def trace_to(self, samples: int) -> Estimate:
        """Trace both halves up to ``samples`` each; the error of a picture with as many samples."""
        more = samples - self.samples
        if more > 0:
            meter = Meter()
            for half in (0, 1):
                self._launch(self.samples, more, half)
            spent = meter.read()
            self._spent += spent
            self._timed.append((more, spent.work))
            self._fit()
            self.samples = samples
            self._earlier.append((samples, self.halves().copy()))
        first, second = self.halves()
        return estimate(first, second, RUN, of_half=True)

    def _fit(self) -> None:
        """Time of a path: of the steps of many samples, once there are any, since a launch of few is mostly start."""
        steps, work = np.array(self._timed, dtype=np.float64).T
        some = steps >= max(1.0, min(_MANY, steps.max()))
        own = np.maximum(work[some] - 2 * self.launch_s, 0.2 * work[some])
        self.seconds_per_path = float(own.sum() / steps[some].sum()) / (2 * len(self.pixels))

    def rarity(self, samples: float, *, of_half: bool = True) -> float:
        """Factor on the error of a picture for light on rare paths, see ``errors.rarity``: a picture of ``samples``, or
        without ``of_half`` one of two halves with as many each.
        """
        counts = [count for count, _ in self._earlier if 4 * count <= self.samples]
        if not counts:
            return 1.0
        early = next(halves for count, halves in self._earlier if count == counts[-1])
        same = np.ones(len(self.pixels))
        factor = rarity(early, self.halves(), same * counts[-1], same * self.samples, of_half=of_half)
        return rarity_after(factor, counts[-1], samples)

    def halves(self) -> NDArray[np.float64]:
        """(2, n, 3): the halves' means so far."""
        return self._sums / max(1, self.samples)
