# SPDX-License-Identifier: GPL-3.0-or-later
"""Light models: the equations of each, and its stated accuracy."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.light_models import (
    NATURAL_NODES_NM,
    BasisModel,
    FactorModel,
    LightModel,
    NodeModel,
    RgbModel,
    principal_components,
    representative_spectra,
    sharpened_basis,
)
from spectral_core.light_models.factor import optimized_edges
from spectral_core.spectra import catalogue, observer
from spectral_core.spectra.color import delta_e_2000, lab_from_xyz
from spectral_core.spectra.observer import xyz_from_product
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid, Spectrum

Array = NDArray[np.float64]

GRID = SpectralGrid.uniform(380, 780, 5)
BINS = SpectralGrid.uniform(400, 700, 10, interpolation="sampled")
LIGHTS = [observer.normalized(catalogue.illuminant(name)) for name in catalogue.illuminant_names()]
CHECKER = [catalogue.reflectance(name) for name in catalogue.reflectance_names()]


def on(grid: SpectralGrid) -> Array:
    return np.array([patch.at(grid.wavelengths_nm) for patch in CHECKER])


def errors(model: LightModel, spectra: Array, coefficients: Array, lights: list[Illuminant]) -> Array:
    """ΔE2000 (lights, spectra), under each light's own white."""
    found = []
    for light in lights:
        matrix = xyz_from_product(light, model.grid)
        white = matrix.sum(axis=1)
        shown = coefficients @ model.xyz_from_coefficients(light).T
        found.append(delta_e_2000(lab_from_xyz(spectra @ matrix.T, white), lab_from_xyz(shown, white)))
    return np.array(found)


def models() -> list[LightModel]:
    basis = principal_components(representative_spectra(LIGHTS[:4], on(BINS), BINS), 6)
    return [
        RgbModel(BINS, catalogue.illuminant("D65")),
        BasisModel(BINS, basis),
        FactorModel(BINS, basis),
        NodeModel.natural(8, BINS),
        NodeModel.scene(on(BINS)[:5], BINS),
    ]


@pytest.mark.parametrize("model", models(), ids=lambda model: type(model).__name__)
def test_every_model_is_linear_in_light_and_surface(model: LightModel) -> None:
    surfaces, weights = on(BINS)[3:6], np.array([0.2, 0.5, 0.3])
    mixed = model.surface_coefficients(weights @ surfaces)
    np.testing.assert_allclose(mixed, weights @ model.surface_coefficients(surfaces), atol=1e-12)
    first, second = (light.resampled(BINS, average=True) for light in (LIGHTS[6], LIGHTS[35]))
    both = Illuminant("both", BINS, first.values + 2 * second.values)
    summed = model.xyz_from_coefficients(first) + 2 * model.xyz_from_coefficients(second)
    np.testing.assert_allclose(model.xyz_from_coefficients(both), summed, atol=1e-12)


@pytest.mark.parametrize("model", models(), ids=lambda model: type(model).__name__)
def test_subspace_error_is_the_exact_matrix_minus_that_of_the_model(model: LightModel) -> None:
    light, surfaces = LIGHTS[6], on(BINS)
    shown = model.surface_coefficients(surfaces) @ model.xyz_from_coefficients(light).T
    exact = surfaces @ xyz_from_product(light, BINS).T
    np.testing.assert_allclose(surfaces @ model.subspace_error(light).T, exact - shown, atol=1e-12)
    assert model.linear_rgb_from_coefficients(light).shape == (3, model.size)


@pytest.mark.parametrize("model", models(), ids=lambda model: type(model).__name__)
def test_reflections_commute_and_flat_white_changes_nothing(model: LightModel) -> None:
    first, second = model.surface_coefficients(on(BINS)[[4, 9]])
    np.testing.assert_allclose(model.reflect(first, second), model.reflect(second, first), atol=1e-12)
    stacked = model.reflect(np.stack([first, second]), first)
    np.testing.assert_allclose(stacked[1], model.reflect(second, first), atol=1e-12)
    if type(model) is not BasisModel:  # flat white is not in the span of a few principal components
        white = model.surface_coefficients(np.ones(BINS.size))
        if isinstance(model, FactorModel):
            white = np.ones(model.size)
        np.testing.assert_allclose(white, 1.0, atol=1e-12)
        np.testing.assert_allclose(model.reflect(white, first), first, atol=1e-12)


def test_illumination_matrix_is_equation_5_7() -> None:
    basis = principal_components(representative_spectra(LIGHTS[::20], on(BINS), BINS), 4)
    model = BasisModel(BINS, basis)
    weights = np.random.default_rng(3).normal(size=4)
    inverse = np.linalg.pinv(basis)
    expected = np.zeros((4, 4))
    for i in range(4):
        for j in range(4):
            for k in range(4):
                expected[i, j] += inverse[i] @ (basis[:, j] * basis[:, k]) * weights[k]
    np.testing.assert_allclose(model.illumination_matrix(weights), expected, atol=1e-13)


