# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights of sets of four wavelengths: exact in the mean for any spectrum, and quiet for smooth reflectances."""

from __future__ import annotations

from itertools import combinations_with_replacement, product

import numpy as np
import pytest

from spectral_core.render.trace.measure.least_variance import least_variance, low_rank_root
from spectral_core.render.trace.measure.wavelength_sets import SAMPLES, SHIFTS, STEPS, TEETH
from spectral_core.render.trace.wavelengths import WavelengthPlan, plan_wavelengths
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.spectrum import WAVELENGTHS_NM, Illuminant, SpectralGrid, Spectrum
from spectral_core.spectra.upsample import reflectance_from_rgb

GRID = SpectralGrid(WAVELENGTHS_NM)
GRAY = Spectrum("gray", GRID, np.full(471, 0.5))
ROUGH = Spectrum("rough", GRID, np.random.default_rng(5).random(471))
RED = reflectance_from_rgb([0.6, 0.1, 0.1], GRID)
FINE = 24
"""Positions within a step."""


def colors(
    plan: WavelengthPlan, light: Spectrum, surface: Spectrum, *, equal: bool = False, order: int = 0
) -> np.ndarray:
    """Linear sRGB of a sample by shift, step and position within the step: (SHIFTS, STEPS, FINE, 3).

    ``equal``: the four wavelengths of a comb with equal weights. ``order``: 0 for light that at most one surface
    has reflected, 1 for two, 2 for more.
    """
    assert plan.sets is not None
    step = np.arange(STEPS)[None, :, None, None]
    shifts = plan.sets.shifts[:, None, None, :] * (not equal)
    rest = (np.arange(FINE)[None, None, :, None] + 0.5) / FINE
    place = ((step + shifts) % STEPS + STEPS * np.arange(TEETH) + rest) / (STEPS * TEETH)
    ends = np.concatenate([[0.0], np.cumsum(plan.probability)])
    ends /= ends[-1]
    cell = np.clip(np.searchsorted(ends, place, side="right") - 1, 0, plan.probability.size - 1)
    within = (place - ends[cell]) / plan.probability[cell]
    start, _, end = plan.pieces[:, :3]
    weight = np.moveaxis(start[:, cell] * (1 - within) + end[:, cell] * within, 0, -1) / TEETH
    if not equal:
        weight = weight + plan.sets.corrections[order][:, :, None]
    nm = plan.edges_nm[cell] + within * plan.widths_nm[cell]
    radiance = light.at(nm) * surface.at(nm) / (plan.probability[cell] / plan.widths_nm[cell])
    return (weight * radiance[..., None]).sum(axis=3) @ RGB_FROM_XYZ.T


def exact(plan: WavelengthPlan, light: Spectrum, surface: Spectrum) -> np.ndarray:
    """Linear sRGB by a sum of 0.005 nm."""
    nm = np.arange(360.0025, 830.0, 0.005)
    product = light.at(nm) * surface.at(nm) * 0.005
    return RGB_FROM_XYZ @ [float(np.interp(nm, WAVELENGTHS_NM, row) @ product) for row in plan.responses[:3]]


def variance(found: np.ndarray) -> float:
    """Of one sample, relative to its mean color."""
    flat = found.reshape(-1, 3)
    return float(flat.var(axis=0).sum() / np.square(flat.mean(axis=0)).sum())


@pytest.mark.parametrize("name", ["D65", "A", "HP1", "FL11"])
@pytest.mark.parametrize("surface", [GRAY, RED, ROUGH], ids=["gray", "red", "rough"])
def test_the_mean_is_the_integral_for_any_spectrum(name: str, surface: Spectrum) -> None:
    light = catalogue.illuminant(name)
    plan = plan_wavelengths([light])
    expected = exact(plan, light, surface)
    for order in range(3):
        mean = colors(plan, light, surface, order=order).mean(axis=(0, 1, 2))
        np.testing.assert_allclose(mean, expected, atol=2e-3 * expected.max())


def even_line(position: float, half_width: float) -> Illuminant:
    """A line of two samples of equal power."""
    return Illuminant("line", SpectralGrid(position + half_width * np.array([-1.0, 1.0])), np.ones(2))


