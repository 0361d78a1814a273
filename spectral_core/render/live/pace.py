# SPDX-License-Identifier: GPL-3.0-or-later
"""How long a launch takes, and the grids and samples that follow from it.

A launch takes a fixed time, whatever its size, and a time for each sample of its pixels. The fixed time is long in
scenes with many instances or textures, because a replayed launch of Dr.Jit visits every array. If it counted as time
of the pixels, a coarse grid would make its pixels seem slow, and would stay coarse.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

LAUNCH_S = 0.02
"""Largest time of the samples of one launch in a settled picture, or the fixed time of a launch if that is longer. A
change waits for at most one launch.
"""
MOST_SAMPLES = 16
"""Samples per pixel of one launch."""
COARSEST_STRIDE = 16
STRIDES = {1: 0.0, 2: 0.0, 4: 0.015, 8: 0.05}
"""Steps in pixels of a first picture, each with the time up to which its samples permit it, or the fixed time of a
launch if that is longer; ``COARSEST_STRIDE`` in slower scenes. A change waits for the launch in progress, and for the
first one of its own.
"""
FIRST_STRIDE = 4
"""The step of a scene that has not been traced yet."""
SLOWER = 1.1
"""Largest growth of the time of a launch from one to the next: other programs slow down single launches."""
EMPTY_LAUNCHES, SHORT_S = 5, 0.01
"""Launches without samples that measure the fixed time of a slow scene, and the time below which it does not count.
Blender's redraw of a picture slows down one or two of them, and a fixed time of its length would make the next launches
many times too large.
"""
MOST_FIXED = 0.9
"""The share of the least of them that counts as fixed, for the same reason. Larger launches then show what their
samples take.
"""


@dataclass
class Pace:
    """The time of the launches of one loaded scene: ``fixed_s``, and ``sample_s`` for one sample of one pixel, None
    before the first launch. ``left``: empty launches that are left to measure the fixed time; ``least_s``: the least of
    their times; ``latest``: samples and seconds of the latest launch.
    """

    fixed_s: float = 0.0
    sample_s: float | None = None
    left: int = EMPTY_LAUNCHES
    least_s: float = math.inf
    latest: tuple[int, float] = (0, 0.0)

    def note(self, samples: int, seconds: float) -> None:
        """Take into account a launch of ``samples``, the sum over all of its pixels."""
        self._correct(samples, seconds)
        self.latest = samples, seconds
        if self.sample_s is not None:
            seconds = min(seconds, SLOWER * (self.fixed_s + self.sample_s * samples))
        self.sample_s = max(0.0, seconds - self.fixed_s) / samples

    def _correct(self, samples: int, seconds: float) -> None:
        """Lower a fixed time that is too long: no launch is faster, and a launch of more samples than the latest one
        shows what the samples take.
        """
        self.fixed_s = min(self.fixed_s, seconds)
        fewer, fewer_s = self.latest
        if self.fixed_s and samples >= 2 * fewer > 0:
            each = max(0.0, seconds - fewer_s) / (samples - fewer)
            if (rest := max(0.0, fewer_s - fewer * each)) < self.fixed_s / 2:
                # it is measured again: the view may have become slower instead
                self.fixed_s, self.sample_s, self.left, self.least_s = rest, None, EMPTY_LAUNCHES, math.inf

    def wants_fixed(self, seconds: float) -> bool:
        """True if the fixed time ought to be measured after a launch that took ``seconds``."""
        return self.left > 0 and seconds > LAUNCH_S

    def note_fixed(self, seconds: float) -> None:
        """Take into account the time of a launch without samples."""
        self.left, self.least_s = self.left - 1, min(self.least_s, seconds)
        if self.least_s < SHORT_S:
            self.left = 0
        elif not self.left:
            self.fixed_s, self.sample_s = MOST_FIXED * min(self.least_s, self.latest[1]), None
            self.note(*self.latest)

    def stride(self, pixels: int) -> int:
        """Step of the first picture of a view with so many pixels: the finest one that is fast."""
        if self.sample_s is None:
            return FIRST_STRIDE
        whole_s = self.sample_s * pixels
        fast = (step for step, longest_s in STRIDES.items() if whole_s / step**2 <= max(longest_s, self.fixed_s))
        return next(fast, COARSEST_STRIDE)

    def sweep(self, now: int, seconds: float) -> int:
        """Samples per pixel of the next launches, after one of ``now`` samples per pixel that took ``seconds``."""
        samples_s, longest_s = seconds - self.fixed_s, max(LAUNCH_S, self.fixed_s)
        if samples_s < longest_s / 2:
            return min(2 * now, MOST_SAMPLES)
        return max(1, now // 2) if samples_s > 2 * longest_s else now
