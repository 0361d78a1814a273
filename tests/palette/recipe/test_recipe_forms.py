# SPDX-License-Identifier: GPL-3.0-or-later
"""Recipes against laws of mixing written here, and their texts, limits and tolerances."""

from __future__ import annotations

import re

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.palette.recipe import lamp as lamp_module
from spectral_core.palette.recipe.channels import combinations_of
from spectral_core.palette.recipe.lamp import LampQuality, lamp_recipe
from spectral_core.palette.recipe.material import Colorants, material_recipe
from spectral_core.palette.recipe.missed import missed_requests
from spectral_core.palette.recipe.white import LAMP_GRID, uv_from_xyz, white_xyz, xyz_from_spd
from spectral_core.palette.texture.lights import led
from spectral_core.spectra.catalogue import color_matching_functions, illuminant, reflectance
from spectral_core.spectra.color import WHITE_XYZ, delta_e_2000, lab_from_linear_rgb, linear_rgb_from_xyz
from spectral_core.spectra.observer import xyz_of
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid

GRID = SpectralGrid.uniform(400, 700, 20)
NM = GRID.wavelengths_nm
CHANNELS = [led(peak, width) for peak, width in ((450, 20), (505, 30), (540, 40), (590, 20), (630, 20))]


def test_two_inks_on_paper_follow_demichel_and_yule_nielsen() -> None:
    rng = np.random.default_rng(1)
    spectra, paper = rng.uniform(0.1, 0.8, (2, NM.size)), rng.uniform(0.85, 0.95, NM.size)
    inks = Colorants("inks", ("c", "m"), GRID, spectra, paper=paper, dot_gain_n=1.7)
    c, m = 0.3, 0.6
    expected = 0
    for share, surface in (
        ((1 - c) * (1 - m), paper), (c * (1 - m), spectra[0]), ((1 - c) * m, spectra[1]),
        (c * m, paper * (spectra[0] / paper) * (spectra[1] / paper)),
    ):  # fmt: skip
        expected = expected + share * surface ** (1 / 1.7)
    np.testing.assert_allclose(inks.reflectance([c, m]), expected**1.7, rtol=1e-12)
    assert (inks.most, inks.dot_gain_n, Colorants("inks", ("c",), GRID, spectra[:1]).dot_gain_n) == (1.0, 1.7, 2.0)


def test_two_filters_on_paper_follow_beers_law() -> None:
    rng = np.random.default_rng(2)
    spectra, paper = rng.uniform(0.2, 0.9, (2, NM.size)), rng.uniform(0.7, 0.9, NM.size)
    filters = Colorants("filters", ("a", "b"), GRID, spectra, paper=paper)
    np.testing.assert_allclose(
        filters.reflectance([0.5, 3.0]), paper * spectra[0] ** 1.0 * spectra[1] ** 6.0, rtol=1e-12
    )
    assert filters.most == 4.0


def test_paints_of_unequal_scattering() -> None:
    spectra = np.stack([np.linspace(0.2, 0.8, NM.size), np.linspace(0.7, 0.1, NM.size)])
    paints = Colorants("paints", ("a", "b"), GRID, spectra, scattering=[3.0, 1.0])
    share = np.array([2.0, 6.0]) / 8
    k_over_s = (1 - spectra) ** 2 / (2 * spectra)
    ratio = (share[0] * 3 * k_over_s[0] + share[1] * k_over_s[1]) / (share[0] * 3 + share[1])
    np.testing.assert_allclose(paints.reflectance([2.0, 6.0]), 1 + ratio - np.sqrt(ratio**2 + 2 * ratio), rtol=1e-9)
    black = Colorants("paints", ("a",), GRID, np.zeros((1, NM.size)))
    np.testing.assert_allclose(black.spectra, 1e-4)


