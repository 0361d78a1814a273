# SPDX-License-Identifier: GPL-3.0-or-later
"""The samples of a render in passes, with a picture after each."""

from __future__ import annotations

from spectral_core.scene import Scene

LARGEST_PASS = 128
"""Most samples per pixel of a pass."""
ONE_PASS_PATHS = 1 << 17
"""Paths of a picture that takes some tenths of a second: one pass, because another would take as long to record as its
paths to trace.
"""


def pass_sizes(scene: Scene) -> list[int]:
    """1, 3, 12, 48, … samples up to ``LARGEST_PASS`` per pass, all samples in total: an early picture, few passes.

    Each pass records its kernel, a second or two with many materials; a last pass of less than half the previous one is
    merged with it. A small picture of surfaces is one pass.
    """
    width, height = scene.film.size
    samples = scene.film.samples
    if width * height * samples <= ONE_PASS_PATHS and not scene.volumes:
        return [samples]
    sizes, done = [1], 1
    while done < samples:
        size = min(3 * done, LARGEST_PASS, samples - done)
        if samples - done - size < size / 2:
            size = samples - done
        sizes.append(size)
        done += size
    return sizes
