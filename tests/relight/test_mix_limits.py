# SPDX-License-Identifier: GPL-3.0-or-later
"""Intensities beyond single precision are refused; they became Inf and NaN in the picture."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.render.relight.mix import BRIGHTEST, relight
from spectral_core.render.relight.storage import MixtureStorage
from spectral_core.render.relight.transport import Transport


def test_a_factor_beyond_single_precision_is_refused() -> None:
    channels, coverage = np.full((2, 3, 2, 2), 0.5, np.float32), np.ones((2, 2), np.float32)
    channels[0, :, 0, 0] = 0.0
    transport = Transport(MixtureStorage(), ("a", "b"), channels, coverage, (None, None), 100.0, "hash", 1, 0)
    with pytest.raises(InvalidInputError, match=r"light intensity of 1e\+39 times the exposure of 100"):
        relight(transport, mix={"a": 1e39})
    shown = relight(transport, mix={"a": BRIGHTEST / 100, "b": 0.0})
    np.testing.assert_allclose(shown[1, 1, :3], 0.5 * BRIGHTEST, rtol=1e-6)
    assert not shown[0, 0, :3].any()
