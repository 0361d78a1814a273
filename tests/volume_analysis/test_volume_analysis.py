# SPDX-License-Identifier: GPL-3.0-or-later
"""The sampling theory of g(f(x)): band limits, the transfer kernel with its cone and Airy edge, reconstruction."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spectral_core.errors import InvalidInputError
from spectral_core.volume.analysis import (
    SampledFunction,
    composite_bandlimit,
    cone_edges,
    energy_beyond,
    essential_bandlimit,
    frequency_transfer_kernel,
    reconstruction_snr,
    sample_composition,
    steepest_slope,
)
from spectral_core.volume.analysis.sampling import RegularSamples
from spectral_core.volume.field import ScalarVolume
from tests.volume_analysis.signals import (
    THESIS_F,
    THESIS_G,
    thesis_f,
    thesis_g,
    trigonometric,
    trigonometric_polynomial,
)

SHEARED = ScalarVolume("bent", np.random.default_rng(0).random((3, 3, 3)), np.eye(4) + np.eye(4, k=1) * [0, 1, 0, 0])


# Band limits


def test_pure_frequencies_are_found_exactly():
    cosine = SampledFunction.of(lambda x: 3 + np.cos(7 * x), 0, 2 * np.pi, 256, periodic=True)
    assert essential_bandlimit(cosine) == pytest.approx(7, rel=1e-12)
    mirrored = SampledFunction.of(lambda x: 3 + np.cos(7 * x), 0, np.pi, 257)
    assert essential_bandlimit(mirrored) == pytest.approx(7, rel=1e-12)


def test_a_constant_has_band_limit_zero():
    for periodic in (False, True):
        constant = SampledFunction.regular(np.full(100, 0.3), periodic=periodic)
        assert essential_bandlimit(constant) == 0
        assert energy_beyond(constant, 0) == 0
    assert composite_bandlimit(constant, THESIS_G).sample_distance() == math.inf


def test_the_energy_fraction_determines_the_band_limit():
    two_tones = SampledFunction.of(
        lambda x: 3 * np.cos(2 * x) + np.cos(9 * x), 0, 2 * np.pi, 512, periodic=True
    )  # 90 % and 10 %
    assert essential_bandlimit(two_tones, 0.89) == pytest.approx(2)
    assert essential_bandlimit(two_tones, 0.91) == pytest.approx(9)
    assert energy_beyond(two_tones, 5) == pytest.approx(0.1, abs=1e-12)


def test_bandlimit_in_three_variables_is_the_norm_of_the_wave_vector():
    x, y, z = np.meshgrid(*[np.arange(32) * 2 * np.pi / 32] * 3, indexing="ij")
    wave = SampledFunction.regular(np.sin(2 * x + 3 * y + 6 * z), 2 * np.pi / 32, periodic=True)
    assert essential_bandlimit(wave) == pytest.approx(7, rel=1e-12)


def test_slope_of_the_interpolant_bounds_every_slope_between_samples():
    from scipy.interpolate import RegularGridInterpolator

    rng = np.random.default_rng(5)
    values = rng.random((5, 6, 4))
    bound = steepest_slope(SampledFunction.regular(values, (0.5, 1.0, 2.0)))
    axes = [np.arange(n) * d for n, d in zip(values.shape, (0.5, 1.0, 2.0), strict=True)]
    trilinear = RegularGridInterpolator(axes, values)
    points = rng.random((4000, 3)) * [a[-1] - 2e-3 for a in axes] + 1e-3
    gradient = [(trilinear(points + s) - trilinear(points - s)) / 2e-4 for s in np.eye(3) * 1e-4]
    measured = np.linalg.norm(gradient, axis=0).max()
    assert measured <= bound * (1 + 1e-9)
    assert bound < 1.5 * measured


def test_thesis_example_needs_nearly_five_times_fewer_samples():
    limit = composite_bandlimit(THESIS_F, THESIS_G)
    assert limit.transfer_bandlimit == pytest.approx(2 * np.pi, rel=1e-12)
    assert limit.max_slope == pytest.approx(
        9 / 20 * np.pi / 2 + 1 / 20 * 4 * np.pi, rel=2e-5
    )  # slope of the linear interpolant
    assert limit.frequency == pytest.approx(limit.transfer_bandlimit * limit.max_slope)
    assert limit.product_frequency / limit.frequency == pytest.approx(4.63, abs=0.01)


def test_a_single_sinusoid_gets_the_same_rate_from_both_bounds():
    sinusoid = SampledFunction.of(lambda x: 0.5 + 9 / 20 * np.sin(np.pi / 2 * x), 0, 4, 4096, periodic=True)
    limit = composite_bandlimit(sinusoid, THESIS_G)
    assert limit.frequency == pytest.approx(limit.product_frequency, rel=1e-6)


@given(trigonometric)
@settings(max_examples=60, deadline=None)
def test_the_bound_never_exceeds_the_product_bound(terms):
    """Bernstein's inequality, for every band-limited f."""
    f = SampledFunction.of(trigonometric_polynomial(terms)[0], 0, 2 * np.pi, 4096, periodic=True)
    limit = composite_bandlimit(f, THESIS_G, energy=1.0 - 1e-12)
    # the range of the samples is smaller by at most the parabola between two of them
    assert limit.frequency <= limit.product_frequency * (1 + 1e-4)


