# SPDX-License-Identifier: GPL-3.0-or-later
"""The samples of a render in passes, with a picture after each."""

from __future__ import annotations

from spectral_core.scene import Scene

LARGEST_PASS = 128
"""Most samples per pixel of a pass."""
FEW_PATHS = 1 << 17
"""Paths of a picture that takes some tenths of a second: recording another pass would take as long as tracing it."""


def pass_sizes(scene: Scene, *, watched: bool = True) -> list[int]:
    """1, 3, 12, 48, … samples up to ``LARGEST_PASS`` per pass, all samples in total: an early picture, few passes.

    Each pass records its kernel, a second or two with many materials; a last pass of less than half the previous one is
    merged with it. A small picture of surfaces has two passes, or one if the early picture is not ``watched``.
    """
    width, height = scene.film.size
    samples = scene.film.samples
    if samples > 1 and width * height * samples <= FEW_PATHS and not scene.volumes:
        return [1, samples - 1] if watched else [samples]
    sizes, done = [1], 1
    while done < samples:
        size = min(3 * done, LARGEST_PASS, samples - done)
        if samples - done - size < size / 2:
            size = samples - done
        sizes.append(size)
        done += size
    return sizes