def test_limits_of_colorants() -> None:
    def of(kind: str, count: int, **rest: object) -> Colorants:
        names = tuple(map(str, range(count)))
        return Colorants(kind, names, GRID, np.full((count, NM.size), 0.5), **rest)  # type: ignore[arg-type]

    for kind, most in (("inks", 8), ("paints", 24), ("filters", 24)):
        assert len(of(kind, most).names) == most
        for count in (0, most + 1):
            with pytest.raises(InvalidInputError, match=f"expected 1 to {most}"):
                of(kind, count)
    with pytest.raises(InvalidInputError, match="expected 'paints'"):
        of("oils", 2)
    for value in (-0.01, 1.01):
        with pytest.raises(InvalidInputError, match="not 0 to 1"):
            Colorants("paints", ("a",), GRID, np.full((1, NM.size), value))
    assert of("inks", 1, dot_gain_n=1.0).dot_gain_n == 1.0 and of("inks", 1, dot_gain_n=100.0).dot_gain_n == 100.0
    for n in (0.9, 101.0):
        with pytest.raises(InvalidInputError, match="dot_gain_n"):
            of("inks", 1, dot_gain_n=n)


@pytest.mark.parametrize(
    ("kind", "factor", "unit"), [("paints", 100.0, "g"), ("inks", 100.0, "%"), ("filters", 1, "x")]
)
def test_the_text_of_a_recipe_has_its_amounts(kind: str, factor: float, unit: str) -> None:
    spectra = np.stack([np.linspace(0.15, 0.9, NM.size), np.linspace(0.9, 0.2, NM.size), np.full(NM.size, 0.4)])
    colorants = Colorants(kind, ("warm", "cold", "gray"), GRID, spectra)  # type: ignore[arg-type]
    target = Reflectance("t", GRID, np.clip(colorants.reflectance([0.5, 0.25, 0.0]), 0, 1))
    recipe = material_recipe(colorants, target, [illuminant("D65"), illuminant("A")])
    assert recipe.delta_e.max() < 0.05
    found = {line.split()[0]: float(line.split()[1]) for line in recipe.text().splitlines() if line.split()[-1] == unit}
    assert found == {
        name: pytest.approx(factor * amount, abs=6e-4)
        for name, amount in zip(colorants.names, recipe.amounts, strict=True)
        if amount > 0
    }
    assert recipe.unit == {"paints": "shares", "inks": "coverages", "filters": "thicknesses"}[kind]
    assert recipe.observer_delta_e.shape[1] == 2
    worst = recipe.observer_delta_e.max(axis=1)
    assert recipe.metamerism_index == pytest.approx(worst.max() - worst[0], abs=1e-12)
    assert f"index over observers {recipe.metamerism_index:.2f}" in recipe.text()
    if kind == "paints":
        assert recipe.grams(40.0) == {name: pytest.approx(0.4 * grams, abs=1e-3) for name, grams in found.items()}
        np.testing.assert_allclose(recipe.amounts[:2], [2 / 3, 1 / 3], atol=2e-3)
    else:
        np.testing.assert_allclose(recipe.amounts, [0.5, 0.25, 0.0], atol=5e-3)


