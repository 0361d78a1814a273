# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a spectral texture is from the pictures that were asked for: color differences, contrast, ghosts."""

from __future__ import annotations

from collections.abc import Sequence
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


@dataclass(frozen=True, slots=True, eq=False)
class PictureLoss:
    """What one picture lost against its mapped target. ``delta_e``: (H, W), ΔE2000 of each texel, float16.

    ``contrast``: regression of the shown details on those of the picture as it was given, 1 where all contrast is kept;
    ``ghost``: the same regression on the other picture's details, 0 where nothing of it shows. Details are high-passed
    lightness.
    """

    name: str
    mean: float
    p95: float
    p99: float
    largest: float
    contrast: float
    ghost: float
    delta_e: NDArray[np.float16]


def band_delta_e(wanted: NDArray[np.float32], weights: NDArray[np.float32], color_from_weights: Array) -> Array:
    """ΔE2000 (L, m) between wanted (3L, m) and shown colors; computed only where they differ at all."""
    shown = color_from_weights.astype(np.float32) @ weights
    found = np.zeros((wanted.shape[0] // 3, wanted.shape[1]))
    for light, row in enumerate(found):
        target, actual = wanted[3 * light : 3 * light + 3], shown[3 * light : 3 * light + 3]
        differs = np.flatnonzero(np.abs(target - actual).max(axis=0) > SMALLEST_ERROR)
        row[differs] = delta_e_2000(
            lab_from_linear_rgb(target[:, differs].T), lab_from_linear_rgb(actual[:, differs].T)
        )
    return found


def picture_losses(
    pictures: Sequence[Picture], texture: SpectralTexture, delta_e: NDArray[np.float16]
) -> tuple[PictureLoss, ...]:
    """Statistics of each picture; ``delta_e`` (L, H, W) as ``band_delta_e`` found it."""
    height, width = delta_e.shape[1:]
    rows, columns = _even(height), _even(width)
    small = texture.weights[:, rows][:, :, columns].astype(np.float32)
    details, shown = [], []
    for picture, light in zip(pictures, texture.lights, strict=True):
        thinned = type(picture)(picture.name, picture.pixels[rows][:, columns])
        wanted = thinned.linear_rows(0, len(rows)).reshape(3, len(rows), -1)
        details.append(_details(np.moveaxis(wanted, 0, -1)))
        reduced = type(texture)(small.astype(np.float16), texture.spectra, (light,))
        shown.append(_details(reduced.picture(light)))
    losses = []
    for number, picture in enumerate(pictures):
        others = [detail for other, detail in enumerate(details) if other != number]
        own, ghost = _regression(shown[number], details[number], others[0] if others else None)
        errors = delta_e[number].astype(np.float32)
        p95, p99 = np.percentile(errors, [95, 99])
        losses.append(
            PictureLoss(
                picture.name,
                float(errors.mean()),
                float(p95),
                float(p99),
                float(errors.max()),
                own,
                ghost,
                delta_e[number],
            )
        )
    return tuple(losses)


def _even(length: int) -> NDArray[np.intp]:
    return np.unique(np.linspace(0, length - 1, min(length, MOST_SIDE)).round().astype(np.intp))


def _details(linear_rgb: NDArray[np.floating]) -> Array:
    """High-passed lightness: what an eye takes for the drawing of a picture, free of its mean light."""
    from scipy.ndimage import gaussian_filter

    lightness = lab_from_linear_rgb(linear_rgb)[..., 0]
    width = max(2.0, 0.02 * max(lightness.shape))
    return np.asarray(lightness - gaussian_filter(lightness, width, mode="nearest"))


def _regression(shown: Array, own: Array, other: Array | None) -> tuple[float, float]:
    """Least-squares share of the own and of the other picture's details in what is shown."""
    columns = [own.ravel()] if other is None else [own.ravel(), other.ravel()]
    if not np.any(columns[0]):
        return 1.0, 0.0
    shares = np.linalg.lstsq(np.stack(columns, axis=1), shown.ravel(), rcond=None)[0]
    return float(shares[0]), float(abs(shares[1])) if other is not None else 0.0
