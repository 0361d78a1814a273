# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra as rows of one table: any number of them needs no more code than one, and another needs no new kernel."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene.fluorescent import EXCITED_NM
from spectral_core.spectra.spectrum import Spectrum

FIRST_NM, CELLS = float(EXCITED_NM[0]), EXCITED_NM.size - 1
WIDTH = 2 * (CELLS + 1)
"""Numbers of a row: the values at both ends of each cell of 1 nm, which are read at once, after a pair of zeros."""


def fits(spectrum: Spectrum) -> bool:
    """True if a row represents a spectrum exactly: if it has its knots at whole nm."""
    knots = spectrum.grid.wavelengths_nm
    return bool(np.array_equal(knots, np.round(knots)))


def row(spectrum: Spectrum) -> NDArray[np.float32]:
    """Numbers of a spectrum, (WIDTH,): linear between its knots, zero outside, without a slope at its ends."""
    values, knots = spectrum.at(EXCITED_NM), spectrum.grid.wavelengths_nm
    inside = (EXCITED_NM[:-1] >= knots[0]) & (EXCITED_NM[1:] <= knots[-1])
    pairs = np.stack([values[:-1], values[1:]], axis=1) * inside[:, None]
    return np.concatenate([np.zeros(2), pairs.ravel()]).astype(np.float32)


def look_up(table: Any, number: Any, wavelengths: Any, active: Any) -> Any:
    """Values of a row of ``table`` at a path's wavelengths."""
    import drjit as dr
    import mitsuba as mi

    first, values = number * (CELLS + 1), []
    for k in range(len(wavelengths)):
        # outside the table the first pair, of zeros, is read
        place = wavelengths[k] - (FIRST_NM - 1.0)
        place = dr.select((place >= 1.0) & (place < CELLS + 1.0), place, 0.0)
        low = mi.UInt32(place)
        pair = dr.gather(mi.Vector2f, table, first + low, active)
        values.append(dr.lerp(pair.x, pair.y, place - mi.Float(low)))
    return mi.Spectrum(*values)