def test_a_full_basis_is_the_spectrum_itself() -> None:
    model = BasisModel(BINS, np.linalg.qr(np.random.default_rng(1).normal(size=(31, 31)))[0])
    lights = [light.resampled(BINS, average=True) for light in LIGHTS[::10]]
    once = on(BINS)
    assert errors(model, once, model.surface_coefficients(once), lights).max() < 1e-9
    twice = once * once[::-1]
    coefficients = model.reflect(*(model.surface_coefficients(s) for s in (once, once[::-1])))
    assert errors(model, twice, coefficients, lights).max() < 1e-9


def test_sharpening_keeps_the_span_and_concentrates_each_vector() -> None:
    basis = principal_components(representative_spectra(LIGHTS[:9], on(BINS), BINS), 5)
    sharp = sharpened_basis(basis)
    np.testing.assert_allclose(basis @ (basis.T @ sharp), sharp, atol=1e-10)
    edges = np.round(np.linspace(0, 31, 6)).astype(int)
    for i, vector in enumerate(sharp.T):
        share = (vector[edges[i] : edges[i + 1]] ** 2).sum() / (vector**2).sum()
        part = basis[edges[i] : edges[i + 1]]
        assert share == pytest.approx(
            np.linalg.eigvalsh(part.T @ part)[-1], abs=1e-9
        )  # the largest value that the span allows
        assert share > 0.5
    flat = basis @ (basis.T @ np.ones(31))
    np.testing.assert_allclose(sharp.sum(axis=1), flat, atol=1e-9)


def test_optimized_intervals_suit_smooth_lights_and_are_no_worse_than_equal_ones() -> None:
    smooth = [observer.normalized(catalogue.illuminant(n)).resampled(BINS, average=True) for n in ("A", "D50", "D75")]
    surfaces = on(BINS)
    basis = principal_components(representative_spectra(smooth, surfaces, BINS), 7)
    edges = optimized_edges([(light, surfaces) for light in smooth], basis, BINS, sweeps=2)
    found, equal = (
        errors(model, surfaces, model.surface_coefficients(surfaces), smooth).mean()
        for model in (FactorModel(BINS, basis, edges=edges), FactorModel(BINS, basis))
    )
    assert found <= equal
    assert found < 1.0


def test_eight_natural_nodes_over_all_lights() -> None:
    model = NodeModel.natural(8)
    surfaces = on(GRID)
    coefficients = model.surface_coefficients(CHECKER)
    assert errors(model, surfaces, coefficients, LIGHTS).mean() < 0.4
    again = surfaces * surfaces[::-1]
    assert errors(model, again, model.reflect(coefficients, coefficients[::-1]), LIGHTS).mean() < 0.45


def test_more_nodes_are_better_and_any_wavelengths_can_be_used() -> None:
    surfaces = on(GRID)
    means = [
        errors(model, surfaces, model.surface_coefficients(surfaces), LIGHTS).mean()
        for model in map(NodeModel.natural, sorted(NATURAL_NODES_NM))
    ]
    assert means == sorted(means, reverse=True)
    own = NodeModel.natural([420, 470, 520, 570, 620, 670], GRID, training=surfaces)
    assert errors(own, surfaces, own.surface_coefficients(surfaces), LIGHTS).mean() < 2.5


@pytest.mark.parametrize("grid", [GRID, BINS, SpectralGrid.uniform(360, 830, 10)], ids=str)
@pytest.mark.parametrize("count", [1, 2, 5, 24])
def test_scene_nodes_are_exact_for_their_surfaces_under_every_light(grid: SpectralGrid, count: int) -> None:
    surfaces = np.random.default_rng(count).uniform(size=(count, grid.size))
    model = NodeModel.scene(surfaces, grid)
    assert model.size == max(count, 8)
    assert errors(model, surfaces, model.surface_coefficients(surfaces), LIGHTS).max() < 1e-9
    mixture = np.random.default_rng(1).dirichlet(np.ones(count), size=20)
    coefficients = mixture @ model.surface_coefficients(surfaces)
    assert errors(model, mixture @ surfaces, coefficients, LIGHTS[::9]).max() < 1e-9


def test_scene_nodes_of_measured_surfaces_and_of_as_many_nodes_as_surfaces() -> None:
    model = NodeModel.scene(CHECKER, GRID, size=24)
    assert errors(model, on(GRID), model.surface_coefficients(CHECKER), LIGHTS).max() < 1e-9
    few = NodeModel.scene(CHECKER, GRID, size=6)
    assert 0.1 < errors(few, on(GRID), few.surface_coefficients(CHECKER), LIGHTS).mean() < 2


@pytest.mark.parametrize("brightness", [1.0, 0.02])
def test_few_nodes_serve_dark_surfaces_as_they_serve_bright_ones(brightness: float) -> None:
    """Three narrow bands of no natural surface: each needs a node of its own, however dark it is."""
    centers = np.array([455.0, 550.0, 625.0])
    bands = brightness * np.exp(-0.5 * ((GRID.wavelengths_nm - centers[:, None]) / 6.0) ** 2)
    model = NodeModel.scene(bands, GRID, size=3)
    np.testing.assert_allclose(model.nodes_nm, centers, atol=12.0)  # two standard deviations of a band


