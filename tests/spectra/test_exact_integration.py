# SPDX-License-Identifier: GPL-3.0-or-later
"""Products of piecewise linear spectra: design and normalization compared with rational arithmetic, any line width."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from spectral_core.spectra import catalogue
from spectral_core.spectra.observer import (
    OBSERVER_NAMES,
    integration_points,
    normalized,
    observer,
    xyz_from_product,
    xyz_from_spectrum,
    xyz_of,
)
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, Spectrum

HALF_WIDTHS_NM = (0.01, 0.037, 0.1, 0.25, 0.4, 0.5, 1.0, 2.0)


def exact_integral(*factors: tuple[np.ndarray, np.ndarray]) -> float:
    """∫ of a product of piecewise linear functions, zero outside their knots: polynomials in rational arithmetic."""
    tables = [([Fraction(float(k)) for k in knots], [Fraction(float(v)) for v in values]) for knots, values in factors]
    low, high = max(k[0] for k, _ in tables), min(k[-1] for k, _ in tables)
    edges = sorted({knot for knots, _ in tables for knot in knots if low <= knot <= high})
    total = Fraction(0)
    for start, end in pairwise(edges):
        product = [Fraction(1)]
        for knots, values in tables:
            j = max(index for index, knot in enumerate(knots[:-1]) if knot <= start)
            slope = (values[j + 1] - values[j]) / (knots[j + 1] - knots[j])
            at_start = values[j] + slope * (start - knots[j])
            longer = [at_start * c for c in product] + [Fraction(0)]
            for power, c in enumerate(product):
                longer[power + 1] += slope * c
            product = longer
        width = end - start
        total += sum(c * width ** (power + 1) / (power + 1) for power, c in enumerate(product))
    return float(total)


def lines(positions: list[float], half_width: float, powers: list[float] | None = None) -> Illuminant:
    """Triangles of equal or given power."""
    powers = powers or [1.0] * len(positions)
    knots, values = [300.0], [0.0]
    for position, power in zip(positions, powers, strict=True):
        knots += [position - half_width, position, position + half_width]
        values += [0.0, power / half_width, 0.0]
    return Illuminant("lines", SpectralGrid(np.array([*knots, 900.0])), np.array([*values, 0.0]))


def exact_xyz(light: Spectrum, *surfaces: Spectrum, name: str = "cie_1931_2deg") -> np.ndarray:
    viewer = observer(name)
    inside = light.values > 0
    low, high = light.grid.wavelengths_nm[inside].min() - 3, light.grid.wavelengths_nm[inside].max() + 3
    keep = (viewer.wavelengths_nm >= low) & (viewer.wavelengths_nm <= high)  # rational arithmetic is slow
    factors = [(s.grid.wavelengths_nm, s.values) for s in (light, *surfaces)]
    return np.array([exact_integral((viewer.wavelengths_nm[keep], row[keep]), *factors) for row in viewer.cmfs])


@pytest.mark.parametrize("half_width", HALF_WIDTHS_NM)
def test_a_line_counts_in_full_at_any_wavelength(half_width: float, rng: np.random.Generator) -> None:
    positions = [532.0, 532.3, 532.5, 638.0 + half_width, *rng.uniform(420, 680, 4)]
    for position in positions:
        light = lines([position], half_width)
        exact = exact_xyz(light)
        np.testing.assert_allclose(xyz_of(light), exact, rtol=1e-11)
        np.testing.assert_allclose(xyz_from_spectrum(light.grid) @ light.values, exact, rtol=1e-11)
        assert exact_xyz(normalized(light))[1] == pytest.approx(1.0, rel=1e-11)


@pytest.mark.parametrize("name", OBSERVER_NAMES)
def test_two_lines_on_a_narrow_filter(name: str, rng: np.random.Generator) -> None:
    """Two equal lines with a half width of 0.4 nm, at 532.0 and 638.5 nm, through a filter with an edge."""
    light = lines([532.0, 638.5], 0.4)
    knots = np.array([400.0, 531.9, 532.1, 600, 638.45, 638.46, 700])
    surface = Reflectance("filter", SpectralGrid(knots), rng.uniform(0, 1, knots.size))
    exact = exact_xyz(light, surface, name=name)
    viewer = observer(name)

    np.testing.assert_allclose(xyz_of(light, surface, viewer), exact, rtol=1e-11)
    np.testing.assert_allclose(xyz_from_product(light, surface.grid, viewer) @ surface.values, exact, rtol=1e-11)
    np.testing.assert_allclose(xyz_from_product(surface, light.grid, viewer) @ light.values, exact, rtol=1e-11)


def test_chromaticity_does_not_depend_on_the_position_of_a_line_between_whole_nm() -> None:
    for first, second in ((532.0, 638.5), (532.5, 638.0)):
        x, y, z = xyz_of(lines([first, second], 0.4))
        assert (x / (x + y + z), y / (x + y + z)) == pytest.approx((0.376, 0.603), abs=4e-3)


def test_a_grid_that_ends_between_whole_nm_is_integrated_to_its_end() -> None:
    light = Illuminant("slab", SpectralGrid(np.array([540.3, 540.7])), np.ones(2))
    np.testing.assert_allclose(xyz_of(light), exact_xyz(light), rtol=1e-11)


def test_factors_without_a_common_range_have_no_points() -> None:
    points, weights = integration_points([400.0, 500.0], [600.0, 700.0])
    assert points.size == weights.size == 0
    assert xyz_of(Illuminant("x", SpectralGrid(np.array([900.0, 950.0])), np.ones(2))).tolist() == [0, 0, 0]


def test_a_spectrum_of_many_knots_needs_no_large_matrix() -> None:
    grid = SpectralGrid(np.linspace(300.0, 850.0, 200_001))
    daylight = catalogue.illuminant("D65")
    np.testing.assert_allclose(xyz_from_spectrum(grid) @ daylight.at(grid.wavelengths_nm), xyz_of(daylight), rtol=1e-6)
