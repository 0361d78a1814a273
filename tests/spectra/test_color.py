# SPDX-License-Identifier: GPL-3.0-or-later
"""Observers, color spaces and differences, compared with colour-science and published values."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.spectra import catalogue, color
from spectral_core.spectra.observer import OBSERVER_NAMES, normalized, observer, xyz_from_product, xyz_of
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid


@pytest.fixture(scope="module")
def colour() -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # colour-science warns of optional packages that it does not need here
        return pytest.importorskip("colour")


# Sharma, Wu and Dalal 2005, Table 1: pairs that detect wrong hue means and rotations
SHARMA = [
    ((50, 2.6772, -79.7751), (50, 0, -82.7485), 2.0425),
    ((50, -1.1848, -84.8006), (50, 0, -82.7485), 1.0),
    ((50, 0, 0), (50, -1, 2), 2.3669),
    ((50, 2.49, -0.001), (50, -2.49, 0.0009), 7.1792),
    ((50, 2.49, -0.001), (50, -2.49, 0.0011), 7.2195),
    ((50, -0.001, 2.49), (50, 0.0011, -2.49), 4.7461),
    ((50, 2.5, 0), (50, 0, -2.5), 4.3065),
    ((50, 2.5, 0), (73, 25, -18), 27.1492),
    ((2.0776, 0.0795, -1.135), (0.9033, -0.0636, -0.5514), 0.9082),
    ((90.9257, -0.5406, -0.9208), (88.6381, -0.8985, -0.7239), 1.5381),
]


@pytest.mark.parametrize(("first", "second", "expected"), SHARMA)
def test_ciede2000_published_pairs(first: tuple, second: tuple, expected: float) -> None:
    assert color.delta_e_2000(first, second) == pytest.approx(expected, abs=5e-5)
    assert color.delta_e_2000(second, first) == pytest.approx(expected, abs=5e-5)


def test_color_spaces_agree_with_colour_science(colour: Any, rng: np.random.Generator) -> None:
    """Lab, linear sRGB, the display curve and both color differences, over 10,000 random colors, to 1e-6."""
    xyz = rng.uniform(0, 1.1, (10_000, 3))
    xyz[:100] *= 1e-3  # dark colors, on the linear part of CIELAB
    white_xy = colour.XYZ_to_xy(color.WHITE_XYZ)
    lab = color.lab_from_xyz(xyz, color.WHITE_XYZ / color.WHITE_XYZ[1])
    pairs = lab, rng.permutation(lab)

    np.testing.assert_allclose(lab, colour.XYZ_to_Lab(xyz, white_xy), atol=1e-6)
    theirs = colour.XYZ_to_sRGB(xyz, apply_cctf_encoding=False)
    np.testing.assert_allclose(color.linear_rgb_from_xyz(xyz), theirs, atol=1e-6)
    np.testing.assert_allclose(color.delta_e_2000(*pairs), colour.delta_E(*pairs, method="CIE 2000"), atol=1e-6)
    np.testing.assert_allclose(color.delta_e_1976(*pairs), colour.delta_E(*pairs, method="CIE 1976"), atol=1e-6)
    linear = rng.uniform(0, 1, 1000)
    np.testing.assert_allclose(color.display_rgb_from_linear(linear), colour.cctf_encoding(linear), atol=1e-6)
    np.testing.assert_allclose(color.linear_from_display_rgb(color.display_rgb_from_linear(linear)), linear, atol=1e-12)


@pytest.mark.parametrize("name", OBSERVER_NAMES)
def test_integrals_agree_with_colour_science(colour: Any, name: str) -> None:
    """XYZ of every chart patch under six lights, integrated at 1 nm: relative 1e-6, for all four observers."""
    titles = dict(
        zip(
            OBSERVER_NAMES,
            (
                "CIE 1931 2 Degree Standard Observer",
                "CIE 1964 10 Degree Standard Observer",
                "CIE 2015 2 Degree Standard Observer",
                "CIE 2015 10 Degree Standard Observer",
            ),
            strict=True,
        )
    )
    cmfs = colour.MSDS_CMFS[titles[name]]
    shape = colour.SpectralShape(390, 780, 1)
    viewer = observer(name)
    inside = np.isin(viewer.wavelengths_nm, shape.wavelengths)

    for light_name in ("D65", "A", "HP1", "FL11", "LED-B3", "FL2"):
        light = catalogue.illuminant(light_name)
        for patch_name in catalogue.reflectance_names():
            patch = catalogue.reflectance(patch_name)
            stimulus = light.at(shape.wavelengths) * patch.at(shape.wavelengths)
            theirs = colour.sd_to_XYZ(
                colour.SpectralDistribution(stimulus, shape.wavelengths),
                cmfs.copy().align(shape),
                k=1,
                method="Integration",
            )
            ours = viewer.cmfs[:, inside] @ stimulus
            np.testing.assert_allclose(ours, theirs, rtol=1e-6)


def test_product_matrix_is_the_integral_of_the_product() -> None:
    """The matrix form equals the direct 1 nm integral for a surface on a coarse, uneven grid."""
    grid = SpectralGrid(np.array([380.0, 410, 455, 520, 533.5, 600, 700, 780]))
    surface = catalogue.reflectance("moderate red").resampled(grid)
    light = catalogue.illuminant("FL11")

    direct = xyz_of(light, surface)
    np.testing.assert_allclose(xyz_from_product(light, grid) @ surface.values, direct, rtol=1e-12)
    np.testing.assert_allclose(xyz_from_product(surface, light.grid) @ light.values, direct, rtol=1e-12)


def test_white_of_the_matrix_is_d65() -> None:
    d65 = normalized(catalogue.illuminant("D65"))

    np.testing.assert_allclose(xyz_of(d65), color.WHITE_XYZ, atol=2e-4)
    np.testing.assert_allclose(color.lab_from_linear_rgb([1, 1, 1]), [100, 0, 0], atol=1e-10)


def test_jacobian_is_the_derivative(rng: np.random.Generator) -> None:
    points = np.concatenate([rng.uniform(0.02, 1, (50, 3)), rng.uniform(1e-4, 3e-3, (10, 3))])
    jacobian = color.lab_jacobian_from_linear_rgb(points)
    step = 1e-7
    for axis in range(3):
        moved = points + step * np.eye(3)[axis]
        numeric = (color.lab_from_linear_rgb(moved) - color.lab_from_linear_rgb(points)) / step
        np.testing.assert_allclose(jacobian[..., axis], numeric, rtol=1e-3, atol=1e-2)


def test_thesis_daylight_is_recovered() -> None:
    """On a sampled grid the plain sum of the thesis: its printed D65 has Y = 6 under a perfect white."""
    grid = SpectralGrid.uniform(400, 700, 10, interpolation="sampled")
    light = normalized(catalogue.illuminant("D65").resampled(grid), luminance=60.0)

    total = xyz_from_product(light, grid) @ np.ones(grid.size)
    assert total[1] == pytest.approx(60.0, rel=1e-12)


def test_a_light_without_luminance_cannot_be_normalized() -> None:
    with pytest.raises(InvalidInputError, match="'dark' .* has no luminance"):
        normalized(Illuminant("dark", SpectralGrid.uniform(), np.zeros(31)))
    with pytest.raises(InvalidInputError, match="the white of CIELAB"):
        color.lab_from_xyz([1, 1, 1], [1, 0, 1])


@pytest.mark.parametrize("luminance", [-1.0, float("nan"), float("inf")])
def test_a_luminance_is_a_number_from_0(luminance: float) -> None:
    """The message named the light's power at some wavelength, not the luminance that was given."""
    with pytest.raises(InvalidInputError, match=f"luminance is {luminance}; expected a value from 0.0"):
        normalized(Illuminant("flat", SpectralGrid.uniform(), np.ones(31)), luminance=luminance)


