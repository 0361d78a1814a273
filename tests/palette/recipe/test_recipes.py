# SPDX-License-Identifier: GPL-3.0-or-later
"""Recipes of lamps and materials, compared with colour-science and independent mixing laws."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
import pytest

from spectral_core import cli
from spectral_core.errors import InvalidInputError
from spectral_core.palette.recipe.fidelity import FidelityReference
from spectral_core.palette.recipe.lamp import LampQuality, lamp_recipe
from spectral_core.palette.recipe.library import led_channels
from spectral_core.palette.recipe.material import Colorants, material_recipe
from spectral_core.palette.recipe.white import LAMP_GRID, cct_and_duv, xyz_from_spd
from spectral_core.palette.texture.lights import led
from spectral_core.palette.texture.reach import stimulus_matrix
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.files import write_spectra
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid

CHANNELS = [
    led(peak, width)
    for peak, width in ((445, 20), (470, 22), (500, 25), (525, 32), (560, 90), (595, 16), (630, 18), (660, 20))
]
GRID = SpectralGrid.uniform(400, 700, 10)
PAINTS = ("blue", "green", "red", "yellow", "magenta", "white 9.5 (.05 D)", "black 2 (1.5 D)")
SPECTRA = np.stack([reflectance(name).at(GRID.wavelengths_nm) for name in PAINTS])
LIGHTS = [illuminant("D65"), illuminant("A")]


@pytest.fixture(scope="module")
def colour():
    pytest.importorskip("colour")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # colour-science warns of optional plotting packages that it does not find
        import colour
    return colour


@pytest.mark.parametrize(
    ("cct", "duv", "index", "most"),
    [(2700, 0.0, 90, None), (4000, 0.0, 90, 4), (6500, 0.003, 80, None), (5000, 0, 95, 6)],
)
def test_lamps_reach_white_and_rendering_index_by_colour_science(colour, cct, duv, index, most) -> None:
    recipe = lamp_recipe(CHANNELS, cct, duv=duv, quality=LampQuality(index), most_channels=most)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        measured = colour.SpectralDistribution(dict(zip(LAMP_GRID.wavelengths_nm, recipe.lamp.values, strict=True)))
        uv = colour.UCS_to_uv(colour.XYZ_to_UCS(colour.sd_to_XYZ(measured)))
        kelvin, found_duv = colour.temperature.uv_to_CCT_Ohno2013(uv)
        rendering = colour.colour_rendering_index(measured)
    assert recipe.met
    assert abs(found_duv - duv) < 0.001
    assert kelvin == pytest.approx(cct, rel=0.002)
    assert rendering >= index - 0.3
    assert rendering == pytest.approx(recipe.rendering_index, abs=0.3)
    assert np.count_nonzero(recipe.drives) <= (most or len(CHANNELS))
    assert recipe.drives.max() == pytest.approx(1)
    assert recipe.drives.min() >= 0


@pytest.mark.parametrize(("cct", "fidelity", "gamut"), [(3000, 90, (96.0, 106.0)), (4500, 88, None)])
def test_lamps_reach_tm30_by_colour_science(colour, cct, fidelity, gamut) -> None:
    quality = LampQuality(None, fidelity, gamut)
    recipe = lamp_recipe(CHANNELS, cct, quality=quality)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        measured = colour.SpectralDistribution(dict(zip(LAMP_GRID.wavelengths_nm, recipe.lamp.values, strict=True)))
        found = colour.colour_fidelity_index(measured, additional_data=True, method="ANSI/IES TM-30-18")
    assert recipe.met
    assert abs(found.D_uv) < 0.001
    assert found.R_f >= fidelity - 0.1
    assert found.R_f == pytest.approx(recipe.fidelity, abs=0.05)
    assert found.R_g == pytest.approx(recipe.gamut, abs=0.05)
    if gamut is not None:
        assert gamut[0] - 0.1 <= found.R_g <= gamut[1] + 0.1


@pytest.mark.parametrize("name", ["FL2", "HP1", "LED-B5", "A"])
def test_tm30_of_measured_lamps_equals_that_of_colour_science(colour, name) -> None:
    spd = illuminant(name).at(LAMP_GRID.wavelengths_nm)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        measured = colour.SpectralDistribution(dict(zip(LAMP_GRID.wavelengths_nm, spd, strict=True)))
        found = colour.colour_fidelity_index(measured, additional_data=True, method="ANSI/IES TM-30-18")
    ours = FidelityReference(cct_and_duv(xyz_from_spd() @ spd)[0]).indices(spd)
    np.testing.assert_allclose(ours, (found.R_f, found.R_g), atol=0.02)


def test_a_tolerance_of_the_white_raises_the_rendering_index(colour) -> None:
    narrow = [led(450, 20), led(530, 30), led(560, 60), led(620, 18)]
    strict = lamp_recipe(narrow, 4000, quality=LampQuality(99))
    loose = lamp_recipe(narrow, 4000, quality=LampQuality(99, cct_tolerance_k=300, duv_tolerance=0.005))
    assert not strict.met
    assert loose.rendering_index > strict.rendering_index
    assert abs(loose.duv) <= 0.005
    assert abs(loose.cct_k - 4000) <= 300


def test_a_lamp_with_a_low_rendering_index_gets_a_message() -> None:
    pytest.importorskip("colour")
    narrow = [led(450, 5), led(540, 5), led(610, 5)]
    recipe = lamp_recipe(narrow, 4000, quality=LampQuality(95))
    assert not recipe.met
    assert abs(recipe.duv) < 1e-3
    with pytest.raises(InvalidInputError, match="add a channel on the other side"):
        lamp_recipe([led(600, 20), led(620, 20), led(640, 20)], 6500)
    with pytest.raises(InvalidInputError, match="3 to 16 channels"):
        lamp_recipe(narrow[:2], 4000)


def kubelka_munk(shares, surfaces):
    """Single-constant theory, implemented independently."""
    ratio = sum(share * (1 - surface) ** 2 / (2 * surface) for share, surface in zip(shares, surfaces, strict=True))
    return 1 + ratio - np.sqrt(ratio**2 + 2 * ratio)


def test_known_shares_of_a_mixture_are_recovered() -> None:
    shares = np.array([0.0, 0.35, 0.25, 0.0, 0.0, 0.4, 0.0])
    target = Reflectance("mixed by hand", GRID, kubelka_munk(shares, SPECTRA))
    recipe = material_recipe(Colorants("paints", PAINTS, GRID, SPECTRA), target, LIGHTS)
    assert recipe.delta_e.max() < 0.05
    assert sum(recipe.grams(250).values()) == pytest.approx(250)
    made = kubelka_munk(recipe.amounts, SPECTRA)
    matrix = stimulus_matrix(LIGHTS, GRID)
    errors = delta_e_2000(
        lab_from_linear_rgb((matrix @ made).reshape(2, 3)), lab_from_linear_rgb((matrix @ target.values).reshape(2, 3))
    )
    np.testing.assert_allclose(errors, recipe.delta_e, atol=1e-6)


@pytest.mark.parametrize("kind", ["paints", "inks", "filters"])
def test_dosage_errors_are_predicted_within_a_fifth(kind) -> None:
    colorants = Colorants(kind, PAINTS, GRID, SPECTRA)
    recipe = material_recipe(colorants, reflectance("foliage"), LIGHTS)
    rng, matrix = np.random.default_rng(8), stimulus_matrix(LIGHTS, GRID)
    center = lab_from_linear_rgb((matrix @ colorants.reflectance(recipe.amounts)).reshape(2, 3))
    errors = []
    for _ in range(1500):
        dosed = np.minimum(recipe.amounts * (1 + 0.02 * rng.normal(size=len(PAINTS))), colorants.most)
        errors.append(delta_e_2000(lab_from_linear_rgb((matrix @ colorants.reflectance(dosed)).reshape(2, 3)), center))
    np.testing.assert_allclose(recipe.dosage_delta_e, np.mean(errors, axis=0), rtol=0.2)


def test_dosage_errors_of_inks_end_at_full_coverage() -> None:
    """Coverages of 1 and 0.9999: full slopes and half of them were added up without the end, 0.18 for 0.13."""
    colorants = Colorants("inks", ("cyan", "magenta"), GRID, SPECTRA[[1, 3]])
    for wanted in ([0.0, 0.9999], [1.0, 0.9999], [1.0, 1.0]):
        target = Reflectance("printed", GRID, colorants.reflectance(wanted))
        recipe = material_recipe(colorants, target, LIGHTS)
        np.testing.assert_allclose(recipe.amounts, wanted, atol=1e-4)
        dosed = np.minimum(recipe.amounts * np.random.default_rng(8).normal(1, 0.02, (1500, 2)), 1)
        bare, cyan, magenta = np.ones(GRID.size), SPECTRA[1], SPECTRA[3]  # Yule and Nielsen's halftones at n = 2
        c, m = dosed.T[:, :, None]
        over = (
            (1 - c) * (1 - m) * bare
            + c * (1 - m) * cyan**0.5
            + (1 - c) * m * magenta**0.5
            + c * m * (cyan * magenta) ** 0.5
        )
        shown = lab_from_linear_rgb(np.einsum("cn,sn->sc", stimulus_matrix(LIGHTS, GRID), over**2).reshape(1500, 2, 3))
        matrix = stimulus_matrix(LIGHTS, GRID) @ recipe.reflectance.values
        errors = delta_e_2000(shown, lab_from_linear_rgb(matrix.reshape(2, 3))[None]).mean(axis=0)
        np.testing.assert_allclose(recipe.dosage_delta_e, errors, rtol=0.1)


def test_few_colorants_and_limits() -> None:
    recipe = material_recipe(
        Colorants("paints", PAINTS, GRID, SPECTRA), reflectance("dark skin"), LIGHTS, most_colorants=2
    )
    assert np.count_nonzero(recipe.amounts) <= 2
    halftone = Colorants("inks", ("one",), GRID, np.full((1, GRID.size), 0.04), dot_gain_n=1.0)
    # Murray-Davies: without dot gain the reflectance is linear in coverage.
    np.testing.assert_allclose(halftone.reflectance([0.25]), 0.75 + 0.25 * 0.04)
    glass = Colorants("filters", ("one",), GRID, np.full((1, GRID.size), 0.5))
    np.testing.assert_allclose(glass.reflectance([1.5]), 0.5**3)
    with pytest.raises(InvalidInputError, match="whose amounts are coverages"):
        material_recipe(halftone, reflectance("foliage"), LIGHTS).grams(1)
    with pytest.raises(InvalidInputError, match="at least one light"):
        material_recipe(halftone, reflectance("foliage"), [])


def test_the_command_prints_a_recipe(tmp_path, capsys) -> None:
    pytest.importorskip("colour")
    write_spectra(tmp_path / "leds.csv", [Illuminant(c.name, c.grid, c.values) for c in CHANNELS])
    assert cli.main(["recipe", "lamp", str(tmp_path / "leds.csv"), "--cct", "4000", "--cri", "85", "--json"]) == 0
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["met"]
    paints = [Reflectance(name, GRID, row) for name, row in zip(PAINTS, SPECTRA, strict=True)]
    write_spectra(tmp_path / "paints.csv", paints)
    assert cli.main(["recipe", "paints", str(tmp_path / "paints.csv"), "--target", "foliage", "--json"]) == 0
    shares = json.loads(capsys.readouterr().out.splitlines()[-1])["amounts"]
    assert sum(shares.values()) == pytest.approx(1)
    assert cli.main(["recipe", "paints", str(tmp_path / "paints.csv")]) == 1
    assert "needs --target" in capsys.readouterr().err


def test_the_scale_of_a_channel_changes_its_drive_and_not_the_mix() -> None:
    bells = [led(peak, 20) for peak in (450, 520, 590, 640)]
    factors = np.array([1e-3, 30.0, 5.0, 1.0])
    plain = lamp_recipe(bells, 4000)
    rescaled = lamp_recipe([bell.scaled(factor) for bell, factor in zip(bells, factors, strict=True)], 4000)
    light = rescaled.drives * factors
    np.testing.assert_allclose(light / light.max(), plain.drives / plain.drives.max(), rtol=0.02)
    assert rescaled.rendering_index == pytest.approx(plain.rendering_index, abs=0.1)


def test_the_shipped_channels_have_one_watt_each() -> None:
    for channel in led_channels():
        fine = np.arange(300.0, 900.0, 0.25)
        assert 0.25 * channel.at(fine).sum() == pytest.approx(1.0, rel=2e-3), channel.name


def test_an_error_names_a_channel_without_light() -> None:
    dark = Illuminant("broken one", led(500, 20).grid, np.zeros(led(500, 20).values.size))
    with pytest.raises(InvalidInputError, match="'broken one' emits no light"):
        lamp_recipe([*CHANNELS[:4], dark], 4000)


def test_columns_without_names_get_distinct_names(tmp_path, capsys) -> None:
    nm = np.arange(400, 701, 5)
    columns = [led(peak, 20).at(nm) for peak in (450, 520, 590, 640)]
    lines = [",".join(f"{value:.6f}" for value in row) for row in np.column_stack([nm, *columns])]
    path = tmp_path / "leds.csv"
    path.write_text("wavelength_nm,,,,\n" + "\n".join(lines))
    assert cli.main(["recipe", "lamp", str(path), "--cct", "4000", "--json"]) == 0
    drives = json.loads(capsys.readouterr().out.splitlines()[-1])["drives"]
    assert list(drives) == ["leds 1", "leds 2", "leds 3", "leds 4"]


@pytest.mark.parametrize("wrong", [["--grams", "-5"], ["--grams", "nan"], ["--most", "0"]])
def test_invalid_amounts_are_refused(tmp_path, capsys, wrong) -> None:
    path = tmp_path / "paints.csv"
    write_spectra(path, [reflectance(name) for name in PAINTS])
    assert cli.main(["recipe", "paints", str(path), "--target", "dark skin", *wrong]) == 1
    assert "expected a value from" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("kind", "name", "target"), [("lamp", "leds", ["--cct", "4000"]), ("paints", "paints", ["--target", "dark skin"])]
)
def test_the_example_that_a_message_names_gives_a_recipe(kind, name, target, capsys) -> None:
    assert cli.main(["recipe", kind, "absent.csv", *target]) == 1
    named = f"examples/{name}.csv"
    assert named in capsys.readouterr().err
    assert cli.main(["recipe", kind, str(Path(__file__).parents[3] / named), *target]) == 0
