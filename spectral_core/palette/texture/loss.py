# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of a spectral texture: color differences, contrast, ghosts."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb

if TYPE_CHECKING:
    from spectral_core.palette.texture.texture import Picture, SpectralTexture

Array = NDArray[np.float64]
SMALLEST_ERROR = 1e-3
"""Linear RGB error below which a texel counts as exact; half a step of an 8-bit display is four times that."""
MOST_SIDE = 512
"""Ghosts are measured on at most this many rows and columns, which are picked evenly."""
NO_DETAILS = 1e-3
"""High-passed lightness that is rounding: of a picture of one color."""
BLOCK = 1 << 13
"""Texels whose color differences are computed at a time, so that intermediate results fit into the cache."""


@dataclass(frozen=True, slots=True, eq=False)
class PictureLoss:
    """Errors of one picture relative to its mapped target. ``delta_e``: (H, W), ΔE2000 of each texel, float16.

    ``contrast``: regression of the shown details on those of the given picture, 1 if all contrast is kept; ``ghost``:
    regression of the difference from the mapped target on the other picture's details, 0 without a ghost. Details are
    high-passed lightness.
    """

    name: str
    mean: float
    p95: float
    p99: float
    largest: float
    contrast: float
    ghost: float
    delta_e: NDArray[np.float16]


def texel_delta_e(wanted: NDArray[np.float32], weights: NDArray[np.float32], color_from_weights: Array) -> Array:
    """ΔE2000 (L, m) between wanted (3L, m) and shown colors; computed only where they differ at all."""
    shown = color_from_weights.astype(np.float32) @ weights
    found = np.zeros((wanted.shape[0] // 3, wanted.shape[1]))
    for light, row in enumerate(found):
        target, actual = wanted[3 * light : 3 * light + 3], shown[3 * light : 3 * light + 3]
        differs = np.flatnonzero(np.abs(target - actual).max(axis=0) > SMALLEST_ERROR)
        for start in range(0, len(differs), BLOCK):
            some = differs[start : start + BLOCK]
            row[some] = delta_e_2000(lab_from_linear_rgb(target[:, some].T), lab_from_linear_rgb(actual[:, some].T))
    return found


def picture_losses(
    pictures: Sequence[Picture],
    texture: SpectralTexture,
    delta_e: NDArray[np.float16],
    mapping: tuple[float, float],
) -> tuple[PictureLoss, ...]:
    """Statistics of each picture; ``delta_e`` (L, H, W) as ``texel_delta_e`` found it, ``mapping``: floor and slope."""
    height, width = delta_e.shape[1:]
    rows, columns = _even(height), _even(width)
    small = texture.weights[:, rows][:, :, columns]

    def details(number: int) -> tuple[Array, Array, Array]:
        """High-passed lightness of the given picture, of its mapped target, and of the shown picture."""
        picture, light = pictures[number], texture.lights[number]
        thinned = type(picture)(picture.name, picture.pixels[rows][:, columns])
        given, asked = (
            np.moveaxis(thinned.linear_rows(0, len(rows), *each).reshape(3, len(rows), -1), 0, -1)
            for each in ((0.0, 1.0), mapping)
        )
        reduced = type(texture)(small, texture.spectra, (light,))
        return _details(given), _details(asked), _details(reduced.picture(light))

    with ThreadPoolExecutor() as pool:
        found = list(pool.map(details, range(len(pictures))))
    losses = []
    for number, (picture, (given, asked, shown)) in enumerate(zip(pictures, found, strict=True)):
        others = [each[0] for other, each in enumerate(found) if other != number]
        contrast = _regression(shown, [given, *others])[0]
        # Relative to the mapped target, because the mapping's curve would count as a ghost where the other picture is
        # flat.
        ghost = abs(_regression(shown, [asked, *others])[1]) if others else 0.0
        mean, p95, p99, largest = _statistics(delta_e[number])
        losses.append(PictureLoss(picture.name, mean, p95, p99, largest, contrast, ghost, delta_e[number]))
    return tuple(losses)


def _statistics(errors: NDArray[np.float16]) -> tuple[float, float, float, float]:
    """Mean, 95th and 99th percentile and maximum. Most errors are 0, which need no sorting."""
    above = errors[errors.view(np.uint16) != 0].astype(np.float32)
    above.sort()

    def percentile(share: float) -> float:
        place = share / 100 * (errors.size - 1) - (errors.size - len(above))
        # The index is counted from the first error above 0; before it all are 0.
        return float(np.interp(place, np.arange(-1, len(above)), np.append(np.float32(0), above)))

    mean = float(above.sum(dtype=np.float64)) / errors.size
    return mean, percentile(95), percentile(99), float(above.max(initial=0.0))


def _even(length: int) -> NDArray[np.intp]:
    return np.unique(np.linspace(0, length - 1, min(length, MOST_SIDE)).round().astype(np.intp))


def _details(linear_rgb: NDArray[np.floating]) -> Array:
    """High-passed lightness: the details of a picture, without its mean light."""
    from scipy.ndimage import gaussian_filter

    lightness = lab_from_linear_rgb(linear_rgb)[..., 0]
    width = max(2.0, 0.02 * max(lightness.shape))
    return np.asarray(lightness - gaussian_filter(lightness, width, mode="nearest"))


def _regression(shown: Array, parts: list[Array]) -> Array:
    """Least-squares share of the details of each part in the shown picture; 1 for a picture without details."""
    if np.abs(parts[0]).max() < NO_DETAILS:
        return np.array([1.0, 0.0])
    return np.asarray(np.linalg.lstsq(np.stack([p.ravel() for p in parts], axis=1), shown.ravel(), rcond=None)[0])