def test_each_wavelength_keeps_its_mean_weight() -> None:
    """Corrections of one bin cancel over the shifts: this alone makes every spectrum exact in the mean."""
    daylight, lasers = catalogue.illuminant("D65"), [even_line(nm, 0.05) for nm in (450.0, 532.0, 638.0)]
    for lights in (
        [],
        [catalogue.illuminant("FL2")],
        [catalogue.illuminant("A"), catalogue.illuminant("HP1")],
        [daylight, *lasers],  # off by 8 % in a bin
        [even_line(589.3, 0.05)],  # had no solution: the render ended in an error
        [even_line(632.8, 0.001)],
    ):
        sets = plan_wavelengths(lights).sets
        assert sets is not None
        bins = (np.arange(STEPS)[None, :, None] + sets.shifts[:, None]) % STEPS + STEPS * np.arange(TEETH)
        total = np.zeros((STEPS * TEETH, 3))
        assert np.bincount(bins.ravel()).tolist() == [SHIFTS] * (STEPS * TEETH)
        for corrections in sets.corrections:  # of light after one reflection, after two, and after more
            total[:] = 0.0
            np.add.at(total, bins, corrections)
            # of an even line, all bins have the same light
            tolerance = 1e-9 if all(light.grid.size > 2 for light in lights) else 2e-6
            np.testing.assert_allclose(total, 0.0, atol=tolerance * np.abs(corrections).max())
        assert np.abs(sets.corrections).max() > 0.01


@pytest.mark.parametrize(("name", "most"), [("D65", 0.006), ("A", 0.006), ("E", 0.006), ("FL2", 0.004), ("HP1", 0.003)])
def test_four_wavelengths_measure_a_gray_surface(name: str, most: float) -> None:
    """0.001 to 0.004; 0.008 to 0.04 with equal weights."""
    light = catalogue.illuminant(name)
    plan = plan_wavelengths([light])
    ours = variance(colors(plan, light, GRAY))
    assert ours < most
    assert ours < 0.5 * variance(colors(plan, light, GRAY, equal=True))


@pytest.mark.parametrize("name", ["D65", "FL2", "HP1"])
def test_colors_of_the_scene_are_quieter_than_with_equal_weights(name: str) -> None:
    light = catalogue.illuminant(name)
    plan = plan_wavelengths([light], colors=[RED])
    assert variance(colors(plan, light, RED)) < 0.75 * variance(colors(plan, light, RED, equal=True))


def test_the_samples_of_one_shift_spread_evenly() -> None:
    """The mean over every second step is quiet for a rough spectrum too: its wavelengths fill the spectrum."""
    light = catalogue.illuminant("D65")
    found = colors(plan_wavelengths([light]), light, ROUGH)
    each = STEPS // SAMPLES
    for first in range(each):
        assert variance(found[:, first::each].mean(axis=1)) < 0.9 * variance(found) / SAMPLES


def test_light_without_power_and_light_of_a_line_have_finite_weights() -> None:
    line = Illuminant("line", SpectralGrid(np.array([588.99, 589.0, 589.01])), np.array([0.0, 1.0, 0.0]))
    unseen = Illuminant("unseen", SpectralGrid(np.array([300.0, 310.0])), np.array([1.0, 1.0]))
    for light in (line, unseen):
        sets = plan_wavelengths([light]).sets
        assert sets is not None and np.isfinite(sets.corrections).all()
        assert np.abs(sets.corrections).max() < 20.0


def bands(*peaks_nm: float) -> Spectrum:
    """A reflectance of narrow bands, as palettes are designed."""
    values = sum(np.exp(-0.5 * ((WAVELENGTHS_NM - peak) / 15) ** 2) for peak in peaks_nm)
    return Spectrum("bands", GRID, 0.9 * values / values.max())


