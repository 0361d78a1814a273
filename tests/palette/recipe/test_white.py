# SPDX-License-Identifier: GPL-3.0-or-later
"""Whites and color rendering against closed forms and colour-science."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.palette.recipe import fidelity as fidelity_module
from spectral_core.palette.recipe.fidelity import FidelityReference
from spectral_core.palette.recipe.white import (
    DAYLIGHT_FROM_K,
    LAMP_GRID,
    cct_and_duv,
    color_rendering_index,
    daylight_spd,
    luminous_efficacy,
    planck_uv,
    power_per_nm,
    reference_spd,
    uv_from_xyz,
    white_xyz,
    xyz_from_spd,
)
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import STANDARD, observer
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

NM = LAMP_GRID.wavelengths_nm


def planck(kelvin: float) -> np.ndarray:
    """Radiance of a black body by Planck's law, in any unit."""
    return NM**-5.0 / np.expm1(1.438776877e7 / (NM * kelvin))


def xyz(spd: np.ndarray) -> np.ndarray:
    """Trapezoids at a tenth of a nanometer, from the observer's table."""
    viewer, fine = observer(STANDARD), np.linspace(360, 830, 4701)
    light = np.interp(fine, NM, spd)
    products = np.array([np.interp(fine, viewer.wavelengths_nm, row) for row in viewer.cmfs]) * light
    return (products[:, 1:] + products[:, :-1]).sum(axis=1) / 20


def test_uv_of_1960_and_the_integrals() -> None:
    np.testing.assert_allclose(uv_from_xyz([1.0, 1.0, 1.0]), [4 / 19, 6 / 19])
    np.testing.assert_allclose(uv_from_xyz([[2.0, 1.0, 0.5]]), [[8 / 18.5, 6 / 18.5]])
    assert (LAMP_GRID.size, NM[0], NM[-1]) == (471, 360.0, 830.0)
    for kelvin in (2000.0, 5000.0, 12000.0):
        np.testing.assert_allclose(planck_uv(kelvin), uv_from_xyz(xyz(planck(kelvin))), atol=2e-6)
    lamp = illuminant("FL11")
    np.testing.assert_allclose(xyz_from_spd() @ power_per_nm(lamp), xyz(lamp.at(NM)), rtol=1e-5)


@pytest.mark.parametrize("width_nm", [0.01, 0.4, 3.0])
@pytest.mark.parametrize("at_nm", [450.0, 532.37, 700.5])
def test_a_line_counts_in_full_wherever_it_stands(at_nm: float, width_nm: float) -> None:
    line = Illuminant("line", SpectralGrid(at_nm + width_nm * np.array([-1.0, 0.0, 1.0])), [0.0, 1 / width_nm, 0.0])
    around, viewer = np.linspace(-1, 1, 2001) * width_nm, observer(STANDARD)
    shares = (1 - np.abs(around) / width_nm) / np.sum(1 - np.abs(around) / width_nm)
    seen = [np.interp(at_nm + around, viewer.wavelengths_nm, row) @ shares for row in viewer.cmfs]
    power = power_per_nm(line)
    np.testing.assert_allclose(xyz_from_spd() @ power, seen, rtol=1e-5)
    assert power.sum() == pytest.approx(1.0) and power.min() >= 0
    assert power @ NM == pytest.approx(at_nm)


@pytest.mark.parametrize("kelvin", [1000.0, 1800.0, 2856.0, 4000.0, 6504.0, 12000.0, 45000.0])
@pytest.mark.parametrize("duv", [0.0, 0.01, -0.008])
def test_temperature_and_duv_of_a_white_are_those_it_was_made_with(kelvin: float, duv: float) -> None:
    white = white_xyz(kelvin, duv)
    assert white[1] == 1.0
    found = cct_and_duv(white)
    assert found[0] == pytest.approx(kelvin, rel=2e-5)
    assert found[1] == pytest.approx(duv, abs=1e-6)
    # the distance to Planck's locus, by many points of it
    points = [planck_uv(each) for each in kelvin * np.linspace(0.98, 1.02, 801)]
    assert np.linalg.norm(points - uv_from_xyz(white), axis=1).min() == pytest.approx(abs(duv), abs=1e-6)
    if duv:
        assert (uv_from_xyz(white)[1] > planck_uv(kelvin)[1]) == (duv > 0)


def test_colors_far_from_white_have_no_temperature() -> None:
    whites = white_xyz(46_000.0), white_xyz(990.0)  # just beyond the range
    for color in ([1.0, 0.4, 0.0], [0.2, 0.1, 1.2], *whites):
        with pytest.raises(InvalidInputError, match="not near Planck's locus"):
            cct_and_duv(np.array(color))


def test_the_reference_is_a_black_body_below_5000_kelvin() -> None:
    assert DAYLIGHT_FROM_K == 5000.0
    np.testing.assert_allclose(
        reference_spd(4999.0) / reference_spd(4999.0)[200], planck(4999) / planck(4999)[200], rtol=1e-6
    )
    np.testing.assert_array_equal(reference_spd(5000.0), daylight_spd(5000.0))
    d65 = illuminant("D65").at(NM)
    ours = daylight_spd(6503.6)
    known = d65 > 0  # the table of D65 ends at 780 nm
    assert known.sum() > 400
    np.testing.assert_allclose((ours / ours[200])[known], (d65 / d65[200])[known], atol=6e-3)


@pytest.fixture(scope="module")
def colour():
    pytest.importorskip("colour")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import colour
    return colour


@pytest.mark.parametrize("name", ["FL1", "FL2", "FL7", "FL11", "HP1", "HP3", "LED-B1", "LED-RGB1", "A", "D50", "E"])
def test_ra_of_measured_lamps_equals_that_of_colour_science(colour, name: str) -> None:
    spd = illuminant(name).at(NM)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = colour.colour_rendering_index(colour.SpectralDistribution(dict(zip(NM, spd, strict=True))))
    assert color_rendering_index(spd) == pytest.approx(found, abs=0.3)


@pytest.mark.parametrize("kelvin", [2700.0, 4300.0, 4900.0, 5600.0])
def test_the_reference_of_tm30_has_the_indices_100(kelvin: float) -> None:
    """Up to 4,000 K a black body, from 5,000 K daylight, in between a mixture of equal luminance."""
    body, day = planck(kelvin), daylight_spd(kelvin) if kelvin > 4000 else planck(kelvin)
    share = min(1.0, max(0.0, (kelvin - 4000) / 1000))
    mixture = (1 - share) * body / xyz(body)[1] + share * day / xyz(day)[1]
    np.testing.assert_allclose(FidelityReference(kelvin).indices(mixture), (100.0, 100.0), atol=2e-3)
    np.testing.assert_allclose(FidelityReference(kelvin).indices(7 * mixture), (100.0, 100.0), atol=2e-3)


def test_the_area_of_a_polygon_and_the_number_of_its_bins() -> None:
    assert fidelity_module._area(np.array([[0, 0], [4, 0], [4, 3], [0, 3]])) == 12.0
    assert fidelity_module._area(np.array([[0, 0], [0, 2], [2, 0]])) == -2.0
    assert fidelity_module.BINS == 16


def test_green_light_has_683_lumens_per_watt() -> None:
    line = np.zeros(471)
    line[555 - 360] = 1.0
    assert luminous_efficacy(line) == pytest.approx(683, rel=2e-3)
    assert luminous_efficacy(np.ones(471)) == pytest.approx(683 * xyz(np.ones(471))[1] / 470, rel=1e-5)
