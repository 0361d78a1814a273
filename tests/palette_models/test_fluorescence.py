# SPDX-License-Identifier: GPL-3.0-or-later
"""Fluorescence: sums over explicit bispectral matrices, limits of energy, and design of both sides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.paint.fluorescence import (
    FluorescentSurface,
    color_from_light,
    color_from_surface,
    led,
)
from spectral_core.palette.paint.fluorescent_design import solve_fluorescent
from spectral_core.palette.paint.fluorescent_report import palette_solution
from spectral_core.palette.presets import metamer_pair
from spectral_core.spectra import catalogue, observer
from spectral_core.spectra.color import RGB_FROM_XYZ, delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.fluorescence import FluorescentDye, share_per_amount
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, Spectrum

GRID = SpectralGrid.uniform(360, 780, 10)
DYE = FluorescentDye.gaussian("green", 400, 530)
D65 = observer.normalized(catalogue.illuminant("D65"))
VIOLET = led(405, power=0.3 * float(D65.at(np.arange(360.0, 781.0)).sum()))


def surface(amount: float = 0.4) -> FluorescentSurface:
    values = 0.4 + 0.1 * np.sin(GRID.wavelengths_nm / 40)
    return FluorescentSurface("paint", Reflectance("paint", GRID, values), (DYE,), np.array([amount]))


def test_colors_are_those_of_an_explicit_bispectral_matrix() -> None:
    """Oracle: a double sum over incoming and outgoing wavelengths at the centers of cells of 0.05 nm."""
    seen = observer.observer()
    inward, outward = np.arange(360.025, 780, 0.05), np.arange(360.025, 830, 0.05)
    paint = surface()
    excitation = 0.05 * np.interp(inward, GRID.wavelengths_nm, DYE.excitation.at(GRID.wavelengths_nm))
    density = DYE.emission.at(outward) / (0.05 * DYE.emission.at(np.arange(300.025, 830, 0.05)).sum())
    radiance = paint.reflectance.at(outward) * VIOLET.at(outward)
    for wavelength, share in zip(inward, excitation, strict=True):
        radiance = radiance + 0.4 * share * float(VIOLET.at(wavelength)) * density
    cmfs = 0.05 * np.stack([np.interp(outward, seen.wavelengths_nm, row) for row in seen.cmfs])
    np.testing.assert_allclose(paint.linear_rgb(VIOLET), RGB_FROM_XYZ @ cmfs @ radiance, rtol=1e-5)


def test_a_surface_without_dye_is_a_reflectance() -> None:
    plain = surface(0.0)
    np.testing.assert_allclose(
        plain.linear_rgb(D65), RGB_FROM_XYZ @ observer.xyz_of(D65, plain.reflectance), rtol=1e-12
    )
    np.testing.assert_array_equal(plain.bispectral_matrix(), np.diag(plain.reflectance.values))


def test_the_blocks_of_both_sides_give_the_color_of_the_surface() -> None:
    paint = surface()
    unknowns = np.concatenate([paint.reflectance.values, paint.amounts])
    np.testing.assert_allclose(color_from_surface(D65, (DYE,), GRID) @ unknowns, paint.linear_rgb(D65), rtol=1e-9)
    light = Illuminant("light", GRID, np.random.default_rng(2).uniform(size=GRID.size))
    np.testing.assert_allclose(color_from_light(paint, GRID) @ light.values, paint.linear_rgb(light), rtol=1e-9)


def test_the_bispectral_matrix_keeps_energy_and_only_lengthens_waves() -> None:
    fine = SpectralGrid.uniform(300, 830, 1)
    reflectance = Reflectance("gray", fine, np.full(fine.size, 0.3))
    dye = FluorescentDye.gaussian("far", 380, 560, widths_nm=(15, 15))
    paint = FluorescentSurface("paint", reflectance, (dye,), np.array([0.45]))
    matrix = paint.bispectral_matrix()
    returned = reflectance.values + paint.amounts[0] * dye.excitation_on(fine)
    np.testing.assert_allclose(matrix.sum(axis=0), returned, rtol=1e-9)
    assert matrix.sum(axis=0).max() <= 1 + 1e-9
    assert (
        np.triu(matrix, 1).max() < 1e-6
    )  # emission at shorter wavelengths than the absorbed light: only the tails of the bell curves
    light = np.random.default_rng(0).uniform(size=fine.size)
    shown = paint.radiance(Illuminant("l", fine, light), fine.wavelengths_nm)
    np.testing.assert_allclose(matrix @ light, shown, rtol=2e-4)


def problem(*, smoothness: float = 0.1, free_light: bool = False) -> PaletteProblem:
    """A plain and a fluorescent material that match under daylight; only one fluoresces under a violet lamp."""
    lights = (PaletteLight(D65), PaletteLight(VIOLET.resampled(GRID) if free_light else VIOLET, free=free_light))
    rows = (PaletteReflectance("plain"), PaletteReflectance("glowing"))
    box = ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    cells = (
        (Cell.free(box), Cell.black()),
        (Cell.same_as((0, 0), exact=True), Cell.fixed((0.2, 0.9, 0.2))),
    )
    return PaletteProblem(GRID, lights, rows, cells, smoothness=smoothness)


def test_a_pair_equal_by_day_and_far_apart_under_violet() -> None:
    solution = solve_fluorescent(problem(), {1: [DYE]})
    assert solution.trusted
    lab = lab_from_linear_rgb(solution.actual_linear_rgb)
    difference = delta_e_2000(lab[0], lab[1])
    assert difference[0] < 0.01
    assert difference[1] >= 50
    assert solution.largest_returned_share <= 1 + 1e-9
    assert solution.surfaces[1].amounts[0] > 0.1
    assert solution.surfaces[0].amounts.size == 0
    for i, made in enumerate(solution.surfaces):
        for j, light in enumerate(solution.illuminants):
            np.testing.assert_allclose(made.linear_rgb(light), solution.actual_linear_rgb[i, j], atol=1e-12)
    without = solve_palette(problem())
    lab = lab_from_linear_rgb(without.actual_linear_rgb)
    assert delta_e_2000(lab[0, 1], lab[1, 1]) < difference[1] / 1.5  # the limit of reflectance alone


def test_no_photon_causes_more_than_one() -> None:
    """Oracle: photons out over photons in, by sums over the bispectral matrix, one wavelength of light at a time."""
    fine = SpectralGrid.uniform(300, 830, 1)
    black = Reflectance("black", fine, np.zeros(fine.size))
    nm = fine.wavelengths_nm
    most = 405 / DYE.emission_mean_nm  # share of the power of a 405 nm photon that a 530 nm photon has
    dye = FluorescentDye("all", Spectrum("at 405", fine, (np.abs(nm - 405) < 2) * 1.0), DYE.emission)
    paint = FluorescentSurface("paint", black, (dye,), np.array([0.995 * most]))
    line = np.where(nm == 405, 1.0, 0.0)
    photons = float((paint.bispectral_matrix() @ line) @ nm) / float(line @ nm)
    assert photons == pytest.approx(0.995, abs=1e-4)
    with pytest.raises(
        InvalidInputError, match=r"quantum yield of at most 1 requires.*multiply the amounts .* by 0\.98"
    ):
        FluorescentSurface("paint", black, (dye,), np.array([1.01 * most]))


def test_the_energy_limit_is_active_if_too_much_fluorescence_is_requested() -> None:
    asked = problem().with_cell((1, 1), Cell.fixed((0.0, 50.0, 0.0)))
    solution = solve_fluorescent(asked, {1: [DYE]})
    assert solution.largest_returned_share == pytest.approx(1.0, abs=1e-9)
    assert np.nanmax(solution.delta_e_2000) > 3


def test_the_light_is_designed_too() -> None:
    solution = solve_fluorescent(replace(problem(free_light=True), rounds=6), {1: [DYE]})
    fixed = solve_fluorescent(problem(), {1: [DYE]})
    assert solution.trusted
    assert solution.rounds > 1
    assert solution.delta_e_2000[1, 1] < fixed.delta_e_2000[1, 1]
    assert isinstance(solution.illuminants[1], Illuminant)
    assert solution.illuminants[0] is problem().lights[0].spectrum


def test_without_dyes_the_solution_is_that_of_a_plain_palette() -> None:
    asked = replace(metamer_pair(), rounds=1)
    plain, same = solve_palette(asked), solve_fluorescent(asked, {})
    np.testing.assert_allclose(same.actual_linear_rgb, plain.actual_linear_rgb, atol=1e-6)
    for one, other in zip(same.surfaces, plain.reflectances, strict=True):
        np.testing.assert_allclose(one.reflectance.values, other.values, atol=1e-4)


def test_several_dyes_and_exact_cells() -> None:
    red = FluorescentDye.gaussian("red", 520, 620)
    asked = problem().with_cell((1, 1), Cell.fixed((0.6, 0.5, 0.0), exact=True))
    solution = solve_fluorescent(asked, {1: [DYE, red]})
    assert solution.surfaces[1].amounts.shape == (2,)
    assert solution.largest_returned_share <= 1 + 1e-9
    assert share_per_amount((DYE, red), GRID.wavelengths_nm).shape == (GRID.size, 2)
    if solution.trusted:
        np.testing.assert_allclose(solution.actual_linear_rgb[1, 1], (0.6, 0.5, 0.0), atol=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"observers": ("cie_1931_2deg", "cie_1964_10deg")}, "has several observers; it is designed without them"),
        ({"match": "perceptual"}, "perceptual matching"),
        ({"reflectance_bounds": (-1.0, 1.0)}, "negative reflectances"),
        ({"scale_lights": True}, "lights that are scaled"),
    ],
)
def test_features_without_support_for_fluorescence_are_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        solve_fluorescent(replace(problem(), **change), {1: [DYE]})  # type: ignore[arg-type]


def test_impossible_dyes_and_surfaces_are_refused() -> None:
    with pytest.raises(InvalidInputError, match="excited around 600 nm and emits around 500 nm; .* exchange the two"):
        FluorescentDye.gaussian("backwards", 600, 500)
    bell = Spectrum("bell", GRID, np.full(GRID.size, 2.0))
    with pytest.raises(InvalidInputError, match=r"excitation of dye 'bright' reaches 2; it is a share of light"):
        FluorescentDye("bright", bell, DYE.emission)
    with pytest.raises(InvalidInputError, match=r"emission of dye 'dark' spans 0 to 0; expected values of at least 0"):
        FluorescentDye("dark", DYE.excitation, Spectrum("none", GRID, np.zeros(GRID.size)))
    with pytest.raises(InvalidInputError, match=r"surface 'paint' returns 1\.\d+ of the light at 4\d\d nm"):
        surface(0.9)
    with pytest.raises(InvalidInputError, match=r"amounts of 'paint' are \[-0\.1\]; expected at least 0"):
        surface(-0.1)
    with pytest.raises(InvalidInputError, match="dyes for reflectance 2; expected 0 to 1"):
        solve_fluorescent(problem(), {2: [DYE]})
    measured = replace(
        problem(), reflectances=(PaletteReflectance("a", catalogue.reflectance("white 9.5 (.05 D)")),) * 2
    )
    with pytest.raises(InvalidInputError, match="reflectance 'a' is measured, so no dye can be designed into it"):
        solve_fluorescent(measured, {0: [DYE]})


def test_reduced_weights_are_noted_with_dyes_too() -> None:
    problem = metamer_pair()
    heavy = replace(problem.cells[0][0], weight=1e9)
    found = solve_fluorescent(
        problem.with_cell((0, 0), heavy), {1: [FluorescentDye.gaussian("green", 430, 530)]}, seconds=0.2
    )
    notes = palette_solution(found).notes
    assert notes[0].startswith("cell weights from 1 to 1e+09 were brought within a ratio of 10000")


def test_the_mean_wavelength_of_an_emission_is_its_centroid() -> None:
    """That of a triangle is the mean of its corners, also where its knots are uneven."""
    excitation = Spectrum("excitation", SpectralGrid(np.array([300.0, 330.0, 390.0])), np.array([0.0, 1.0, 0.0]))
    emission = Spectrum("emission", SpectralGrid(np.array([400.0, 410.0, 460.0])), np.array([0.0, 3.0, 0.0]))
    assert FluorescentDye("dye", excitation, emission).emission_mean_nm == pytest.approx((400 + 410 + 460) / 3)
