# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of a view in progress: the next launch, its samples, and the pixels that can be shown."""

from __future__ import annotations

import itertools
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.denoise import Guides, Quality
from spectral_core.render.live.pace import FIRST_STRIDE, Pace
from spectral_core.render.live.passes import Launcher, block_order
from spectral_core.render.live.view import ViewRequest
from spectral_core.render.trace.guides import MOST_PASSED
from spectral_core.render.trace.path.sampler import hashed_seed
from spectral_core.spectra.color import RGB_FROM_XYZ

Pixels = NDArray[np.float32]

SHOWN_S = 0.15
"""Time between two pictures after the first full one: each redraw of Blender takes time from the renderer."""
DENOISED_S, DENOISED_SHARE = 3.0, 0.25
"""A picture is denoised again when its samples have doubled. Before that, more samples are denoised after this time,
but only if the filter takes at most this share of it.
"""
GUIDE_SAMPLES = 4
"""Rays per pixel of the albedo and normals that guide the filter."""
_numbers = itertools.count(1)


@dataclass(frozen=True, slots=True)
class Launched:
    """A launch: ``samples``, the sum over its pixels, and its time."""

    samples: int
    seconds: float


@dataclass(frozen=True, slots=True, eq=False)
class Clean:
    """Denoised ``pixels`` (rows, columns, 4) of a picture with ``samples``; ``again``: time (``time.perf_counter``)
    after which more samples are denoised.
    """

    pixels: Pixels
    samples: int
    again: float


