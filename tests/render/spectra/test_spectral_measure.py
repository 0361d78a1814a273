# SPDX-License-Identifier: GPL-3.0-or-later
"""Wavelengths and colors as kernels compute them: exact in the mean for any light, halves of a picture independent."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.render.trace.chosen_pixels import _SEED_STEP
from spectral_core.render.trace.measure.slots import SLOTS, in_slots
from spectral_core.render.trace.measure.spectral_measure import SpectralMeasure
from spectral_core.render.trace.path.sampler import hashed_seed, path_sampler_class
from spectral_core.render.trace.wavelengths import Bands, WavelengthPlan, plan_wavelengths
from spectral_core.render.variant import activate, choose_backend
from spectral_core.spectra import catalogue
from spectral_core.spectra.spectrum import WAVELENGTHS_NM, Illuminant, SpectralGrid, Spectrum

PIXELS, SAMPLES = 1 << 13, 40
"""The last 8 samples belong to a second group of 32."""
TUBE = Illuminant(
    "tube",
    SpectralGrid(np.array([380.0, 435.82, 435.83, 435.84, 546.06, 546.07, 546.08, 611.39, 611.4, 611.41, 780.0])),
    np.array([0.1, 0.1, 900.0, 0.1, 0.1, 2000.0, 0.1, 0.1, 1500.0, 0.1, 0.1]),
)


@pytest.fixture(scope="module")
def mi() -> Any:
    return activate(choose_backend("spectral"))


def measured(mi: Any, plan: WavelengthPlan, light: Spectrum, seed: int = 0) -> np.ndarray:
    """XYZ that each pixel measures in each sample of a light: (samples, pixels, 3)."""
    import drjit as dr

    measure = SpectralMeasure(mi, plan)
    sampler = path_sampler_class(mi.variant())(mi.sample_tea_32(mi.UInt32(np.arange(PIXELS)), hashed_seed(seed), 6)[0])
    found = []
    for index in range(SAMPLES):
        sampler.begin(dr.opaque(mi.UInt32, index))  # one kernel for all
        wavelengths, drawn = measure.draw(sampler)
        radiance = mi.Spectrum(light.at(np.array(wavelengths).astype(np.float64)).astype(np.float32))
        found.append(np.array(measure.color(radiance, drawn)).T)
    return np.array(found, np.float64)


def integral(plan: WavelengthPlan, light: Spectrum) -> np.ndarray:
    """XYZ of a light: Simpson's rule between the knots of the light and the observer is exact for their products."""
    knots = np.union1d(WAVELENGTHS_NM, light.grid.wavelengths_nm)
    nm = np.stack([knots[:-1], (knots[1:] + knots[:-1]) / 2, knots[1:]])
    values = [light.at(nm) * np.interp(nm, WAVELENGTHS_NM, row) for row in plan.responses[:3]]
    return np.array([float(np.diff(knots) @ (v[0] + 4 * v[1] + v[2]) / 6) for v in values])


def random_light(rng: np.random.Generator) -> Spectrum:
    return Spectrum("random", SpectralGrid(WAVELENGTHS_NM), rng.random(471) ** 4)


@pytest.mark.parametrize("how", ["sets", "bands", "recording", "dispersion", "other lamp"])
@pytest.mark.parametrize("lamp", ["own", "random"])
def test_the_mean_of_samples_is_the_integral(mi: Any, rng: np.random.Generator, how: str, lamp: str) -> None:
    """The lamp that the plan knows, with lines of 0.01 nm, and light of which it knows nothing."""
    given = catalogue.illuminant("HP1") if how == "other lamp" else TUBE
    plan = plan_wavelengths(
        [given],
        Bands.uniform(count=5) if how in ("bands", "recording") else None,
        disperses=how == "dispersion",
        follow_bands=how != "recording",
    )
    assert (plan.sets is None) == (how in ("recording", "dispersion"))
    light = given if lamp == "own" else random_light(rng)
    found, exact = measured(mi, plan, light).mean(axis=0), integral(plan, light)
    deviation = found.std(axis=0) / np.sqrt(PIXELS)
    # single precision has its own part: positions of wavelengths within 6e-5 nm
    assert np.all(np.abs(found.mean(axis=0) - exact) < 4.5 * deviation + 5e-5 * exact.max())
    assert np.all(deviation < 0.05 * exact.max())


def test_errors_of_half_pictures_are_independent(mi: Any, rng: np.random.Generator) -> None:
    """Their difference is then the noise of both, also within a group of samples that complement each other."""
    light = random_light(rng)
    plan = plan_wavelengths([catalogue.illuminant("D65")])
    exact = integral(plan, light)
    halves = [measured(mi, plan, light, seed) for seed in (3, 3 + _SEED_STEP)]
    for count in (1, 8, 32, SAMPLES):
        first, second = (half[:count].mean(axis=0)[:, 1] - exact[1] for half in halves)
        assert abs(np.mean(first * second)) < 4.5 * np.std(first) * np.std(second) / np.sqrt(PIXELS)
        told = np.mean((first - second) ** 2) / 4
        assert told == pytest.approx(np.mean(((first + second) / 2) ** 2), rel=0.1)


def test_samples_of_a_group_complement_each_other(mi: Any, rng: np.random.Generator) -> None:
    light = random_light(rng)
    found = measured(mi, plan_wavelengths([catalogue.illuminant("D65")]), light)[:32, :, 1]
    assert np.var(found.mean(axis=0)) < 0.5 * np.var(found) / 32


def test_probabilities_are_whole_slots_and_keep_every_needed_cell(rng: np.random.Generator) -> None:
    share = rng.random(2000) ** 12
    needed = rng.random(2000) < 0.5
    share[:100] = 0.0
    found = in_slots(share, needed)
    assert found.sum() == 1.0 and np.array_equal(found * SLOTS, np.round(found * SLOTS))
    assert found[needed].min() >= 1 / SLOTS and not found[:100][~needed[:100]].any()
    ideal = share / share.sum()
    assert np.all(np.abs(found - ideal) < 1.5 / SLOTS + 0.05 * ideal)


@pytest.mark.parametrize(("share", "cells"), [(0.0, 5), (1.0, SLOTS)])
def test_shares_that_are_zero_or_too_many_are_refused(share: float, cells: int) -> None:
    with pytest.raises(InvalidInputError, match="expected fewer than 65536 and a share above 0"):
        in_slots(np.full(cells, share), np.ones(cells, bool))
