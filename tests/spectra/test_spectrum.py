# SPDX-License-Identifier: GPL-3.0-or-later
"""Grids, spectra and the shipped tables."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import GridMismatchError, InvalidInputError, UnknownNameError
from spectral_core.spectra import catalogue
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.observer import normalized, sum_of_lights, xyz_of
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, Spectrum, told_apart


def test_a_uniform_grid_includes_its_end_and_describes_itself() -> None:
    grid = SpectralGrid.uniform(400, 700, 10)

    assert grid.size == 31
    assert grid.wavelengths_nm[[0, -1]].tolist() == [400, 700]
    assert str(grid) == "400–700 nm / 10 nm (31 samples)"


@pytest.mark.parametrize(
    ("wavelengths", "message"),
    [
        ([400], "at least 2"),
        ([500, 400], "ascending order"),
        ([400, 400, 500], "ascending order"),
        ([400, np.nan], r"not finite, the first is nan at index \(1,\)"),
        ([-10, 400], "positive"),
        ([[400, 500]], r"shape \(1, 2\)"),
    ],
)
def test_invalid_grids_are_refused(wavelengths: list[float], message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        SpectralGrid(np.array(wavelengths, dtype=float))


def test_a_step_that_does_not_divide_the_range_is_refused() -> None:
    with pytest.raises(InvalidInputError, match="no whole number of steps of 7 nm"):
        SpectralGrid.uniform(400, 700, 7)


def test_excessive_grids_are_refused() -> None:
    with pytest.raises(InvalidInputError, match="expected under 1,000,000"):
        SpectralGrid.uniform(400, 7e11, 1)
    with pytest.raises(InvalidInputError, match="stop_nm is nan nm; expected a number"):
        SpectralGrid.uniform(400, float("nan"), 1)


def test_evaluation_matrix_is_linear_interpolation_and_zero_outside(rng: np.random.Generator) -> None:
    grid = SpectralGrid(np.cumsum(rng.uniform(1, 20, 40)) + 380)
    values = rng.uniform(0, 1, grid.size)
    points = rng.uniform(360, 900, 500)

    expected = np.interp(points, grid.wavelengths_nm, values, left=0, right=0)
    np.testing.assert_allclose(grid.values_from_knots(points) @ values, expected, atol=1e-14)
    np.testing.assert_allclose(grid.values_from_knots(grid.wavelengths_nm), np.eye(grid.size), atol=0)


def test_cell_widths_sum_to_the_range() -> None:
    np.testing.assert_allclose(SpectralGrid.uniform(400, 700, 10).cell_widths_nm, 10)


def test_arrays_are_read_only() -> None:
    light = catalogue.illuminant("D65")
    with pytest.raises(ValueError, match="read-only"):
        light.values[0] = 1.0


def test_lights_are_not_negative_and_reflectances_are_at_most_1() -> None:
    grid = SpectralGrid.uniform(400, 700, 100)
    with pytest.raises(InvalidInputError, match=r"'bad' is negative \(-0.1\) at 500 nm"):
        Illuminant("bad", grid, np.array([0, -0.1, 1, 1]))
    with pytest.raises(InvalidInputError, match="spans 0 to 1.2; a passive surface"):
        Reflectance("bad", grid, np.array([0, 1.2, 1, 1]))
    assert Reflectance("rounded", grid, np.array([-1e-9, 1, 1, 1 + 1e-9])).values.min() == 0


def test_values_must_fit_the_grid() -> None:
    with pytest.raises(GridMismatchError, match="has 3 values, its grid .* has 31"):
        Spectrum("short", SpectralGrid.uniform(), np.ones(3))
    with pytest.raises(GridMismatchError, match=r"use \.resampled\(grid\)"):
        catalogue.illuminant("D65").require_grid(SpectralGrid.uniform())


def test_averaging_keeps_the_power_of_a_line() -> None:
    """Point values of a 10 nm grid lose a 2 nm wide line between the knots; cell means keep it."""
    fine = SpectralGrid.uniform(400, 700, 1)
    line = Illuminant("line", fine, np.where(np.abs(fine.wavelengths_nm - 585) < 1.5, 1.0, 0.0))
    coarse = SpectralGrid.uniform(400, 700, 10)

    assert line.resampled(coarse).values.sum() == 0
    kept = (line.resampled(coarse, average=True).values * coarse.cell_widths_nm).sum()
    assert kept == pytest.approx(line.values.sum(), rel=1e-12)


def test_averaging_keeps_the_power_of_a_very_narrow_line(rng: np.random.Generator) -> None:
    """A line a thousandth of the step wide, and random spectra, keep their area to rounding."""
    hair = Illuminant(
        "hair", SpectralGrid(np.array([500.0, 587.30, 587.305, 587.31, 600.0])), np.array([0, 0, 1, 0, 0.0])
    )
    rough = Illuminant("rough", SpectralGrid(np.linspace(400, 700, 777)), rng.uniform(0, 1, 777))
    coarse = SpectralGrid.uniform(390, 710, 10)
    for light in (hair, rough):
        area = (np.diff(light.grid.wavelengths_nm) * (light.values[1:] + light.values[:-1]) / 2).sum()
        kept = (light.resampled(coarse, average=True).values * coarse.cell_widths_nm).sum()
        assert kept == pytest.approx(area, rel=1e-12)


def test_errors_for_unknown_names_suggest_similar_ones() -> None:
    with pytest.raises(UnknownNameError, match="no illuminant is named 'D56'; did you mean .*'D65'"):
        catalogue.illuminant("D56")
    with pytest.raises(UnknownNameError, match="no reflectance is named 'drak skin'; did you mean 'dark skin'"):
        catalogue.reflectance("drak skin")


def test_every_shipped_spectrum_can_be_read() -> None:
    lights = [catalogue.illuminant(name) for name in catalogue.illuminant_names()]
    patches = [catalogue.reflectance(name) for name in catalogue.reflectance_names()]

    assert len(lights) >= 106
    assert len(patches) == 24
    assert all(light.values.max() > 0 for light in lights)
    assert catalogue.illuminant("sodium").name == "HP1"


def test_a_blackbody_excites_dyes_as_the_same_light_of_the_cie() -> None:
    """Its wavelengths began at 360 nm: a dye of 345 nm absorbed a sixth under 2856 K of what it absorbs under A."""
    dye = FluorescentDye.gaussian("dye", 345, 530, widths_nm=(12.0, 20.0))
    grid = SpectralGrid.uniform(300, 830, 5)
    hot, cie = (normalized(catalogue.illuminant(name)) for name in ("blackbody 2855.5", "A"))
    assert dye.absorbed_power(hot, grid) == pytest.approx(dye.absorbed_power(cie, grid), rel=0.01)


def test_the_peak_of_a_blackbody_follows_wien() -> None:
    grid = SpectralGrid.uniform(360, 1200, 1)
    for kelvin in (3000.0, 4000.0, 6500.0):
        peak = grid.wavelengths_nm[catalogue.blackbody(kelvin, grid).values.argmax()]
        assert peak == pytest.approx(2.897771955e6 / kelvin, abs=1.0)
    assert catalogue.illuminant("blackbody 3200").name == "blackbody 3200"
    for name in ("blackbody abc", "blackbody  ", "blackbody 32 00"):
        with pytest.raises(UnknownNameError, match="expected one in kelvin"):
            catalogue.illuminant(name)
    with pytest.raises(InvalidInputError, match="temperature is 5 K; expected a value from 500 K"):
        catalogue.blackbody(5)


def test_a_sum_of_lights_ends_where_they_end_and_counts_no_darkness() -> None:
    short = Illuminant("short", SpectralGrid(np.array([500.0, 510.0])), np.ones(2))
    wide = Illuminant("wide", SpectralGrid(np.array([400.0, 700.0])), np.array([1.0, 3.0]))
    dark = Illuminant("dark", wide.grid, np.zeros(2))
    total, amount = sum_of_lights([(2.0, short), (1.0, wide), (5.0, dark)])
    assert amount == 3.0
    at = np.array([450.0, 499.99, 505.0, 510.01, 650.0])
    expected = 2.0 * short.at(at) / xyz_of(short)[1] + wide.at(at) / xyz_of(wide)[1]
    np.testing.assert_allclose(total.at(at), expected, rtol=1e-12)
    assert xyz_of(total)[1] == pytest.approx(3.0, rel=1e-3)
    infrared = Illuminant("infrared", SpectralGrid(np.array([900.0, 950.0])), np.ones(2))
    with pytest.raises(InvalidInputError, match="no luminance"):
        sum_of_lights([(1.0, wide), (1.0, infrared)])


@pytest.mark.parametrize("names", [["a", "a", "b"], ["a", "a 1", "a"], ["a 2", "a", "a", "a 2"], ["a"] * 4])
def test_equal_names_get_numbers_that_no_other_spectrum_has(names: list[str]) -> None:
    grid = SpectralGrid.uniform()
    numbered = [each.name for each in told_apart([Spectrum(name, grid, np.ones(grid.size)) for name in names])]
    assert len(set(numbered)) == len(names)
    for name, new in zip(names, numbered, strict=True):
        assert new.startswith(name)
        assert new == name or names.count(name) > 1