def test_numbers_of_a_lamp_are_those_of_its_spectrum() -> None:
    recipe = lamp_recipe(CHANNELS, 4200, duv=0.002, quality=LampQuality(85))
    spd = recipe.drives @ np.stack([channel.at(LAMP_GRID.wavelengths_nm) for channel in CHANNELS])
    np.testing.assert_allclose(recipe.lamp.values, spd, rtol=1e-12)
    uv = uv_from_xyz(xyz_of(recipe.lamp))
    np.testing.assert_allclose(uv, uv_from_xyz(white_xyz(4200, 0.002)), atol=2e-6)
    assert (recipe.cct_k, recipe.duv) == (pytest.approx(4200, rel=1e-3), pytest.approx(0.002, abs=1e-5))
    assert recipe.drives.max() == 1.0
    # errors of 2 % drawn at random move the white as stated
    rng = np.random.default_rng(3)
    dosed = recipe.drives * (1 + 0.02 * rng.normal(size=(20000, 5)))
    rows = np.stack([xyz_of(channel) for channel in CHANNELS])
    moved = uv_from_xyz(dosed @ rows) - uv
    assert recipe.dosage_delta_uv == pytest.approx(np.sqrt((moved**2).sum(axis=1).mean()), rel=0.03)
    lines = recipe.text().splitlines()
    used = [name for name, drive in zip(recipe.names, recipe.drives, strict=True) if drive > 0]
    assert [line.split(" %")[0].rsplit(maxsplit=1)[0].strip() for line in lines[:-2]] == used
    percents = [float(re.findall(r"([\d.]+) %$", line)[0]) for line in lines[:-2]]
    np.testing.assert_allclose(percents, 100 * recipe.drives[recipe.drives > 0], atol=0.006)
    assert f"{recipe.cct_k:.0f} K, Duv {recipe.duv:+.5f}" in lines[-2]
    assert recipe.seconds >= 0


def test_a_recipe_that_misses_requests_names_each_of_them_with_its_figures() -> None:
    """The text was "not all requirements can be reached", also where the one that failed was a default."""
    three = [CHANNELS[at] for at in (0, 2, 4)]  # three channels have one mix for a white
    plain = lamp_recipe(three, 4000, quality=LampQuality(None))
    ra, rf, rg = plain.rendering_index, plain.fidelity, plain.gamut
    assert missed_requests(plain, LampQuality(ra - 1, rf - 1, (rg - 1, rg + 1))) == []
    assert missed_requests(plain, LampQuality(min(ra + 9, 100), rf - 1, (0, rg - 2.5))) == [
        f"Ra {ra:.1f} is below {min(ra + 9, 100):g}", f"Rg {rg:.1f} is above {rg - 2.5:g}",
    ]  # fmt: skip
    assert missed_requests(plain, LampQuality(None, rf + 4, (rg + 5, 200))) == [
        f"Rf {rf:.1f} is below {rf + 4:g}", f"Rg {rg:.1f} is below {rg + 5:g}",
    ]  # fmt: skip


def test_an_index_that_is_just_short_counts_as_met(monkeypatch: pytest.MonkeyPatch) -> None:
    best = lamp_recipe(CHANNELS, 4000, quality=LampQuality(100)).rendering_index
    for above, met in ((0.03, True), (0.3, False), (-1.0, True)):
        assert lamp_recipe(CHANNELS, 4000, quality=LampQuality(best + above)).met == met
    assert lamp_module.MARGIN == 0.05


def test_margins_are_distances_to_each_request() -> None:
    spd = illuminant("FL2").at(LAMP_GRID.wavelengths_nm)
    kelvin = 4225.0
    index = LampQuality(0.0).margins(spd, kelvin)[0]
    fidelity = LampQuality(None, 0.0).margins(spd, kelvin)[0]
    low, high = LampQuality(None, None, (0.0, 200.0)).margins(spd, kelvin)
    assert index == pytest.approx(64, abs=1.5) and fidelity == pytest.approx(70, abs=1.5)
    assert low + high == pytest.approx(200.0) and 70 < low < 110
    every = LampQuality(60.0, 50.0, (80.0, 130.0)).margins(spd, kelvin)
    np.testing.assert_allclose(every, [index - 60, fidelity - 50, low - 80, 130 - low])
    assert LampQuality(None).margins(spd, kelvin) == [0.0]
    assert LampQuality().rendering_index == 80.0


