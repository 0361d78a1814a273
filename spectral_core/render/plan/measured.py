# SPDX-License-Identifier: GPL-3.0-or-later
"""Color errors from a pilot's bins: the loss of part of the light, with the statistical uncertainty of the pilot."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.plan.pilot import Pilot
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb

Array = NDArray[np.float64]

BLOCKS = (4, 6)
"""Rows and columns of blocks whose means are compared too, because rare bright paths are spread over them."""
DOUBT = 2.0
"""Standard deviations that are added to a measured error."""
WORST_WEIGHT = 0.5
"""Weight of the worst block relative to the mean of the picture."""


def error_of_loss(pilot: Pilot, lost: Array, unseen: float = 0.0) -> float:
    """Upper bound of the ΔE2000 of the picture without ``lost`` (height, width, batches, ≥3).

    The largest of three values: mean over the pixels that show a surface, mean over blocks, half of the worst block;
    plus twice its standard deviation between batches (jackknife). ``unseen``: additional mean radiance of paths that
    are so rare that the pilot may have met none.
    """
    light, picture = lost[..., :3], pilot.picture
    batches = picture.shape[2]
    if not light.any():
        return _error_of_unseen(pilot, unseen)
    pixels = _difference(picture.mean(axis=2), light.mean(axis=2))
    blocks, lost_blocks = _blocks(picture), _blocks(light)  # (blocks, batches, 3)
    coarse = _difference(blocks.mean(axis=1), lost_blocks.mean(axis=1))
    # The background dilutes a mean over all pixels: a small object would lose its shading at a small error.
    shown = pilot.shows_surfaces
    whole = max(float(pixels[shown].mean()) if shown.any() else 0.0, _of_blocks(coarse))
    without = [(part.sum(axis=1, keepdims=True) - part) / (batches - 1) for part in (blocks, lost_blocks)]
    parts = _of_blocks(_difference(*without), axis=0)  # one for each omitted batch
    spread = float(np.sqrt((batches - 1) / batches * np.sum((parts - parts.mean()) ** 2)))
    return whole + DOUBT * spread + _error_of_unseen(pilot, unseen)


def unseen_radiance(pilot: Pilot, brightest: float) -> float:
    """Upper limit of the mean radiance of paths that the pilot may have missed, at 95 % confidence.

    If n paths do not contain an event, its probability is below 3/n at 95 % confidence; each such path carries at most
    the radiance of the brightest source.
    """
    return 3.0 / pilot.paths * brightest


def _of_blocks(errors: Array, axis: int | None = None) -> Any:
    """The larger of the mean over blocks and a part of the worst block."""
    return np.maximum(errors.mean(axis=axis), WORST_WEIGHT * errors.max(axis=axis))


def _error_of_unseen(pilot: Pilot, radiance: float) -> float:
    if radiance <= 0:
        return 0.0
    blocks = _blocks(pilot.picture.mean(axis=2))
    return float(_difference(blocks + radiance, np.full_like(blocks, radiance)).mean())


def _difference(picture: Array, lost: Array) -> Array:
    full, less = (lab_from_linear_rgb(np.maximum(part, 0.0)) for part in (picture, picture - lost))
    return np.asarray(delta_e_2000(full, less))


def _blocks(picture: Array) -> Array:
    """Means over BLOCKS, (rows · columns, …)."""
    rows = np.array_split(picture, min(BLOCKS[0], picture.shape[0]), axis=0)
    parts = [part for row in rows for part in np.array_split(row, min(BLOCKS[1], picture.shape[1]), axis=1)]
    return np.stack([part.mean(axis=(0, 1)) for part in parts])
