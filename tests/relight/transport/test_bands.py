# SPDX-License-Identifier: GPL-3.0-or-later
"""Bands of a recording: recognized by their centers, and complete for every light."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.render.relight.band_storage import BAND_COUNTS, BandStorage
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import xyz_of
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum


def test_a_storage_of_bands_is_recognized_by_its_grid() -> None:
    for count in BAND_COUNTS:
        assert BandStorage.of_grid(BandStorage(count).grid) == BandStorage(count)
    assert BandStorage.of_grid(None) is None
    assert BandStorage.of_grid(SpectralGrid.uniform(400, 700, 100)) is None
    assert BandStorage.of_grid(SpectralGrid(np.linspace(401.0, 700.0, 31))) is None


@pytest.mark.parametrize("count", BAND_COUNTS)
@pytest.mark.parametrize("peak", [385.0, 550.0, 712.0])
def test_the_bands_of_a_light_add_up_to_its_color(count: int, peak: float) -> None:
    """The outermost bands reach to the ends of the spectrum: a deep red or violet lamp loses nothing."""
    knots = np.arange(360.0, 831.0)
    lamp = Spectrum("lamp", SpectralGrid(knots), np.maximum(0.0, 1.0 - np.abs(knots - peak) / 6.0))
    shown = BandStorage(count).rgb_from_channels(lamp).sum(axis=1)
    np.testing.assert_allclose(shown, RGB_FROM_XYZ @ xyz_of(lamp), rtol=1e-9, atol=1e-12)
