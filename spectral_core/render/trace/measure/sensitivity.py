# SPDX-License-Identifier: GPL-3.0-or-later
"""Response of a picture to light of each wavelength, which determines how often that is traced."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import STANDARD, integration_points, observer
from spectral_core.spectra.spectrum import WAVELENGTHS_NM, Spectrum

Array = NDArray[np.float64]

SMOOTH_NM = 12
"""Width (standard deviation) of the smoothing of the density. Four wavelengths a quarter apart in probability
integrate a smooth function over the density far better than one with steep flanks.
"""
_LEAST_CHANNEL = 0.05
"""Least response of a channel of the picture, over that of the strongest: darker ones get no more samples."""
_FLATTER, _FLATTEST = 0.7, 0.6
"""Power of the response that is the density. Below 1 the flanks of the response get more samples and less weight; the
second is for weighted sets, which measure even spectra with less noise if the density is flatter.
"""
_LEAST_WEIGHT = 0.5
"""Least weight of a channel over that of the strongest, by the reflectances."""


def sensitivity(light: Spectrum | None = None, tints: Sequence[Array] = (), *, of_sets: bool = False) -> Array:
    """Response of the picture to light of each whole nm, (471,): of red, green and blue, each over its value under
    ``light`` (under equal energy without one), so that the noise of each is small beside itself; smoothed.

    ``tints``: reflectances at each whole nm; a channel counts by the root of its mean square over these. ``of_sets``:
    the wavelengths of a path have weights of ``wavelength_sets``.
    """
    channels = RGB_FROM_XYZ @ responses_at_1_nm()
    points, weights = integration_points(WAVELENGTHS_NM, *([] if light is None else [light.grid.wavelengths_nm]))
    amount = weights if light is None else weights * np.maximum(light.at(points), 0.0)
    totals = np.array([amount @ np.interp(points, WAVELENGTHS_NM, channel) for channel in channels])
    if totals.max() <= 0.0:  # nothing of the light is visible
        totals = channels.sum(axis=1)
    parts = np.abs(channels) / np.maximum(totals, _LEAST_CHANNEL * totals.max())[:, None]
    together = (parts * _channel_weights(channels, tints)[:, None]).sum(axis=0) ** (_FLATTEST if of_sets else _FLATTER)
    away = np.arange(-3 * SMOOTH_NM, 3 * SMOOTH_NM + 1)
    kernel = np.exp(-0.5 * (away / SMOOTH_NM) ** 2)
    return np.asarray(np.convolve(together, kernel / kernel.sum(), mode="same"))


def _channel_weights(channels: Array, tints: Sequence[Array]) -> Array:
    """Typical red, green and blue of reflectances, relative to the strongest, (3,)."""
    if not tints:
        return np.ones(3)
    seen = np.stack(tints) @ channels.T / channels.sum(axis=1)
    typical = np.sqrt(np.square(seen).mean(axis=0))
    # black surfaces tell nothing; a channel that no surface reflects still gets light from lamps
    return np.maximum(typical, _LEAST_WEIGHT * typical.max()) if typical.max() > 0 else np.ones(3)


def responses_at_1_nm() -> Array:
    """The observer at each whole nm, (3, 471)."""
    viewer = observer(STANDARD)
    return np.stack([np.interp(WAVELENGTHS_NM, viewer.wavelengths_nm, row, left=0, right=0) for row in viewer.cmfs])
