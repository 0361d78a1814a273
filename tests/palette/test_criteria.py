# SPDX-License-Identifier: GPL-3.0-or-later
"""Color integrals, smoothness and subspace error: what rows of a palette are made of."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spectral_core.errors import InvalidInputError
from spectral_core.palette.assemble.criteria import capped_weights, second_differences, subspace_color_matrices
from spectral_core.palette.assemble.kernel import color_kernel
from spectral_core.palette.problem import SubspaceCriterion
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import OBSERVER_NAMES, xyz_from_product, xyz_from_spectrum, xyz_of
from spectral_core.spectra.spectrum import SpectralGrid


@pytest.mark.parametrize("interpolation", ["linear", "sampled"])
@pytest.mark.parametrize("light", ["D65", "HP1", "FL11"])
def test_the_kernel_integrates_as_the_renderer_does(light, interpolation):
    grid = SpectralGrid.uniform(400, 700, 10, interpolation=interpolation)
    kernel = color_kernel(grid)
    measured = illuminant(light)
    matrix = kernel.matrices(kernel.spectrum_at_points(measured)[None])[0, 0]
    np.testing.assert_allclose(matrix, RGB_FROM_XYZ @ xyz_from_product(measured, grid), rtol=1e-12, atol=1e-12)


def test_given_spectra_are_integrated_on_their_own_grids():
    light, surface = illuminant("FL11"), reflectance("foliage")
    kernel = color_kernel(SpectralGrid.uniform(380, 780, 20))
    color = kernel.colors(kernel.spectrum_at_points(surface)[None], kernel.spectrum_at_points(light)[None])[0, 0, 0]
    np.testing.assert_allclose(color, RGB_FROM_XYZ @ xyz_of(light, surface), rtol=1e-12)


def test_other_observers_see_equal_energy_equally_bright():
    kernel = color_kernel(SpectralGrid.uniform(360, 830, 5), OBSERVER_NAMES)
    luminance = kernel.rgb_cmfs.sum(axis=2) @ np.linalg.inv(RGB_FROM_XYZ)[1]
    np.testing.assert_allclose(luminance, xyz_from_spectrum(kernel.grid)[1].sum(), rtol=1e-6)


def test_the_thesis_operator_is_equation_5_13_with_the_norm_of_its_figures():
    grid = SpectralGrid.uniform(400, 700, 10)
    operator = second_differences(grid, "thesis") * 6 * np.sqrt(31)
    np.testing.assert_allclose(np.diag(operator), 2.0)
    np.testing.assert_allclose(np.diag(operator, 1), -1.0)
    assert np.abs(operator @ np.ones(31))[[0, -1]] == pytest.approx([1.0, 1.0])


@pytest.mark.parametrize(
    "grid", [SpectralGrid.uniform(400, 700, 10), SpectralGrid(np.array([380.0, 390, 410, 500, 700]))]
)
def test_the_mended_operator_leaves_constants_alone(grid):
    assert np.abs(second_differences(grid) @ np.ones(grid.size)).max() < 1e-14


def test_mended_roughness_does_not_depend_on_the_grid():
    def roughness(step: float) -> float:
        grid = SpectralGrid.uniform(400, 700, step)
        wave = np.cos(2 * np.pi * (grid.wavelengths_nm - 400) / 100)  # flat at both ends, as the mirror wants
        return float(np.linalg.norm(second_differences(grid) @ wave))

    assert roughness(1.0) == pytest.approx(roughness(2.5), rel=0.02)
    assert roughness(1.0) == pytest.approx((2 * np.pi / 10) ** 2 / np.sqrt(2) / 6, rel=0.02)


def test_an_unknown_operator_is_refused():
    with pytest.raises(InvalidInputError, match="expected 'mended' or 'thesis'"):
        second_differences(SpectralGrid.uniform(400, 700, 10), "toeplitz")


@pytest.mark.parametrize("componentwise", [False, True])
def test_a_subspace_that_holds_everything_makes_no_error(componentwise):
    grid = SpectralGrid.uniform(400, 700, 10, interpolation="sampled")
    basis = np.eye(31) if componentwise else np.linalg.qr(np.random.default_rng(0).normal(size=(31, 31)))[0]
    kernel = color_kernel(grid)
    known = np.random.default_rng(1).uniform(size=(2, 31))
    matrices = subspace_color_matrices(SubspaceCriterion(basis, componentwise=componentwise), known, kernel.rgb_cmfs[0])
    np.testing.assert_allclose(matrices, kernel.matrices(known)[0], atol=1e-11)


@given(st.lists(st.floats(1e-12, 1e12), min_size=1, max_size=12), st.floats(2, 1e4))
def test_capped_weights_keep_their_order_and_ratio(weights, ratio):
    asked = np.array(weights)
    capped = capped_weights(asked, ratio)
    assert capped.max() <= ratio * capped.min() * (1 + 1e-12)
    assert np.all(np.diff(capped[np.argsort(asked)]) >= 0)
    assert capped_weights(capped, ratio) == pytest.approx(capped)
