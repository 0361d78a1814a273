# SPDX-License-Identifier: GPL-3.0-or-later
"""The frequency transfer kernel: Bessel functions as oracle, its cone, its Airy edge."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import jv

from spectral_core.volume.analysis import (
    SampledFunction,
    cone_edges,
    frequency_transfer_kernel,
)
from tests.volume_analysis.signals import (
    THESIS_F,
    trigonometric,
    trigonometric_polynomial,
)


def test_kernel_of_a_sinusoid_is_bessel():
    """Jacobi-Anger: the Fourier coefficients of exp(iν A sin x) are J_k(ν A)."""
    sinusoid = SampledFunction.of(lambda x: 0.5 * np.sin(x), -1.3, 2 * np.pi - 1.3, 1024, periodic=True)
    kernel = frequency_transfer_kernel(sinusoid, [0.0, 3.0, -40.0, 200.0])
    order = np.round(kernel.omega).astype(int)
    for nu, row in zip(kernel.nu, kernel.values, strict=True):
        assert np.abs(row - jv(order, nu * 0.5)).max() < 1e-13


def test_kernel_is_hermitian():
    nu = np.linspace(-50, 50, 21)
    kernel = frequency_transfer_kernel(THESIS_F, nu)
    inner = kernel.values[:, 1:]  # the FFT's lowest frequency has no positive partner
    assert np.abs(inner - np.conj(inner[::-1, ::-1])).max() < 1e-12


def test_kernel_applied_to_a_spectrum_is_the_spectrum_of_the_composition():
    """Eq. 4.7 against the FFT of g(f(x)) itself, for a Gaussian g with its closed-form spectrum."""
    width, center = 0.05, 0.4
    nu = np.linspace(-200, 200, 801)
    spectrum = width * np.exp(-((width * nu) ** 2) / 2 - 1j * nu * center)
    kernel = frequency_transfer_kernel(THESIS_F, nu)
    composed = np.exp(-((THESIS_F.values - center) ** 2) / (2 * width**2))
    direct = np.fft.fftshift(np.fft.fft(composed)) * THESIS_F.spacing[0] / math.sqrt(2 * np.pi)
    assert np.abs(kernel.compose(spectrum) - direct).max() < 1e-10 * np.abs(direct).max()


@given(trigonometric, st.floats(60, 200))
@settings(max_examples=25, deadline=None)
def test_energy_of_the_kernel_lies_between_the_edges_of_the_cone(terms, nu):
    f, slope, third = trigonometric_polynomial(terms)
    x = np.linspace(0, 2 * np.pi, 8192, endpoint=False)
    kernel = frequency_transfer_kernel(SampledFunction.of(f, 0, 2 * np.pi, 8192, periodic=True), [nu])
    power = np.abs(kernel.values[0]) ** 2
    margin = 4 * np.cbrt(nu * np.abs(third(x)).max() / 2)
    inside = (kernel.omega >= nu * slope(x).min() - margin) & (kernel.omega <= nu * slope(x).max() + margin)
    assert power[~inside].sum() < 1e-6 * power.sum()


def gaussian(mean, deviation, x):
    return np.exp(-((x - mean) ** 2) / (2 * deviation**2))


def test_edges_of_a_gaussian_are_its_inflection_slopes():
    lower, upper = cone_edges(SampledFunction.of(lambda x: gaussian(0.5, 1 / 12, x), 0, 1, 2048))
    expected = 12 * math.exp(-0.5)
    assert (lower.slope, upper.slope) == pytest.approx((-expected, expected), rel=1e-8)
    assert upper.positions == pytest.approx([0.5 - 1 / 12], abs=1e-9)
    assert upper.third_derivatives == pytest.approx([-2 * 12**3 * math.exp(-0.5)], rel=1e-5)


def test_edges_of_a_periodic_function_count_every_turning_point():
    double = SampledFunction.of(lambda x: np.sin(2 * x), 0, 2 * np.pi, 512, periodic=True)
    lower, upper = cone_edges(double)
    assert (len(lower.positions), len(upper.positions)) == (2, 2)
    assert upper.slope == pytest.approx(2, rel=1e-8)


@pytest.mark.parametrize(
    "function", [lambda x: gaussian(0.5, 1 / 12, x), lambda x: gaussian(0.5, 1 / 12, x) + gaussian(0.25, 1 / 30, x)]
)
def test_airy_edge_matches_the_kernel_about_the_edge(function):
    """Eq. 4.18 against the discrete K, within one Airy length inside and three outside of each edge, for large ν."""
    f = SampledFunction.of(function, -1, 2, 1 << 16)
    nu = 2000.0
    kernel = frequency_transfer_kernel(f, [nu])
    for edge, outward in zip(cone_edges(f), (-1, 1), strict=True):
        distance = outward * (kernel.omega - nu * edge.slope) / edge.decay_length(nu)
        near = (distance > -1) & (distance < 3)
        predicted = edge.airy_kernel(kernel.omega[near], nu)
        peak = np.abs(predicted).max()
        assert near.sum() > 20
        # The next term of the expansion is of relative order ν^(-1/3).
        assert np.abs(predicted - kernel.values[0][near]).max() < 0.5 * nu ** (-1 / 3) * peak


def test_kernel_beyond_the_edge_is_below_the_black_of_the_figure():
    f = SampledFunction.of(lambda x: gaussian(0.5, 1 / 12, x), 0, 1, 4096)
    nu = 300.0
    kernel = frequency_transfer_kernel(f, [nu])
    _, upper = cone_edges(f)
    outside = kernel.omega > nu * upper.slope + 6 * upper.decay_length(nu)
    assert np.abs(kernel.values[0][outside]).max() < math.exp(-7) * np.abs(kernel.values[0]).max()


def test_eight_samples_suffice_for_the_edges_of_the_cone():
    lower, upper = cone_edges(SampledFunction.of(np.sin, 0, 2 * np.pi, 8, periodic=True))
    assert lower.slope == pytest.approx(-1, abs=0.01) and upper.slope == pytest.approx(1, abs=0.01)
