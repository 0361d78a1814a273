# SPDX-License-Identifier: GPL-3.0-or-later
"""How long a launch takes, and the grids and samples that follow from it.

A launch takes a fixed time, whatever its size, and a time for each sample of its pixels. The fixed time is long in
scenes with many instances or textures, because a replayed launch of Dr.Jit visits every array. If it counted as time
of the pixels, a coarse grid would make its pixels seem slow, and would stay coarse.
"""

from __future__ import annotations

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
MOST_FIXED = 0.9
"""Largest share of the fixed time in that of a launch. If another program slowed down its measurement, the next
launches would otherwise be many times too large. Larger launches then show what their samples take.
"""


@dataclass
class Pace:
    """The time of the launches of one scene: ``fixed_s`` and ``sample_s`` for one sample of one pixel, None before the
    first launch. ``knows_fixed``: True if ``fixed_s`` was measured since the latest change of the scene.
    ``latest``: samples and seconds of the latest launch.
    """

    fixed_s: float = 0.0
    sample_s: float | None = None
    knows_fixed: bool = False
    latest: tuple[int, float] = (0, 0.0)

    def note(self, samples: int, seconds: float) -> None:
        """Take into account a launch of ``samples``, the sum over all of its pixels."""
        self._correct(samples, seconds)
        self.latest = samples, seconds
        if self.sample_s is not None:
            seconds = min(seconds, SLOWER * (self.fixed_s + self.sample_s * samples))
        self.sample_s = max(0.0, seconds - self.fixed_s) / samples

    def _correct(self, samples: int, seconds: float) -> None:
        """Lower a fixed time that was measured while another program was at work: no launch is faster, and a launch of
        more samples than the latest one shows what the samples take.
        """
        self.fixed_s = min(self.fixed_s, seconds)
        fewer, fewer_s = self.latest
        if self.knows_fixed and samples >= 2 * fewer > 0:
            each = max(0.0, seconds - fewer_s) / (samples - fewer)
            if (left := max(0.0, fewer_s - fewer * each)) < self.fixed_s / 2:
                # it is measured again: the view may have become slower instead
                self.fixed_s, self.sample_s, self.knows_fixed = left, None, False

    def wants_fixed(self, seconds: float) -> bool:
        """True if a launch took so long that the fixed time ought to be measured."""
        return not self.knows_fixed and seconds > LAUNCH_S

    def note_fixed(self, seconds: float, samples: int, all_seconds: float) -> None:
        """Take into account the time of a launch without samples, and of one with ``samples`` that took
        ``all_seconds``.
        """
        self.fixed_s, self.sample_s, self.knows_fixed = min(seconds, MOST_FIXED * all_seconds), None, True
        self.note(samples, all_seconds)

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
