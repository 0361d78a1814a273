# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of pictures whose light comes on rare paths, at edges, or was sampled by its own noise: all against the exact
limit of drawn numbers.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from spectral_core.render.cost.errors import Wide, expected_errors, repetition
from spectral_core.render.cost.probe import Probe
from spectral_core.render.cost.resample import BLOCK, pools
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb

WIDTH, COUNT = 128, 8192
POOLS, BLOCKS = (pools(np.arange(COUNT), WIDTH, shape) for shape in ((4, 2), BLOCK))


def true_error(picture, limit):
    return delta_e_2000(*(lab_from_linear_rgb(np.maximum(each, 0.0)) for each in (picture, limit))).mean()


def rare(rng, samples, chance=0.0005, times=100.0):
    """(2, samples, COUNT, 3): gray light of which few paths carry many times as much; and its limit."""
    drawn = 0.2 * (1 + times * (rng.random((2, samples, COUNT, 1)) < chance)) * np.ones(3)
    return drawn, np.full((COUNT, 3), 0.2 * (1 + times * chance))


def edges(rng, samples):
    """The same of a picture with noise in one pixel of eight, and its limit."""
    place = np.arange(COUNT)[:, None] % 8 == 3
    drawn = 0.3 + place * rng.normal(0, 0.2, (2, samples, COUNT, 1)) * np.ones(3)
    return drawn, np.full((COUNT, 3), 0.3)


def told(drawn, first, last):
    """What early and later samples repeat of each other."""
    early, late = (drawn[:, :count].mean(axis=1) for count in (first, last))
    return tuple(repetition(early, late, (first, last), POOLS, BLOCKS))


@pytest.mark.parametrize("samples", [8, 32])
def test_light_that_most_pools_have_not_met_is_told_by_their_blocks(rng, samples):
    drawn, limit = rare(rng, 4 * samples)
    halves = drawn[:, :samples].mean(axis=1)
    true = true_error(halves.mean(axis=0), limit)
    repeated = told(drawn, samples, 4 * samples)
    assert max(repeated) < 0.15
    assert expected_errors(halves, POOLS).mean() < 0.82 * true  # pools alone
    assert 0.88 * true < expected_errors(halves, POOLS, Wide(BLOCKS, repeated)).mean() < 1.15 * true


def test_noise_that_stays_in_its_place_is_not_that_of_its_neighbors(rng):
    drawn, limit = edges(rng, 64)
    halves = drawn[:, :16].mean(axis=1)
    true = true_error(halves.mean(axis=0), limit)
    repeated = told(drawn, 16, 64)
    assert repeated[0] > 0.35
    assert expected_errors(halves, POOLS).mean() > 1.3 * true  # pools alone
    assert 0.85 * true < expected_errors(halves, POOLS, Wide(BLOCKS, repeated)).mean() < 1.2 * true


def test_pools_that_are_noisier_than_their_neighbors_are_not_blended_with_them(rng):
    """One pool of four has rare light: it is repeated between pools, and not within them."""
    drawn, _ = rare(rng, 128, chance=0.02, times=30.0)
    drawn = np.where((POOLS % 2 == 0)[:, None] & (np.arange(COUNT) // WIDTH % 4 < 2)[:, None], drawn, 0.2)
    in_pool, in_block = told(drawn, 32, 128)
    assert in_block > 0.5 and in_pool < 0.2


def test_a_picture_that_was_sampled_by_its_own_noise_is_compared_with_a_probe(rng):
    """Blocks whose two halves differ get four times the samples: the others are no better than they look."""
    drawn, limit = rare(rng, 64, chance=0.006, times=30.0)
    first = drawn[:, :2].mean(axis=1)
    shown = np.bincount(BLOCKS, np.abs(first[0] - first[1])[:, 0])[BLOCKS] > 0
    counts = np.where(shown, 8, 2)
    halves = np.where(shown[:, None], drawn[:, :8].mean(axis=1), first)
    true = true_error(halves.mean(axis=0), limit)
    errors = expected_errors(halves, POOLS, Wide(BLOCKS))
    assert errors.mean() < 0.8 * true
    probe = SimpleNamespace(pixels=np.arange(COUNT), samples=64, halves=lambda: drawn.mean(axis=1))
    assert errors.mean() * Probe.compared(probe, halves, counts, errors) == pytest.approx(true, rel=0.15)
    assert Probe.compared(probe, halves, 8 * counts, errors) is None  # the probe has too few samples for it