@given(trigonometric, st.floats(20, 150))
@settings(max_examples=40, deadline=None)
def test_energy_beyond_the_bound_is_the_airy_tail(terms, nu):
    """Four Airy lengths beyond ω_h the energy is negligible: Ai(4)² is 1e-6 of the peak."""
    f, slope, third = trigonometric_polynomial(terms)
    x = np.linspace(0, 2 * np.pi, 8192, endpoint=False)
    bound = nu * np.abs(slope(x)).max()
    airy_length = np.cbrt(nu * np.abs(third(x)).max() / 2)
    composed = SampledFunction.regular(np.exp(1j * nu * f(x)).real, x[1], periodic=True)
    assert energy_beyond(composed, bound + 4 * airy_length) < 1e-5


@given(st.floats(0.1, 10), st.floats(0.1, 10))
@settings(max_examples=20, deadline=None)
def test_stretching_space_or_data_scales_the_bound(stretch, gain):
    plain = composite_bandlimit(THESIS_F, THESIS_G)
    stretched = SampledFunction.regular(THESIS_F.values * gain, THESIS_F.spacing[0] * stretch, periodic=True)
    scaled = composite_bandlimit(stretched, THESIS_G)
    assert scaled.frequency == pytest.approx(plain.frequency * gain / stretch, rel=1e-9)
    assert scaled.product_frequency == pytest.approx(plain.product_frequency * gain / stretch, rel=1e-9)


def test_a_given_slope_replaces_the_measured_one():
    assert composite_bandlimit(THESIS_F, THESIS_G, max_slope=2.0).frequency == pytest.approx(4 * np.pi)


def test_arrays_functions_volumes_and_transfer_functions_are_accepted():
    from spectral_core.volume.transfer import Material, TransferFunction

    x = np.arange(64)
    wave = np.cos(2 * np.pi * x / 64)[:, None, None] * np.ones((1, 4, 4))
    volume = ScalarVolume("wave", wave, np.diag([0.5, 1.0, 2.0, 1.0]))
    exact = composite_bandlimit(
        SampledFunction.regular(wave, (0.5, 1.0, 2.0)), SampledFunction.of(lambda y: np.cos(3 * np.pi * y), -1, 1, 2049)
    )
    values = np.linspace(-1, 1, 2049)
    curve = 1 + np.cos(3 * np.pi * values)
    transfer = TransferFunction((Material("a", values, curve, [1, 1, 1]), Material("b", [0], [1], [1, 1, 1])))
    for g in (lambda y: np.cos(3 * np.pi * y), curve, transfer):
        limit = composite_bandlimit(volume, g)
        assert limit.frequency == pytest.approx(exact.frequency, rel=1e-9)
        assert limit.transfer_bandlimit == pytest.approx(3 * np.pi, rel=1e-9)
    assert composite_bandlimit(wave, curve).max_slope == pytest.approx(exact.max_slope / 2)
    assert composite_bandlimit(np.ones((4, 4)), curve).frequency == 0