def test_an_unknown_observer_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'cie_1931_2deg'"):
        observer("cie_1931")


@pytest.mark.parametrize("wrong", [1.0, [0.5, 0.5], np.ones((3, 2)), "red", [1j, 0, 0], [[1, 2, 3], [1, 2]], None])
@pytest.mark.parametrize(
    "function",
    [
        color.linear_rgb_from_xyz,
        color.xyz_from_linear_rgb,
        color.luminance_from_linear_rgb,
        color.display_hex_from_linear,
        color.lab_from_xyz,
        color.lab_from_linear_rgb,
        color.lab_jacobian_from_linear_rgb,
        lambda wrong: color.lab_from_xyz([1, 1, 1], wrong),
        lambda wrong: color.delta_e_1976([50, 0, 0], wrong),
        lambda wrong: color.delta_e_2000(wrong, [50, 0, 0]),
    ],
)
def test_what_is_no_color_is_refused(function, wrong):
    """A number was spread over three channels in silence, and an imaginary part was dropped; others raised errors of
    NumPy.
    """
    with pytest.raises(InvalidInputError, match="expected 3|shape|must be"):
        function(wrong)


def test_colors_that_do_not_fit_together_are_refused():
    with pytest.raises(InvalidInputError, match=r"shapes \(4, 3\) and \(5, 3\)"):
        color.delta_e_2000(np.ones((4, 3)), np.ones((5, 3)))
    assert color.delta_e_1976(np.ones((4, 3)), np.ones(3)).shape == (4,)
