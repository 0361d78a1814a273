# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels of a view as the graphics card gets them."""

from __future__ import annotations

import numpy as np
import pytest

from blender_addon.drawing.viewport import LARGEST_HALF, half_pixels

MATRIX = np.array([[0.6, 0.3, 0.1], [0.1, 0.8, 0.1], [0.0, 0.1, 0.9]])


@pytest.mark.parametrize("matrix", [None, MATRIX])
def test_pixels_are_converted_and_stay_finite(matrix):
    pixels = np.random.default_rng(1).uniform(0, 2, (5, 7, 4)).astype(np.float32)
    pixels[0, 0], pixels[1, 1, 3] = np.inf, 0.25
    given, out = pixels.copy(), np.full_like(pixels, np.nan)
    half_pixels(pixels, matrix, out)
    wanted = np.minimum(given, LARGEST_HALF)
    if matrix is not None:
        wanted[..., :3] = np.minimum(wanted[..., :3] @ matrix.T, LARGEST_HALF)
    np.testing.assert_allclose(out, wanted, rtol=1e-6)
    assert np.isfinite(out.astype(np.float16)).all()
    np.testing.assert_array_equal(pixels, given)