def test_limits_of_requests_for_lamps() -> None:
    for wrong in ({"cct_tolerance_k": -1}, {"cct_tolerance_k": 2001}, {"duv_tolerance": 0.021},
                  {"duv_tolerance": -1e-3},
                  {"gamut": (101.0, 100.0)}, {"gamut": (np.nan, 100.0)}, {"rendering_index": 100.5},
                  {"rendering_index": np.nan}, {"fidelity": 101.0}):  # fmt: skip
        with pytest.raises(InvalidInputError):
            LampQuality(**wrong)
    assert LampQuality(cct_tolerance_k=2000, duv_tolerance=0.02, gamut=(100.0, 100.0)).gamut == (100.0, 100.0)
    for cct, duv in ((1499, 0), (20001, 0), (4000, 0.0201), (4000, -0.0201)):
        with pytest.raises(InvalidInputError):
            lamp_recipe(CHANNELS, cct, duv=duv)
    for most in (2, 6):
        with pytest.raises(InvalidInputError, match="most_channels"):
            lamp_recipe(CHANNELS, 4000, most_channels=most)
    with pytest.raises(InvalidInputError, match="got 17"):
        lamp_recipe([led(450 + 10 * k, 20) for k in range(17)], 4000)


def test_a_tolerance_tries_whites_just_inside_its_ends() -> None:
    quality = LampQuality(cct_tolerance_k=100, duv_tolerance=0.004)
    whites = lamp_module._whites(4000, 0.001, quality)
    expected = [(4000, 0.001), (3905, 0.001), (4095, 0.001), (4000, 0.001 - 0.0038), (4000, 0.001 + 0.0038)]
    assert len(whites) == 5
    for kelvin, duv in expected:
        assert min(np.abs(white - white_xyz(kelvin, duv)).max() for white in whites) < 1e-10
    np.testing.assert_allclose(whites[0], white_xyz(4000, 0.001), rtol=1e-10)
    assert len(lamp_module._whites(4000, 0.0, LampQuality())) == 1


@pytest.mark.parametrize("width_nm", [0.05, 0.6])
def test_lasers_count_in_full_between_whole_wavelengths(width_nm: float) -> None:
    lasers = [
        Illuminant(f"{nm} nm", SpectralGrid(nm + width_nm * np.array([-1.0, 0.0, 1.0])), [0.0, 1 / width_nm, 0.0])
        for nm in (450.0, 532.4)
    ]
    channels = [*lasers, led(590, 30), led(638, 20)]
    recipe = lamp_recipe(channels, 4000, quality=LampQuality(None))
    mixed = recipe.drives @ np.stack([xyz_of(each) for each in channels])
    for xyz in (mixed, xyz_of(recipe.lamp)):
        np.testing.assert_allclose(uv_from_xyz(xyz), uv_from_xyz(white_xyz(4000)), atol=2e-6)


def test_sets_of_channels_are_those_that_enclose_the_white() -> None:
    """By the signs of triangles in the chromaticity plane."""
    spds = np.stack([channel.at(LAMP_GRID.wavelengths_nm) for channel in CHANNELS])
    white = white_xyz(4000)

    def rated(drives: np.ndarray) -> float:
        return -float(drives.max())

    found = list(combinations_of(spds, white, 3, rated))
    corners = uv_from_xyz(spds @ xyz_from_spd().T)
    center = uv_from_xyz(white)

    def encloses(chosen: tuple[int, ...]) -> bool:
        a, b, c = (corners[k] - center for k in chosen)
        turns = [p[0] * q[1] - p[1] * q[0] for p, q in ((a, b), (b, c), (c, a))]
        return min(turns) > 0 or max(turns) < 0

    from itertools import combinations

    assert set(found) == {chosen for chosen in combinations(range(5), 3) if encloses(chosen)}
    assert len(found) > 1

    # those of the best quality first
    drives = [np.linalg.solve((spds[list(chosen)] @ xyz_from_spd().T).T, white) for chosen in found]
    assert [own.max() for own in drives] == pytest.approx(sorted(own.max() for own in drives))
    all_sizes = list(combinations_of(spds, white, 5, rated))
    assert [len(chosen) for chosen in all_sizes] == sorted(len(chosen) for chosen in all_sizes)
    assert {len(chosen) for chosen in all_sizes} == {3, 4, 5}


