# SPDX-License-Identifier: GPL-3.0-or-later
"""The film of a pilot: the same view as that of a picture, with fewer, larger pixels."""

from __future__ import annotations

import numpy as np

from spectral_core.scene import Film

LEAST_SIDE, MOST_SIDE = 4, 65536
"""Least pixels of a side of the pilot, and most of the frame around the part that it traces."""


def small_film(film: Film, pixels: int, samples: int) -> Film:
    """The same view with about ``pixels`` pixels, which are larger: that of the whole picture, or of its crop.

    A crop is a part of a frame of such pixels, since the frame defines the view.
    """
    frame = np.array([film.width, film.height])
    crop = np.array(film.crop or (0, 0, *frame))
    start, shown = crop[:2], crop[2:]
    scale = np.sqrt(pixels / (shown[0] * shown[1] * film.pixel_aspect)) * np.array([1.0, film.pixel_aspect])
    sides = np.maximum(LEAST_SIDE, np.round(shown * scale)).astype(int)
    whole = np.minimum(np.round(frame * sides / shown), MOST_SIDE).astype(int)
    first = np.minimum(np.round(start * whole / frame), whole - sides).astype(int)
    return Film(
        int(whole[0]), int(whole[1]), samples=samples, seed=film.seed + 77, filter_kind="box", filter_width=1.0,
        # the view keeps its extent despite rounding
        pixel_aspect=film.height * film.pixel_aspect / film.width * whole[0] / whole[1], exposure=film.exposure,
        crop=None if film.crop is None else (int(first[0]), int(first[1]), int(sides[0]), int(sides[1])),
    )  # fmt: skip
