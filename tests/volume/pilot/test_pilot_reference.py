# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference of pilot rays where rounding sets the limit, and where two rules have errors of the same sign."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spectral_core.volume.image import Stepping
from spectral_core.volume.pilot.reference import refined_reference, snr_db

RAYS = 2000
EXACT = np.ones((RAYS, 3))


def _march(error, rounding):
    """Marches with an error of ``error``·step² by rule, of one sign, and random roundings that grow as 1/step."""
    rng, seen = np.random.default_rng(5), []

    def march(way: Stepping):
        seen.append(way)
        return EXACT + error[way.rule] * way.scale**2 + rounding / way.scale * rng.normal(size=(RAYS, 1))

    return march, seen


@pytest.mark.parametrize("rounding", [1e-7, 1e-6, 1e-5])
def test_a_reference_is_not_refined_into_rounding(rounding):
    """Steps of 1/512 voxel had an error of 85 dB by rounding where those of 1/16 had 92: 85 dB were stated for 94."""
    march, seen = _march({"error": 1e-3, "uniform": 1e-3}, rounding)
    made = refined_reference(march, "preintegrated", 106.0)
    true = snr_db(EXACT, made.colors - EXACT)
    best = max(snr_db(EXACT, march(way) - EXACT) for way in {way for way in seen if way.rule == "uniform"})
    assert true > best - 7.0
    assert made.snr_db <= true + 1.0
    assert made.snr_db > min(true, 90.0) - 7.0
    # Two falls end it: not all halvings down to 1/512 are marched.
    assert min(way.scale for way in seen if way.rule == "uniform") > 1 / 512


def test_a_fall_among_marches_that_differ_much_does_not_end_the_halving():
    """A feature that coarse steps miss and finer ones meet lowers the agreement for once."""
    agreements = iter([0.5, 1e-2, 3e-2, 9e-2, 1e-4, 1e-5])
    total = 0.0

    def march(way):
        nonlocal total
        total += next(agreements, 0.0)
        return EXACT + total

    made = refined_reference(march, "midpoint", 60.0)
    assert made.scale == 0.5 / 2**4 and made.colors[0, 0] == pytest.approx(1.6302, abs=1e-3)


@pytest.mark.parametrize("errors", [{"error": 1e-3, "uniform": 0.1}, {"error": 0.3, "uniform": 1e-3}])
def test_the_reference_is_clearly_better_than_the_agreement(errors):
    """Errors of both rules have the same sign, so that a picture by uniform steps seemed 2 dB better than it was."""
    march, _ = _march(errors, 0.0)
    for agreement in (50.0, 60.0, 70.0):
        made = refined_reference(march, "preintegrated", agreement)
        assert snr_db(EXACT, made.colors - EXACT) > agreement + 10.0


@pytest.mark.parametrize("order", [1, 2])
def test_the_stated_error_of_a_reference_holds_at_first_and_second_order(order):
    """At first order half of an error is left by a halving: 6 dB more than the agreement of two marches were stated."""

    def march(way):
        return EXACT + 0.05 * way.scale**order * (1.0 if way.rule == "uniform" else -1.0)

    for agreement in (40.0, 50.0, 60.0):
        made = refined_reference(march, "preintegrated", agreement)
        true = snr_db(EXACT, made.colors - EXACT)
        assert true - 16.0 < made.snr_db < true + 0.5


def test_marches_that_do_not_differ_have_no_error():
    made = refined_reference(lambda way: EXACT, "midpoint", 60.0)
    assert made.snr_db == math.inf