def test_a_wanted_white_replaces_the_temperature() -> None:
    wanted = np.array([0.9, 1.0, 0.8])
    recipe = lamp_recipe(CHANNELS, 4000, wanted_xyz=wanted, quality=LampQuality(None))
    np.testing.assert_allclose(uv_from_xyz(xyz_of(recipe.lamp)), uv_from_xyz(wanted), atol=2e-6)
    assert recipe.met and isinstance(recipe.lamp, Illuminant)


def test_the_center_of_lamps_of_one_white_has_the_largest_least_drive() -> None:
    rng = np.random.default_rng(4)
    spds = rng.uniform(0.1, 1.0, (3, 6))
    start = np.array([0.0, 0.6, 0.2, 0.0, 0.9, 0.4])
    free = np.linalg.svd(spds)[2][3:].T
    center = lamp_module._center(start, free)
    np.testing.assert_allclose(spds @ center, spds @ start, rtol=1e-10)
    others = start + rng.normal(0, 0.3, (20_000, 3)) @ free.T
    assert center.min() >= others.min(axis=1).max() > 0


def test_inks_that_would_reflect_more_light_than_they_get_are_refused() -> None:
    """The recipe cut its spectrum at 1, and its color differences were those of 1.35."""
    paper = np.full(NM.size, 0.6)
    bright = np.stack([np.where(NM < 550, 0.9, 0.2), np.where(NM < 500, 0.1, 0.9)])
    with pytest.raises(InvalidInputError, match=r"reflect 1\.35 of the light at 5\d\d nm.*their paper"):
        Colorants("inks", ("a", "b"), GRID, bright, paper=paper)
    assert Colorants("inks", ("a",), GRID, bright[:1], paper=paper).reflectance([1.0]).max() == pytest.approx(0.9)
    for kind in ("inks", "filters"):
        with pytest.raises(InvalidInputError, match=r"the paper spans 0\.6 to 1\.4; expected 0 to 1"):
            Colorants(kind, ("a",), GRID, bright[:1], paper=np.linspace(0.6, 1.4, NM.size))  # type: ignore[arg-type]


@pytest.mark.parametrize("knots", [[380, 584, 586, 589, 592, 594, 780], [400, 450, 555, 650, 700]])
def test_the_stated_error_is_that_of_the_target_between_the_knots_of_the_colorants(knots) -> None:
    """Against integrals in steps of 0.1 nm. The target was read at the knots of the colorants only."""
    rng = np.random.default_rng(2)
    target = Reflectance("narrow", SpectralGrid(np.array(knots, float)), rng.uniform(0.1, 0.9, len(knots)))
    chips = [reflectance(name) for name in ("blue", "green", "red", "yellow", "magenta", "white 9.5 (.05 D)")]
    grid = SpectralGrid.uniform(380, 780, 20)
    paints = Colorants(
        "paints", tuple(c.name for c in chips), grid, np.stack([c.at(grid.wavelengths_nm) for c in chips])
    )
    lights = [illuminant(name) for name in ("D65", "HP1")]
    recipe = material_recipe(paints, target, lights)
    fine = np.arange(knots[0], knots[-1] + 0.05, 0.1)
    places, table = color_matching_functions("cie_1931_2deg")
    cmfs = np.stack([np.interp(fine, places, row) for row in table])
    for light, stated in zip(lights, recipe.delta_e, strict=True):
        seen = cmfs * light.at(fine)
        colors = [linear_rgb_from_xyz(seen @ each.at(fine) / seen.sum(axis=1) * WHITE_XYZ)
                  for each in (target, recipe.reflectance)]  # fmt: skip
        assert delta_e_2000(*map(lab_from_linear_rgb, colors)) == pytest.approx(stated, abs=0.02)
