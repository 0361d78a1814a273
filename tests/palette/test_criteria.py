# SPDX-License-Identifier: GPL-3.0-or-later
"""Color integrals, smoothness and subspace error: the parts of a palette's rows."""

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
from spectral_core.spectra.observer import OBSERVER_NAMES, observer, xyz_from_product, xyz_of
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid


@pytest.mark.parametrize("interpolation", ["linear", "sampled"])
@pytest.mark.parametrize("light", ["D65", "HP1", "FL11"])
def test_the_kernel_integrates_like_the_renderer(light, interpolation):
    grid = SpectralGrid.uniform(400, 700, 10, interpolation=interpolation)
    measured = illuminant(light)
    expected = RGB_FROM_XYZ @ xyz_from_product(measured, grid)
    np.testing.assert_allclose(color_kernel(grid).matrix_of(measured)[0], expected, rtol=1e-12, atol=1e-12)
    designed = Illuminant("designed", grid, measured.resampled(grid).values)
    expected = RGB_FROM_XYZ @ xyz_from_product(designed, grid)
    np.testing.assert_allclose(
        color_kernel(grid).matrices(designed.values[None])[0, 0], expected, rtol=1e-12, atol=1e-12
    )


def test_given_spectra_are_integrated_on_their_own_grids():
    light, surface = illuminant("FL11"), reflectance("foliage")
    color = color_kernel(SpectralGrid.uniform(380, 780, 20)).color_of(light, surface)[0]
    np.testing.assert_allclose(color, RGB_FROM_XYZ @ xyz_of(light, surface), rtol=1e-12)


@pytest.mark.parametrize("half_width", [0.01, 0.3, 2.0])
@pytest.mark.parametrize("center", [450.0, 555.37, 610.5])
def test_a_narrow_line_counts_in_full_at_any_wavelength(half_width, center):
    """∫ line · hat · cmf by brute force: ten thousand points within the line."""
    lines = SpectralGrid(np.array([400.0, center - half_width, center, center + half_width, 700.0]))
    line = Illuminant("line", lines, np.array([0.0, 0.0, 1.0, 0.0, 0.0]))
    grid = SpectralGrid.uniform(400, 700, 10)
    # The midpoint rule on 20,000 cells of the line.
    edges = np.linspace(center - half_width, center + half_width, 20_001)
    points, step = (edges[1:] + edges[:-1]) / 2, edges[1] - edges[0]
    viewer = observer()
    cmfs = np.stack([np.interp(points, viewer.wavelengths_nm, row) for row in viewer.cmfs])
    expected = RGB_FROM_XYZ @ (cmfs * line.at(points) * step) @ grid.values_from_knots(points)
    found = color_kernel(grid).matrix_of(line)[0]
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


def test_two_designed_factors_are_integrated_exactly(rng):
    grid = SpectralGrid(np.sort(rng.uniform(390, 720, 9)))
    light, surface = rng.uniform(size=(2, 9))
    edges = np.linspace(grid.wavelengths_nm[0], grid.wavelengths_nm[-1], 400_001)
    points, step = (edges[1:] + edges[:-1]) / 2, edges[1] - edges[0]
    viewer = observer()
    product = np.interp(points, grid.wavelengths_nm, light) * np.interp(points, grid.wavelengths_nm, surface) * step
    expected = [np.interp(points, viewer.wavelengths_nm, row) @ product for row in viewer.cmfs]
    found = color_kernel(grid).matrices(light[None])[0, 0] @ surface
    np.testing.assert_allclose(found, RGB_FROM_XYZ @ np.array(expected), rtol=1e-7)


def test_equal_energy_has_the_same_luminance_for_all_observers():
    grid = SpectralGrid.uniform(360, 830, 5)
    shown = color_kernel(grid, OBSERVER_NAMES).bare.sum(axis=2) @ np.linalg.inv(RGB_FROM_XYZ)[1]
    np.testing.assert_allclose(shown, shown[0], rtol=1e-5)


def test_the_thesis_operator_is_equation_5_13_with_the_scale_of_its_figures():
    grid = SpectralGrid.uniform(400, 700, 10)
    operator = second_differences(grid, "thesis") * 6 * np.sqrt(31)
    np.testing.assert_allclose(np.diag(operator), 2.0)
    np.testing.assert_allclose(np.diag(operator, 1), -1.0)
    assert np.abs(operator @ np.ones(31))[[0, -1]] == pytest.approx([1.0, 1.0])


@pytest.mark.parametrize(
    "grid", [SpectralGrid.uniform(400, 700, 10), SpectralGrid(np.array([380.0, 390, 410, 500, 700]))]
)
def test_the_mended_operator_maps_constants_to_zero(grid):
    assert np.abs(second_differences(grid) @ np.ones(grid.size)).max() < 1e-14


def test_mended_roughness_does_not_depend_on_the_grid():
    def roughness(step: float) -> float:
        grid = SpectralGrid.uniform(400, 700, step)
        wave = np.cos(
            2 * np.pi * (grid.wavelengths_nm - 400) / 100
        )  # flat at both ends, as the mirrored continuation requires
        return float(np.linalg.norm(second_differences(grid) @ wave))

    assert roughness(1.0) == pytest.approx(roughness(2.5), rel=0.02)
    assert roughness(1.0) == pytest.approx((2 * np.pi / 10) ** 2 / np.sqrt(2) / 6, rel=0.02)


def test_an_unknown_operator_is_refused():
    with pytest.raises(InvalidInputError, match="expected 'mended' or 'thesis'"):
        second_differences(SpectralGrid.uniform(400, 700, 10), "toeplitz")


@pytest.mark.parametrize("componentwise", [False, True])
def test_a_subspace_of_all_spectra_has_no_error(componentwise):
    grid = SpectralGrid.uniform(400, 700, 10, interpolation="sampled")
    basis = np.eye(31) if componentwise else np.linalg.qr(np.random.default_rng(0).normal(size=(31, 31)))[0]
    kernel = color_kernel(grid)
    known = np.random.default_rng(1).uniform(size=(2, 31))
    matrices = subspace_color_matrices(SubspaceCriterion(basis, componentwise=componentwise), known, kernel.bare[0])
    np.testing.assert_allclose(matrices, kernel.matrices(known)[0], atol=1e-11)


@given(st.lists(st.floats(1e-12, 1e12), min_size=1, max_size=12), st.floats(2, 1e4))
def test_capped_weights_keep_their_order_and_ratio(weights, ratio):
    asked = np.array(weights)
    capped = capped_weights(asked, ratio)
    assert capped.max() <= ratio * capped.min() * (1 + 1e-12)
    assert np.all(np.diff(capped[np.argsort(asked)]) >= 0)
    assert capped_weights(capped, ratio) == pytest.approx(capped)
