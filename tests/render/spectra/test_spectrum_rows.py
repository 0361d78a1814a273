# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra in rows of a table: equal to the spectrum everywhere, zero outside its knots, in any order."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.render.plugins.numbers import table
from spectral_core.render.plugins.paints import spectrum_rows
from spectral_core.render.variant import activate, choose_backend
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum


def test_rows_are_the_spectra() -> None:
    mi = activate(choose_backend("spectral"))
    rng = np.random.default_rng(60221)
    grids = [np.arange(400.0, 701.0, 10.0), np.arange(360.0, 831.0), np.array([300.0, 301.0, 588.0, 590.0, 830.0])]
    spectra = [Spectrum("row", SpectralGrid(knots), rng.uniform(0.1, 1.0, knots.size)) for knots in grids]
    values = table(mi.Float, [spectrum_rows.row(spectrum) for spectrum in spectra])
    nm = rng.uniform(290.0, 840.0, (4, 20_000)).astype(np.float32)
    number = rng.integers(0, len(spectra), nm.shape[1])
    found = np.array(spectrum_rows.look_up(values, mi.UInt32(number), mi.Spectrum(nm), mi.Bool(True)))
    for which, spectrum in enumerate(spectra):
        mine = number == which
        # zero outside: no line from the last value to zero at the next whole nm
        np.testing.assert_allclose(found[:, mine], spectrum.at(nm[:, mine].astype(np.float64)), atol=2e-4)


@pytest.mark.parametrize(("knots", "fits"), [([400.0, 405.0, 700.0], True), ([400.0, 405.5, 700.0], False)])
def test_only_whole_nm_fit(knots: list[float], fits: bool) -> None:
    spectrum = Spectrum("any", SpectralGrid(np.array(knots)), np.ones(len(knots)))
    assert spectrum_rows.fits(spectrum) is fits
