# SPDX-License-Identifier: GPL-3.0-or-later
"""Predictions for motion blur: the moments are pictures of their own, whose noise averages out."""

from __future__ import annotations

import pytest

from spectral_core.render.cost.curve import of_moments
from spectral_core.render.cost.model import CostModel


def test_the_noise_of_moments_is_that_of_few_samples_averaged():
    """Evenly spread numbers: sixteen samples have an eighth of the error of two, eight pairs of them have more."""
    model = CostModel((2, 16, 64), (8.0, 1.0, 0.5), 0.1, 2.0)
    still, moving = of_moments(model, 16, 1), of_moments(model, 16, 8)
    assert still == model.for_samples(16)
    assert moving.delta_e == pytest.approx(8.0 / 8**0.5) and moving.samples == 16 and moving.work == still.work