# Rebuilding


def test_sampling_at_the_bound_reconstructs_the_composition():
    """SNR at 1, 2 and 4 times the Nyquist rate of either bound, for the example of Fig. 4.1."""

    def composed(x):
        return thesis_g(thesis_f(x))

    limit = composite_bandlimit(THESIS_F, THESIS_G)
    snr = [
        reconstruction_snr(sample_composition(thesis_f, thesis_g, (-3, 3), limit.frequency, oversampling=o), composed)
        for o in (1, 2, 4)
    ]
    assert snr == sorted(snr)
    assert snr[1] > 20
    assert snr[2] > 50


def test_counts_follow_the_bounds():
    limit = composite_bandlimit(THESIS_F, THESIS_G)
    tight = sample_composition(thesis_f, thesis_g, (-3, 3), limit.frequency)
    product = sample_composition(thesis_f, thesis_g, (-3, 3), limit.product_frequency)
    assert tight.count_inside == math.floor(6 / tight.distance) + 1
    assert tight.distance == pytest.approx(limit.sample_distance(2.0))
    assert product.count_inside / tight.count_inside == pytest.approx(4.63, rel=0.05)


def test_interpolant_meets_its_samples():
    samples = sample_composition(thesis_f, thesis_g, (-3, 3), 10.0)
    assert np.abs(samples(samples.positions) - samples.samples).max() < 1e-12


# Refused input


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: SampledFunction.regular([1.0, 2.0]), "3 or more samples"),
        (lambda: SampledFunction.regular([1.0, np.nan, 2.0]), r"not finite.*index \(1,\)"),
        (lambda: SampledFunction.regular([1.0, 2.0, 3.0], -1.0), "expected positive distances"),
        (lambda: SampledFunction.of(np.sin, 1, 1, 10), "expected low < high"),
        (lambda: SampledFunction.of(np.sin, 0, 1, 2), "expected 3 or more"),
        (lambda: essential_bandlimit(THESIS_G, 1.5), "energy fraction is 1.5"),
        (lambda: composite_bandlimit(THESIS_F, SampledFunction.regular(np.ones((3, 3)))), "2 variables"),
        (lambda: composite_bandlimit(THESIS_F, np.ones((3, 3))), r"shape \(3, 3\); expected 3 or more along one axis"),
        (lambda: composite_bandlimit(SHEARED, np.sin), "has sheared voxels"),
        (lambda: frequency_transfer_kernel(SampledFunction.regular(np.ones((3, 3))), [1.0]), "2 variables"),
        (lambda: frequency_transfer_kernel(THESIS_F, [1.0, 2.0, 4.0]).compose([1, 1, 1]), "evenly spaced"),
        (lambda: cone_edges(SampledFunction.of(np.square, 0, 1, 64)), "at an end of its interval"),
        (lambda: cone_edges(SampledFunction.of(np.square, 0, 1, 6)), "need 8 or more"),
        (lambda: cone_edges(THESIS_F)[0].airy_kernel(1.0, 0.0), "ν = 0 was given"),
        (lambda: sample_composition(np.sin, np.sin, (1, 0), 1.0), "expected low < high"),
        (lambda: sample_composition(np.sin, np.sin, (0, 1), 0.0), "frequency is 0.0"),
        (lambda: sample_composition(np.sin, np.sin, (0, 1), 1e12), "lower the frequency"),
    ],
)
def test_an_error_names_wrong_input(make, message):
    with pytest.raises(InvalidInputError, match=message):
        make()


