# SPDX-License-Identifier: GPL-3.0-or-later
"""A probe: some thousand pixels of the full picture, in small blocks spread over it, traced in two halves.

The pixels belong to the picture at full size, so the mean error of the sample estimates that of the picture.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.cost.allocate import Laws
from spectral_core.render.cost.errors import (
    Estimate,
    Wide,
    block_means,
    estimated,
    expected_errors,
    rarity,
    rarity_after,
    repetition,
    scatter,
    seen_apart,
)
from spectral_core.render.cost.later import FEWER, later_laws
from spectral_core.render.cost.resample import BLOCK, POOL, pools
from spectral_core.render.cost.work import Meter
from spectral_core.render.job import RenderJob
from spectral_core.scene import Film

PIXELS = 8192
_LEAST_HOT, _UNEVEN = 0.02, 0.3
"""Least share of the blocks with most samples, and least mean deviation of samples from even ones, for another time of
a path.
"""
_HOT_S, _MOST_HOT = 0.05, 64
"""Work of the launch that measures it, and its most samples."""
_FEW_PIXELS = 16
"""Pixels of the launch whose time is that of a launch without its paths."""
_MANY = 8
"""Samples of a step whose time is that of its paths."""
_MORE = 4
"""Least ratio of the probe's samples to those of a picture that is compared with them."""
_LATEST = 2
"""Latest steps by which repeated noise is measured."""