def test_the_first_node_is_the_wavelength_that_predicts_all_others_best() -> None:
    scene = on(GRID)[:3]
    first, second = np.triu_indices(3)
    wavelengths, natural = catalogue.natural_reflectance_components()
    others = [scene[first] * scene[second], [np.interp(GRID.wavelengths_nm, wavelengths, row) for row in natural]]
    rows = np.concatenate([part / np.linalg.norm(part) for part in (scene, np.concatenate(others))])
    visible = np.linalg.norm(observer.xyz_from_spectrum(GRID), axis=0)
    left = [
        np.linalg.norm(
            (rows - np.outer(rows[:, knot], rows[:, knot] @ rows / np.square(rows[:, knot]).sum())) * visible
        )
        for knot in range(GRID.size)
    ]
    assert NodeModel.scene(scene, GRID, size=1).nodes_nm == GRID.wavelengths_nm[np.argmin(left)]


def test_scene_nodes_of_dependent_surfaces() -> None:
    surfaces = on(GRID)[[0, 0, 3, 3]] * np.array([[1], [0.5], [1], [0]])
    model = NodeModel.scene(surfaces, GRID, size=2)
    assert errors(model, surfaces, model.surface_coefficients(surfaces), LIGHTS[::9]).max() < 1e-9
    black = NodeModel.scene(np.zeros((2, GRID.size)), GRID)
    assert errors(black, on(GRID), black.surface_coefficients(on(GRID)), LIGHTS).mean() < 0.4


def test_two_reflections_among_scene_surfaces_have_a_small_error() -> None:
    surfaces = on(GRID)[:5]
    model = NodeModel.scene(surfaces, GRID)
    coefficients = model.surface_coefficients(surfaces)
    first, second = np.triu_indices(5)
    twice = model.reflect(coefficients[first], coefficients[second])
    assert errors(model, surfaces[first] * surfaces[second], twice, LIGHTS).mean() < 0.5


def test_spectra_and_their_samples_are_the_same_surface() -> None:
    model = NodeModel.natural(8)
    np.testing.assert_allclose(model.surface_coefficients(CHECKER), model.surface_coefficients(on(GRID)), rtol=1e-9)


def test_impossible_models_are_refused() -> None:
    with pytest.raises(InvalidInputError, match=r"5 natural nodes; searched sets are 6, 7, 8, 9"):
        NodeModel.natural(5)
    with pytest.raises(InvalidInputError, match=r"node wavelengths .* rising, between 380 and 780 nm"):
        NodeModel.natural([500, 400])
    with pytest.raises(InvalidInputError, match=r"node wavelengths .* between 380 and 780 nm"):
        NodeModel.natural([300, 400])
    with pytest.raises(InvalidInputError, match=r"99 nodes on .*; expected 1 to 81"):
        NodeModel.scene(CHECKER, GRID, size=99)
    with pytest.raises(InvalidInputError, match=r"reflectances have shape \(5,\); the grid .* needs 81 values"):
        NodeModel.natural(8).surface_coefficients(np.ones(5))
    with pytest.raises(InvalidInputError, match="the 2 basis vectors depend on each other"):
        BasisModel(BINS, np.ones((31, 2)))
    with pytest.raises(InvalidInputError, match=r"40 components of 24 spectra with 31 samples; expected 1 to 24"):
        principal_components(on(BINS), 40)
    with pytest.raises(InvalidInputError, match=r"edges \[0, 31\] do not cut 31 samples into 2 intervals"):
        sharpened_basis(principal_components(on(BINS), 2), [0, 31])
    with pytest.raises(InvalidInputError, match=r"reference light 'LPS' has linear RGB .* inside the gamut"):
        RgbModel(BINS, catalogue.illuminant("LPS"))


def test_a_light_on_other_knots_keeps_the_power_of_its_lines() -> None:
    model = BasisModel(BINS, np.eye(31))
    line = Spectrum("line", SpectralGrid(np.array([542.0, 543.0, 544.0])), np.array([0.0, 10.0, 0.0]))
    assert model.light_coefficients(line).sum() * 10 == pytest.approx(10.0, rel=0.05)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (lambda red: [red, np.ones(81)], "1 of 2 reflectances are spectra"),
        (lambda red: [np.ones(81), red], "1 of 2 reflectances are spectra"),
        (lambda red: red, r"a list of spectra, such as \[red\]"),
        (lambda red: iter([red]), "expected an array of values, or a list of spectra"),
    ],
)
def test_reflectances_of_another_form_are_refused(given, message: str) -> None:
    """An array among spectra was left out without a word."""
    with pytest.raises(InvalidInputError, match=message):
        NodeModel.natural(8).surface_coefficients(given(catalogue.reflectance("red")))


def test_a_number_of_nodes_may_be_numpys() -> None:
    assert NodeModel.natural(np.int64(7)).size == 7