def test_the_example_in_the_docstring():
    import doctest

    from spectral_core.volume import analysis

    assert doctest.testmod(analysis) == (0, 7)


def test_the_benchmark_prints_the_figures_and_draws_the_pictures(tmp_path, capsys):
    import json

    pytest.importorskip("matplotlib")
    from benchmarks.__main__ import main

    assert main(["volume-analysis", "--quick", "--json", "--out", str(tmp_path)]) == 0
    figures = json.loads(capsys.readouterr().out.splitlines()[-1])
    thesis = figures["cases"]["two tones, one peak (Fig. 4.1)"]
    assert thesis["product_samples_2x"] / thesis["bound_samples_2x"] == pytest.approx(4.6, abs=0.2)
    alike = figures["cases"]["one tone, one peak (Fig. 4.4)"]
    assert alike["product_samples_2x"] == alike["bound_samples_2x"]
    assert all(edge["airy_relative_error"] < 0.05 for edge in figures["kernel_edges"].values())
    assert len(figures["pictures"]) == 4
    assert all(
        (tmp_path / "volume-analysis" / path.split("/")[-1]).stat().st_size > 2_000 for path in figures["pictures"]
    )


def test_a_reconstruction_without_error_has_an_infinite_ratio():
    nothing = sample_composition(lambda x: 0.0 * x, lambda v: 0.0 * v, (0.0, 1.0), 20.0)
    assert reconstruction_snr(nothing, lambda x: 0.0 * x) == np.inf


@pytest.mark.parametrize(("low", "high"), [(2.0, 5.0), (-7.0, -1.0), (-0.5, 4.0)])
def test_samples_cover_the_interval_and_the_margins_wherever_it_lies(low, high):
    samples = sample_composition(np.sin, np.cos, (low, high), 10.0, oversampling=1.5, margin=20)
    distance = np.pi / 15
    assert samples.distance == pytest.approx(distance)
    assert samples.positions[0] == pytest.approx(low - 20 * distance)
    assert 19.999 * distance <= samples.positions[-1] - high < 21.001 * distance
    assert samples.count_inside == int((high - low) / distance) + 1


def test_three_samples_of_a_function_are_the_fewest():
    field = np.linspace(0.0, 1.0, 64)
    assert composite_bandlimit(field, np.array([0.0, 1.0, 0.0])).frequency > 0
    with pytest.raises(InvalidInputError, match="expected 3 or more along one axis"):
        composite_bandlimit(field, np.array([0.0, 1.0]))


def test_samples_at_the_ends_of_the_interval_count():
    samples = RegularSamples(-0.5, 0.25, np.zeros(9), (0.0, 1.0))
    assert samples.count_inside == 5


def test_the_interpolant_is_the_sum_of_sincs_at_samples_between_them_and_beside_them():
    values = np.random.default_rng(8).normal(size=12)
    samples = RegularSamples(-0.5, 0.25, values, (0.0, 1.0))
    x = np.array([[-0.5, -0.25, 0.0, 2.25], [0.01, 1e-12, -1e-9, 0.125], [-3.0, -0.6, 2.4, 9.1]])
    expected = sum(value * np.sinc((x - place) / 0.25) for value, place in zip(values, samples.positions, strict=True))
    np.testing.assert_allclose(samples(x), expected, rtol=0, atol=1e-13)
    assert samples(0.3) == pytest.approx(float(np.sinc((0.3 - samples.positions) / 0.25) @ values), abs=1e-13)


@pytest.mark.parametrize("name", ["spacing", "origin"])
@pytest.mark.parametrize("given", [(1.0, 2.0), (1.0,), (1.0, 2.0, 3.0, 4.0)])
def test_distances_are_one_number_or_one_per_axis(name: str, given: tuple[float, ...]) -> None:
    with pytest.raises(InvalidInputError, match=f"{name} has shape .* expected a number, or one per axis \\(3\\)"):
        SampledFunction.regular(np.zeros((4, 5, 6)), **{name: given})