def probe_pixels(film: Film, count: int = PIXELS) -> NDArray[np.int64]:
    """Numbers of at most ``count`` pixels, in blocks, one in each of equal parts of the picture; all of a small one."""
    width, height = film.size
    across, up = (max(1, size // side) for size, side in zip((width, height), BLOCK, strict=True))
    if width * height <= count or across * up * BLOCK[0] * BLOCK[1] <= count:
        return np.arange(width * height)
    columns, rows = min(BLOCK[0], width), min(BLOCK[1], height)
    wanted = max(1, count // (columns * rows))
    rng = np.random.default_rng(film.seed)
    # one random position in each of equal parts of a curve that fills the picture column by column
    edges = np.linspace(0, across * up, wanted + 1)
    chosen = np.unique((edges[:-1] + rng.random(wanted) * np.diff(edges)).astype(np.int64))
    left = np.minimum(chosen // up * columns, width - columns)
    bottom = np.minimum(chosen % up * rows, height - rows)
    inside = np.arange(rows)[:, None] * width + np.arange(columns)
    return np.asarray(((bottom * width + left)[:, None, None] + inside).ravel())


class Probe:
    """Pixels of a job that are traced with growing numbers of samples.

    ``launch_s``: time of a launch without its paths; ``seconds_per_path``: time of a path. Both are processor time,
    which other programs on the machine do not change.
    """

    def __init__(self, job: RenderJob, pixels: NDArray[np.int64] | None = None) -> None:
        self.film = job.scene.film
        self.pixels = probe_pixels(self.film) if pixels is None else pixels
        self.pools, self.blocks = (
            np.unique(pools(self.pixels, self.film.size[0], shape), return_inverse=True)[1].ravel()
            for shape in (POOL, BLOCK)
        )
        self._tracer = job.chosen_pixels()
        self._sums = np.zeros((2, len(self.pixels), 3))
        self.samples = 0
        """Samples of each half so far."""
        self.seconds_per_path = 0.0
        self._found: dict[tuple[str, bool], Any] = {}
        self._earlier: list[tuple[int, NDArray[np.float64]]] = []
        self._launch(0, 1)  # compiles the kernels
        launches = []
        for _ in range(2):
            meter = Meter()
            self._launch(0, 1)
            launches.append(meter.read())
        self._spent = min(launches, key=lambda spent: spent.work)
        self.launch_s = self._almost_empty()
        self._timed: list[tuple[int, float]] = [(1, self._spent.work)]
        """Samples of each half in a step, and the work of the step."""
        self._sums[:] = 0.0

    @property
    def slowness(self) -> float:
        """Seconds on the wall per second of the processor, all its cores together, while the probe was traced."""
        return self._spent.slowness

    @property
    def seconds(self) -> float:
        """Seconds on the wall of its launches so far."""
        return self._spent.wall

    def _launch(self, done: int, more: int) -> None:
        none = np.zeros(len(self.pixels), np.int64)
        sums = self._tracer.trace_halves(self.pixels, none + done, none + more)
        self._sums += sums.colors.reshape(2, -1, 3)

    def _almost_empty(self) -> float:
        """Work of a launch of a few pixels: where paths are long, one of all pixels is mostly paths."""
        few = self.pixels[:_FEW_PIXELS]
        meter = Meter()
        self._tracer.trace_halves(few, 0 * few, 0 * few + 1)
        return min(meter.read().work, self._spent.work)

    def trace_to(self, samples: int) -> None:
        """Trace both halves up to ``samples`` each."""
        more = samples - self.samples
        if more > 0:
            meter = Meter()
            self._launch(self.samples, more)
            spent = meter.read()
            self._spent += spent
            self._timed.append((more, spent.work))
            self._fit()
            self.samples = samples
            self._found.clear()
            self._earlier.append((samples, self.halves().copy()))

    def estimate(self) -> Estimate:
        """Error of a picture with as many samples as a half of the probe."""
        return estimated(self.errors(of_half=True), self.halves(), self.blocks, of_half=True)

    def wide(self) -> Wide:
        """The blocks, and how far the noise of later samples repeats that of earlier ones in its place."""

        def find() -> Wide:
            steps = list(zip(self._earlier, self._earlier[1:], strict=False))[-_LATEST:]
            found = [
                repetition(early, late, (first, last), self.pools, self.blocks)
                for (first, early), (last, late) in steps
            ]
            in_pool, in_block = np.mean(found, axis=0) if found else (0.0, 0.0)
            return Wide(self.blocks, (float(in_pool), float(in_block)))

        return self._known(("wide", True), find)

    def error_of(self, samples: int) -> float:
        """ΔE2000 of a picture of ``samples``, as many as the probe once had, by all that it has told since."""
        return float(self._errors_of(samples, of_half=True).mean()) * self.rarity(samples)

    def _errors_of(self, samples: int, *, of_half: bool) -> NDArray[np.float64]:
        """ΔE2000 of each pixel when the probe had as many samples."""
        halves = self.halves_after(samples)
        return self._known(
            (f"errors {samples}", of_half), lambda: expected_errors(halves, self.pools, self.wide(), of_half=of_half)
        )

    def _fit(self) -> None:
        """Time of a path: of the steps of many samples, once there are any, since a launch of few is mostly start.

        The first launches may take longer than later ones: a launch takes what the quickest short step leaves of it.
        """
        steps, work = np.array(self._timed, dtype=np.float64).T
        many, few = steps >= max(1.0, min(_MANY, steps.max())), steps < _MANY
        for _ in range(3):
            own = np.maximum(work[many] - self.launch_s, 0.2 * work[many])
            rate = float(own.sum() / steps[many].sum())
            if steps.max() >= _MANY:
                self.launch_s = max(float((work - rate * steps)[few].min()), 0.2 * float(work[few].min()))
        self.seconds_per_path = rate / (2 * len(self.pixels))

    def dearer(self, samples: NDArray[np.float64], most_work: float = np.inf) -> float:
        """Mean time of a path over the usual one if blocks get ``samples`` (blocks,): noisy ones may have longer paths.

        Two launches of the blocks with more samples than the mean measure it, unless they take more than ``most_work``.
        """
        share = samples / float(self.shares @ samples)
        hot = share > 1.0
        part = float(self.shares[hot].sum())
        if not _LEAST_HOT < part < 1 - _LEAST_HOT or float(self.shares @ np.abs(share - 1)) < _UNEVEN:
            return 1.0
        pixels = self.pixels[hot[self.blocks]]
        none = np.zeros(len(pixels), np.int64)
        more = int(np.clip(np.ceil(_HOT_S / (2 * len(pixels) * self.seconds_per_path)), 1, _MOST_HOT))
        if 4 * len(pixels) * more * self.seconds_per_path > most_work:
            return 1.0
        spent = []
        for _ in range(2):  # other programs may slow one down
            meter = Meter()
            self._tracer.trace_halves(pixels, none, none + more)
            spent.append(meter.read().work)
        own = max(min(spent) - self.launch_s, 0.0) / (2 * len(pixels) * more)
        ratio = float(np.clip(own / self.seconds_per_path, 0.2, 1 / part))
        rest = (1 - part * ratio) / (1 - part)
        return float(self.shares @ (share * np.where(hot, ratio, rest)))

    @property
    def shares(self) -> NDArray[np.float64]:
        """Share of each block in the pixels."""
        return np.asarray(np.bincount(self.blocks) / len(self.blocks))

    def errors(self, *, of_half: bool = False) -> NDArray[np.float64]:
        """ΔE2000 of each pixel so far."""
        return self._errors_of(self.samples, of_half=of_half)

    def scatter(self) -> float:
        """Relative standard deviation of the error of a whole picture about the expected one."""
        return scatter(self.errors(), int(np.prod(self.film.size)) / len(self.pixels))

    def _known(self, what: tuple[str, bool], find: Callable[[], Any]) -> Any:
        """A result that holds until more samples are traced."""
        if what not in self._found:
            self._found[what] = find()
        return self._found[what]

    def rarity(self, samples: float, *, of_half: bool = True) -> float:
        """Factor on the error of a picture for light on rare paths, see ``errors.rarity``: a picture of ``samples``, or
        without ``of_half`` one of two halves with as many each.
        """
        if not (known := [each for each in self._earlier if _MORE * each[0] <= self.samples]):
            return 1.0
        # the comparison of about as few samples as the picture has, where there is one
        count, halves = next((each for each in reversed(known) if each[0] <= samples), known[0])

        def find() -> float:
            same = np.ones(len(self.pixels))
            errors = self._errors_of(count, of_half=of_half)
            return rarity(halves, self.halves(), same * count, same * self.samples, errors, of_half=of_half)

        return rarity_after(self._known((f"rarity {count}", of_half), find), count, samples)

    def compared(
        self, halves: NDArray[np.float64], counts: NDArray[np.int64], errors: NDArray[np.float64]
    ) -> float | None:
        """The same factor for a picture of few samples, from its pixels of the probe; None if it has too many.

        Adaptive sampling leaves the noise that a picture does not show, so its own errors become too small. ``halves``
        (2, pixels, 3), ``counts`` of samples and ``errors``: of the whole picture.
        """
        here = counts[self.pixels].astype(np.float64)
        if _MORE * here.mean() > self.samples:
            return None
        every = np.full(len(here), float(self.samples))
        return rarity(halves[:, self.pixels], self.halves(), here, every, errors[self.pixels])

    def seen(
        self, halves: NDArray[np.float64], counts: NDArray[np.int64], *, contained: bool
    ) -> NDArray[np.float64] | None:
        """ΔE2000 of each pixel of a picture that the probe has whole, by its own; None if it has too few samples."""
        if len(self.pixels) < len(counts) or _MORE * counts.max() > self.samples:
            return None
        every = np.full(len(counts), float(self.samples))
        return seen_apart(halves, self.halves(), counts * 1.0, every, contained=contained)

    def later(self, growth: Sequence[int], *, of_half: bool = False) -> NDArray[np.float64]:
        """(len(growth), blocks): ΔE2000 of each block after ``growth`` times as many samples, drawn from the noise of
        the samples so far; without ``of_half`` of pictures of both halves.
        """
        drawn = self._known(("drawn", True), self._laws)
        now = block_means(self.errors(of_half=of_half), self.blocks)
        every = np.ones(len(now))
        begin = every if of_half else 2 * every
        found = []
        for factor in growth:
            rare = self.rarity(self.samples * factor, of_half=of_half)
            found.append(rare * now * drawn.error(begin * factor) / drawn.error(begin))
        return np.array(found)

    def _laws(self) -> Laws:
        """Error of each block by the number of halves whose samples a picture has."""
        before = [count for count, _ in self._earlier if FEWER * count <= self.samples]
        now, trend = float(self.errors(of_half=True).mean()), FEWER**-0.5
        if before:
            gained = max(now, 1e-9) / max(float(self._errors_of(before[-1], of_half=True).mean()), 1e-9)
            trend = gained ** (np.log(FEWER) / np.log(self.samples / before[-1]))
        return later_laws(self.halves(), self.blocks, now, trend)

    def halves(self) -> NDArray[np.float64]:
        """(2, n, 3): the halves' means so far."""
        return self._sums / max(1, self.samples)

    def halves_after(self, samples: int) -> NDArray[np.float64]:
        """(2, n, 3): the halves' means after as many samples, with which one of its steps has ended."""
        return next(halves for count, halves in self._earlier if count == samples)
