# SPDX-License-Identifier: GPL-3.0-or-later
"""Which channels and colorants a recipe has: compared with all sets."""

from __future__ import annotations

import itertools

import colour
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from spectral_core.palette.recipe.lamp import LampQuality, lamp_recipe
from spectral_core.palette.recipe.library import led_channels
from spectral_core.palette.recipe.material import Colorants, material_recipe
from spectral_core.palette.texture.reach import stimulus_matrix
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.color import WHITE_XYZ, XYZ_FROM_RGB
from spectral_core.spectra.spectrum import Reflectance

LIGHTS = [illuminant("D65"), illuminant("A")]
CHIPS = (
    "dark skin",
    "green",
    "yellow green",
    "black 2 (1.5 D)",
    "red",
    "blue sky",
    "yellow",
    "purple",
    "cyan",
    "orange",
)


def lab(surface: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    xyz = (matrix @ surface).reshape(-1, 3) @ XYZ_FROM_RGB.T
    return colour.XYZ_to_Lab(xyz / WHITE_XYZ * colour.xy_to_XYZ((0.3127, 0.329)), (0.3127, 0.329))


def mixed(kind: str, share: float, pair: np.ndarray) -> np.ndarray:
    if kind == "filters":
        return pair[0] ** (2 * share) * pair[1] ** (2 * (1 - share))
    total = np.array([share, 1 - share]) @ ((1 - pair) ** 2 / (2 * pair))
    return 1 + total - np.sqrt(total**2 + 2 * total)


def test_the_best_two_of_nine_paints_are_found() -> None:
    """Foliage was mixed of dark skin and green with ΔE2000 5.0 and 6.6: the best mixture has 2.3 and 2.2."""
    target = reflectance("foliage")
    spectra = np.stack([reflectance(name).at(target.grid.wavelengths_nm) for name in CHIPS])
    matrix = stimulus_matrix(LIGHTS, target.grid)
    wanted, least = lab(target.values, matrix), np.inf
    for pair in itertools.combinations(range(len(CHIPS)), 2):

        def missed(share: float, pair: tuple[int, int] = pair) -> float:
            return float(np.sum((lab(mixed("paints", share, spectra[list(pair)]), matrix) - wanted) ** 2))

        least = min(least, minimize_scalar(missed, bounds=(0, 1), method="bounded", options={"maxiter": 12}).fun)
    found = material_recipe(Colorants("paints", CHIPS, target.grid, spectra), target, LIGHTS, most_colorants=2)
    assert np.sum((lab(found.reflectance.values, matrix) - wanted) ** 2) < 1.02 * least
    assert found.delta_e.max() < 2.5


def test_filters_of_a_known_mixture_are_found_again() -> None:
    grid = reflectance("foliage").grid
    spectra = np.stack([0.2 + 0.8 * reflectance(name).at(grid.wavelengths_nm) for name in CHIPS])
    made = type(reflectance("foliage"))("made", grid, mixed("filters", 0.3, spectra[[4, 8]]))
    found = material_recipe(Colorants("filters", CHIPS, grid, spectra), made, LIGHTS, most_colorants=2)
    assert found.delta_e.max() < 0.05
    np.testing.assert_allclose(found.amounts[[4, 8]], [0.3, 0.7], atol=0.01)


@pytest.mark.parametrize(
    ("kelvin", "most", "quality"),
    [(5000.0, 3, LampQuality(None, 85.0, (100.0, 103.0))), (6500.0, 4, LampQuality(95.0))],
    ids=["three channels", "four channels"],
)
def test_channels_that_meet_all_requests_are_found(kelvin: float, most: int, quality: LampQuality) -> None:
    """Of the sets of one size the twelve broadest were tried, so that these requests were said to be out of reach."""
    found = lamp_recipe(led_channels(), kelvin, quality=quality, most_channels=most)
    assert found.met
    assert np.count_nonzero(found.drives) <= most
    spectrum = colour.SpectralDistribution(found.lamp.at(np.arange(380.0, 781.0)), np.arange(380.0, 781.0))
    if quality.rendering_index is not None:
        assert colour.colour_rendering_index(spectrum) > quality.rendering_index - 0.3
    assert found.cct_k == pytest.approx(kelvin, abs=1)


def test_a_tolerance_past_the_color_temperatures_is_cut_off() -> None:
    """It was refused: no black body has -400 K."""
    found = lamp_recipe(led_channels(), 1500, quality=LampQuality(99.9, cct_tolerance_k=2000), most_channels=3)
    assert not found.met
    assert found.cct_k > 1000


@pytest.mark.parametrize("share", [2e-5, 9e-5])
def test_a_trace_of_black_that_white_needs_is_kept(share: float) -> None:
    """Less than a ten-thousandth of a black paint was left out, though it darkens a white by ΔE2000 1.3 to 3.7."""
    grid = reflectance("white 9.5 (.05 D)").grid
    pair = np.stack([np.full(grid.size, 0.95), np.full(grid.size, 0.002)])
    target = Reflectance("gray", grid, mixed("paints", 1 - share, pair))
    found = material_recipe(Colorants("paints", ("white", "black"), grid, pair), target, LIGHTS)
    assert found.amounts[1] == pytest.approx(share, rel=1e-3)
    assert found.delta_e.max() < 0.01
    grams = float(found.text(10.0).splitlines()[1].split()[1])
    assert grams == pytest.approx(10 * share, rel=0.005)