@pytest.mark.parametrize("name", ["D65", "FL11"])
def test_narrow_bands_of_known_reflectances_have_little_noise(name: str) -> None:
    """0.001 to 0.004 for one reflectance; 0.1 to 0.7 with equal weights."""
    light, first, second = catalogue.illuminant(name), bands(470, 560), bands(440, 520, 640)
    plan = plan_wavelengths([light], reflectances=[first, second])
    for surface in (first, second):
        expected = exact(plan, light, surface)
        found = colors(plan, light, surface)
        np.testing.assert_allclose(found.mean(axis=(0, 1, 2)), expected, atol=2e-3 * expected.max())
        assert variance(found) < 0.005
        assert variance(found) < 0.06 * variance(colors(plan, light, surface, equal=True))


@pytest.mark.parametrize("name", ["D65", "FL11"])
def test_light_of_each_number_of_reflections_has_the_weights_that_suit_it(name: str) -> None:
    """Of products of two and of three reflectances, whose peaks are narrower than those of each."""
    light, looks = catalogue.illuminant(name), (bands(470, 560), bands(440, 520, 640))
    plan = plan_wavelengths([light], reflectances=looks)
    for order in range(3):
        noise = np.zeros(3)
        for chosen in combinations_with_replacement(looks, order + 1):
            both = Spectrum("product", GRID, np.prod([look.values for look in chosen], axis=0))
            energy = np.square(exact(plan, light, both)).sum()
            noise += [energy * variance(colors(plan, light, both, order=other)) for other in range(3)]
        assert np.argmin(noise) == order
        assert noise[order] < 0.9 * np.delete(noise, order).min()


def test_the_sets_of_a_scene_are_solved_once() -> None:
    light, other = catalogue.illuminant("D65"), catalogue.illuminant("A")
    copy = Illuminant("copy", light.grid, light.values.copy())
    first, same = (plan_wavelengths([each], reflectances=[RED]).sets for each in (light, copy))
    assert first is same
    for sets in (plan_wavelengths([other], reflectances=[RED]).sets, plan_wavelengths([light]).sets):
        assert sets is not None and first is not None and not np.array_equal(sets.corrections, first.corrections)


@pytest.mark.parametrize("stratum", [1, 2])
def test_least_variance_against_a_dense_solution(stratum: int) -> None:
    """The same quadratic problem with its condition, as one system of linear equations. The variance of a mean of one
    step from each stratum is that over all possible choices.
    """
    rng, (shifts, steps, teeth), single = np.random.default_rng(2), (3, 4, 2), 2.5
    count = steps * teeth
    factor = rng.standard_normal((count, 3))
    covariance = factor @ factor.T + np.diag(rng.uniform(0.1, 0.3, count))
    expected, means = rng.standard_normal((2, 3, count))
    sets = np.stack([rng.permutation(count).reshape(steps, teeth) for _ in range(shifts)])
    quadratic, linear = np.zeros((shifts * count, shifts * count)), np.zeros((3, shifts * count))
    condition = np.zeros((count, shifts * count))
    for shift in range(shifts):
        own = slice(shift * count, (shift + 1) * count)
        members = sets[shift].ravel()
        between = covariance[np.ix_(members, members)]
        together = np.kron(np.eye(steps), np.ones((teeth, teeth)))
        quadratic[own, own] = single * together * between / steps
        choices = list(product(*np.arange(steps).reshape(-1, stratum)))
        for chosen in choices:
            share = np.repeat(np.isin(np.arange(steps), chosen), teeth) * stratum
            quadratic[own, own] += np.outer(share, share) * between / steps / len(choices)
        linear[:, own] = (single / steps + 1.0) * expected[:, members]
        condition[members, np.arange(own.start, own.stop)] = 1.0
    system = np.block([[quadratic, condition.T], [condition, np.zeros((count, count))]])
    solution = np.linalg.solve(system, np.concatenate([linear, shifts * means], axis=1).T).T[:, : shifts * count]
    ours = least_variance(covariance, expected, means, sets, single, stratum)
    np.testing.assert_allclose(ours.reshape(3, -1), solution, rtol=1e-4, atol=1e-6)


def test_the_low_rank_root() -> None:
    factor = np.random.default_rng(4).standard_normal((90, 20))
    root = low_rank_root(factor @ factor.T)
    assert root.shape == (90, 20)
    np.testing.assert_allclose(root @ root.T, factor @ factor.T, atol=1e-8)
    assert low_rank_root(np.diag(np.arange(90.0))).shape[1] == 64