class ViewPicture:
    """Sums of one view, a grid of pixels for each offset in a block of ``stride`` × ``stride``.

    ``pace``: how long launches of its scene take.
    """

    def __init__(
        self, launcher: Launcher, request: ViewRequest, stride: int = FIRST_STRIDE, pace: Pace | None = None
    ) -> None:
        import drjit as dr

        mi = launcher._mi
        self._launcher, self.request, self.stride, self._pace = launcher, request, stride, pace or Pace()
        self.number = next(_numbers)
        self._order = block_order(stride)
        self.columns, self.rows = -(-request.part[2] // stride), -(-request.part[3] // stride)
        count = self.columns * self.rows
        self._lane = dr.arange(mi.UInt32, count)
        self._blank = mi.Color3f(*(dr.opaque(mi.Float, 0.0, count) for _ in range(3))), dr.opaque(mi.Float, 0.0, count)
        dr.make_opaque(self._lane)
        self._camera = mi.Float([float(value) for value in launcher.in_units(request.viewpoint).numbers])
        self._sums: dict[tuple[int, int], Any] = {}
        self._counts: dict[tuple[int, int], int] = {}
        self._traced: set[tuple[int, int]] = set()
        self._image = np.zeros((self.rows * stride, self.columns * stride, 4), np.float32)
        self._sweep = 1
        self._next = 0
        self.samples = 0
        """Samples that every pixel has so far."""
        self.launches = 0
        self._shown = 0.0
        self._done, self._first = 0, (0.0, 0)  # samples so far; time and samples at the end of the first launch
        self.seconds = 0.0
        self.latest: Launched | None = None
        """The latest launch; None before the first one and after one of albedo and normals."""
        self.clean: Clean | None = None
        """The latest denoised picture, which is shown until the next one."""
        self._seen: Pixels | None = None  # albedo and normals
        self._guided = 0
        self.why_noisy = ""
        """Why the picture cannot be denoised, "" without an error."""

    @property
    def is_done(self) -> bool:
        """True if it has all requested samples."""
        return self.samples >= self.request.samples

    @property
    def is_complete(self) -> bool:
        """True if no other picture follows."""
        is_clean = self.clean is not None and self.clean.samples == self.samples
        return self.is_done and (is_clean or not self._is_denoised)

    @property
    def _is_denoised(self) -> bool:
        return self.request.denoise and not self.why_noisy

    @property
    def wants_denoising(self) -> bool:
        """True if the full picture has many more samples than the one that was denoised last."""
        if not self._is_denoised or not self.samples or self._lacks_guides:
            return False
        if self.clean is None:
            return True
        is_old = time.perf_counter() > self.clean.again and not self._next
        is_better = self.samples >= 2 * self.clean.samples or is_old or self.is_done
        return is_better and self.samples > self.clean.samples

    @property
    def quality(self) -> Quality:
        """Quality of the filter: the best one for the complete picture."""
        return "high" if self.is_done else "fast"

    @property
    def left_s(self) -> float:
        """Expected time until all samples are traced, 0 if unknown. The first launch, which may have compiled, tells
        nothing about the others.
        """
        since, before = self._first
        if self._done == before:
            return 0.0
        wanted = self.request.samples * self.columns * self.rows * len(self._order)
        return (time.perf_counter() - since) * (wanted - self._done) / (self._done - before)

    @property
    def level(self) -> int:
        """Step in pixels of the grid that can be shown: the stride at first, 1 for the full picture; 0 before the
        first.
        """
        if self.samples:
            return 1
        return next((self.stride // (1 << k) for k in (4, 3, 2, 1, 0) if self._next >= 4**k and self.stride >> k), 0)

    @property
    def _lacks_guides(self) -> bool:
        """True if albedo and normals are traced next, after the first full picture."""
        return self._is_denoised and self.samples > 0 and self._launcher.has_guides and self._guided < len(self._order)

    def step(self) -> bool:
        """Trace the next launch. True if there is more to show than before."""
        if self._lacks_guides:
            self._guide()
            return False
        place, before = self._order[self._next], self.level
        first = self._counts.get(place, 0)
        last = min(first + self._sweep, self.request.samples)
        numbers = self._numbers_of(place, first, last)
        sums, took = self._launch(numbers, self._sums.get(place, self._blank))
        self.seconds += took
        self.latest = Launched((last - first) * self.columns * self.rows, took)
        self.launches += 1
        self._done += self.latest.samples
        if self.launches == 1:
            self._first = time.perf_counter(), self._done
        self._sums[place], self._counts[place] = sums, last
        self._traced.add(place)
        self._next += 1
        if self._next == len(self._order):
            self._next, self.samples = 0, last
            self._sweep = self._pace.sweep(last - first, took)
            return True
        return self.level != before or (self.samples > 0 and time.perf_counter() - self._shown > SHOWN_S)

    def launch_nothing(self) -> float:
        """The fixed time of a launch, from one without samples, whose sums are dropped."""
        return self._launch(self._numbers_of((0, 0), 0, 0), self._blank)[1]

    def _launch(self, numbers: Any, sums: Any) -> tuple[Any, float]:
        """Sums after one more launch, and its time."""
        import drjit as dr

        start = time.perf_counter()
        sums = self._launcher.trace(self._camera, numbers, self._lane, sums, self.request.viewpoint.kind)
        dr.eval(sums)
        dr.sync_thread()
        return sums, time.perf_counter() - start

    def _numbers_of(self, place: tuple[int, int], first: int, last: int) -> Any:
        """The numbers of a launch over the pixels at an offset in each block."""
        left, bottom, *_ = self.request.part
        corner = place[0] + left, place[1] + bottom
        size = self.request.width, self.request.height
        seed = hashed_seed(self._launcher.film.seed)
        return self._launcher._mi.UInt32([self.columns, self.stride, *corner, first, last, seed, *size, MOST_PASSED])

    def _guide(self) -> None:
        """Trace albedo and normals of the pixels at the next offset in each block."""
        import drjit as dr

        mi, (x, y) = self._launcher._mi, self._order[self._guided]
        if self._seen is None:
            self._seen = np.zeros((self.rows * self.stride, self.columns * self.stride, 6), np.float32)
        blank = mi.Vector3f(*(dr.opaque(mi.Float, 0.0, self.columns * self.rows) for _ in range(3)))
        sums = self._launcher.guide(
            self._camera, self._numbers_of((x, y), 0, GUIDE_SAMPLES), self._lane, (self._blank[0], blank),
            self.request.viewpoint.kind,
        )  # fmt: skip
        part = np.concatenate([np.array(each, dtype=np.float32).T for each in sums], axis=1) / GUIDE_SAMPLES
        self._seen[y :: self.stride, x :: self.stride] = part.reshape(self.rows, self.columns, 6)
        self._guided += 1
        self.launches += 1
        self.latest = None

    def guides(self) -> Guides | None:
        """Albedo and normals, once they are traced; None without them."""
        if self._seen is None:
            return None
        width, height = self.request.part[2:]
        seen = self._seen[:height, :width]
        return Guides(np.clip(seen[..., :3], 0.0, 1.0), np.clip(seen[..., 3:], -1.0, 1.0))

    def clean_up(self, pixels: Pixels, samples: int, seconds: float, why: str) -> None:
        """Show denoised pixels from now on; after a failure (``why``) those with their noise. ``seconds``: time of the
        filter.
        """
        self.why_noisy = why
        again = time.perf_counter() + max(DENOISED_S, seconds / DENOISED_SHARE - seconds)
        self.clean = None if why else Clean(pixels, samples, again)

    def shown(self) -> tuple[Pixels, int]:
        """What a view shows: pixels (rows, columns, 4), and the samples of each."""
        return (self.pixels(), self.samples) if self.clean is None else (self.clean.pixels, self.clean.samples)

    def pixels(self) -> Pixels:
        """(rows, columns, 4) linear sRGB and coverage of the finest complete grid, row 0 at the bottom."""
        for x, y in self._traced:
            color, covered = self._sums[x, y]
            part = np.empty((self.columns * self.rows, 4), np.float32)
            colors = np.array(color, dtype=np.float32).T
            part[:, :3] = colors if self._launcher.plan is None else colors @ RGB_FROM_XYZ.T.astype(np.float32)
            part[:, :3] *= np.float32(self.request.exposure)
            part[:, 3] = np.maximum(np.array(covered), 0.0)
            part /= self._counts[x, y]
            self._image[y :: self.stride, x :: self.stride] = part.reshape(self.rows, self.columns, 4)
        self._traced.clear()
        self._shown = time.perf_counter()
        step, (width, height) = self.level or self.stride, self.request.part[2:]
        return self._image[:height:step, :width:step]
