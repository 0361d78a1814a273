# SPDX-License-Identifier: GPL-3.0-or-later
"""Metals by two colors: known indices there and back, and the reflectance by Fresnel's formula in complex numbers."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.spectra.metal import MOST_FACING, colors_of_metal, index_of_metal

METALS = [0.13 + 3.99j, 0.92 + 6.37j, 2.91 + 3.08j, 1.35 + 0.1j, 0.24 + 3.42j]
"""Silver, aluminum, iron, a dull one, copper, near 600 nm."""


@pytest.mark.parametrize("metal", METALS)
def test_the_colors_of_a_metal_are_its_reflectance_and_give_its_index(metal: complex) -> None:
    facing, edge = colors_of_metal(metal.real, metal.imag)
    assert facing == pytest.approx(abs((metal - 1) / (metal + 1)) ** 2, rel=1e-12)
    index, extinction = index_of_metal(facing, edge)
    assert complex(index, extinction) == pytest.approx(metal, rel=1e-9)


def test_both_ends_of_the_tint_and_of_the_reflectance() -> None:
    reflectances = np.array([0.04, 0.5, 0.9])
    index, extinction = index_of_metal(reflectances, np.zeros(3))  # a dielectric: no extinction
    np.testing.assert_allclose(extinction, 0.0, atol=1e-6)
    np.testing.assert_allclose(((index - 1) / (index + 1)) ** 2, reflectances, rtol=1e-12)
    index, extinction = index_of_metal(reflectances, np.ones(3))
    np.testing.assert_allclose(np.abs((index + 1j * extinction - 1) / (index + 1j * extinction + 1)) ** 2, reflectances)
    for outside, limit in ((1.0, MOST_FACING), (-0.5, 0.0)):
        np.testing.assert_array_equal(index_of_metal(outside, 0.3), index_of_metal(limit, 0.3))
    assert np.all(np.isfinite(colors_of_metal([1.0, 0.0, -1.0], [0.0, 0.0, -1.0])))
