# SPDX-License-Identifier: GPL-3.0-or-later
"""The table keeps a palette problem unchanged, or refuses it and stays unchanged."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.translate.palette.load import store_problem
from blender_addon.translate.palette.problem import palette_problem, takes_seconds
from spectral_core.errors import InvalidInputError
from spectral_core.palette import (
    Cell,
    PaletteLight,
    PaletteProblem,
    PaletteReflectance,
    SubspaceCriterion,
    presets,
)
from spectral_core.palette.files import read_palette
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

EXAMPLES = [
    path
    for path in sorted((Path(__file__).parents[3] / "examples").glob("*.toml"))
    if 'format = "spectral-scene palette"' in path.read_text("utf-8")
]


def everything() -> PaletteProblem:
    """A problem that uses every feature of the table."""
    grid = SpectralGrid.uniform(400.0, 700.0, 10.0)
    lamps = [normalized(illuminant(name), luminance=2.0) for name in ("D65", "A", "HP1", "FL11")]
    start = normalized(illuminant("A").resampled(grid), luminance=1.0)
    lights = (
        PaletteLight(lamps[0], variants=(lamps[1], lamps[3])),
        PaletteLight(start, free=True, primaries=tuple(lamps[1:]), white_xyz=np.array([1.0, 1.0, 1.0]), luminance=1.0),
        PaletteLight(presets.sine_light(62.0, grid, luminance=3.0), free=True),
    )
    box = ((0.1, 0.2, 0.3), (0.4, 0.5, 0.6))
    cells = (
        (Cell.fixed((0.2, 0.3, 0.4), weight=4.0), Cell.free(box), Cell.black(exact=True)),
        (Cell.same_as((0, 0), exact=True), Cell.constant((1, 0), (1, 2), weight=2.0), Cell.ignore()),
        (Cell.fixed((1.2, -0.1, 0.5), exact=True), Cell.distinct_from((0, 1), (1, 1), weight=0.5), Cell.ignore()),
    )
    materials = (PaletteReflectance("a"), PaletteReflectance("b"), PaletteReflectance("c", reflectance("dark skin")))
    return PaletteProblem(
        grid, lights, materials, cells, smoothness=0.07, smoothness_operator="thesis", match="perceptual", rounds=7,
        scale_lights=True, observers=("cie_1931_2deg", "cie_2015_10deg"), robustness="worst_case", robust_weight=2.5,
    )  # fmt: skip


def assert_same_spectrum(mine, theirs) -> None:
    np.testing.assert_allclose(mine.grid.wavelengths_nm, theirs.grid.wavelengths_nm, rtol=1e-6)
    np.testing.assert_allclose(mine.values, theirs.values, rtol=3e-6, atol=1e-8)


def assert_same(mine: PaletteProblem, theirs: PaletteProblem) -> None:
    np.testing.assert_allclose(mine.grid.wavelengths_nm, theirs.grid.wavelengths_nm, rtol=1e-6)
    for name in ("smoothness_operator", "match", "rounds", "scale_lights", "observers", "robustness"):
        assert getattr(mine, name) == getattr(theirs, name), name
    assert mine.smoothness == pytest.approx(theirs.smoothness, rel=1e-6)
    assert mine.robust_weight == pytest.approx(theirs.robust_weight, rel=1e-6)
    for a, b in zip(mine.lights, theirs.lights, strict=True):
        assert (a.name, a.free) == (b.name, b.free)
        assert_same_spectrum(a.spectrum, b.spectrum)
        assert [each.name for each in a.primaries] == [each.name for each in b.primaries]
        for x, y in zip((*a.primaries, *a.variants), (*b.primaries, *b.variants), strict=True):
            np.testing.assert_allclose(x.values / x.values.max(), y.values / y.values.max(), rtol=3e-6, atol=1e-8)
        assert a.luminance == (None if b.luminance is None else pytest.approx(b.luminance, rel=1e-5))
        if b.white_xyz is None:
            assert a.white_xyz is None
        else:
            np.testing.assert_allclose(a.white_xyz / a.white_xyz.sum(), b.white_xyz / b.white_xyz.sum(), rtol=1e-6)
    for a, b in zip(mine.reflectances, theirs.reflectances, strict=True):
        assert (a.name, a.free) == (b.name, b.free)
        if b.spectrum is not None:
            assert_same_spectrum(a.spectrum, b.spectrum)
    for a, b in zip(sum(mine.cells, ()), sum(theirs.cells, ()), strict=True):
        assert (a.mode, a.others, a.exact) == (b.mode, b.others, b.exact)
        assert a.weight == pytest.approx(b.weight, rel=1e-6)
        for x, y in ((a.target, b.target), (a.box, b.box)):
            assert (x is None) == (y is None)
            if y is not None:
                np.testing.assert_allclose(x, y, atol=1e-6)


@pytest.fixture
def palette(blender):
    palette = blender.context.scene.spectral.palette
    palette.live = False
    return palette


def test_a_problem_with_every_feature_is_kept(palette):
    assert store_problem(palette, everything()) == []
    assert_same(palette_problem(palette), everything())


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.stem)
def test_the_examples_are_kept(palette, file):
    assert len(EXAMPLES) >= 6
    problem = read_palette(file)
    assert store_problem(palette, problem) == []
    assert_same(palette_problem(palette), problem)


def test_too_large_a_weight_is_reduced_with_a_message(palette):
    problem = presets.hidden_mark().with_cell((0, 1), Cell.fixed((0.5, 0.2, 0.0), weight=1e6))
    (note,) = store_problem(palette, problem)
    assert "weight 1e+06 became 1000" in note
    assert palette.materials[0].cells[1].weight == 1000.0


def on_grid(problem: PaletteProblem, start: float, stop: float, step: float) -> PaletteProblem:
    """The problem with measured lights on another grid."""
    grid = SpectralGrid.uniform(start, stop, step)
    return replace(problem, grid=grid, lights=tuple(PaletteLight(light.spectrum) for light in problem.lights))


def infrared() -> Illuminant:
    return Illuminant("IR", SpectralGrid(np.array([900.0, 950.0, 1000.0])), np.array([0.0, 1.0, 0.0]))


def limited() -> list[tuple[PaletteProblem, str]]:
    problem = presets.metamer_pair()
    day, lamp = (normalized(illuminant(name)) for name in ("D65", "HP1"))
    dim = (PaletteLight(day), PaletteLight(normalized(lamp, luminance=1e-5)))
    varied = (PaletteLight(day, variants=(normalized(lamp, luminance=7.0),)), PaletteLight(lamp))
    ranges = Cell.free(((0.1, -np.inf, 0.0), (0.4, 0.5, np.inf)))
    return [
        (replace(problem, rounds=50_000), "rounds 50000 became 10000"),
        (replace(problem, robust_weight=5000.0), "robust_weight 5000 became 1000"),
        (replace(problem, lights=dim), "luminance 1e-05 became 0.001"),
        (replace(problem, lights=varied), "variant HP1 of luminance 7 counts at the light's, 1"),
        (problem.with_cell((1, 1), ranges), "open side of its range became 100"),
    ]


@pytest.mark.parametrize(("problem", "message"), limited(), ids=lambda value: value if isinstance(value, str) else "")
def test_a_number_beyond_the_limits_of_the_table_is_reported(palette, problem, message):
    (note,) = store_problem(palette, problem)
    assert message in note
    palette_problem(palette)  # the table can still be read


def test_a_light_keeps_the_luminance_that_is_required_of_it(palette):
    problem = everything()
    lights = (*problem.lights[:2], replace(problem.lights[2], luminance=4.5))
    store_problem(palette, replace(problem, lights=lights))
    assert palette_problem(palette).lights[2].luminance == pytest.approx(4.5, rel=1e-5)


def test_another_palette_forgets_the_answers_of_the_one_before(blender, palette):
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    blender.ops.spectral.palette_alternatives()
    palette.use_tints = True
    blender.ops.spectral.palette_possible()
    assert len(palette.alternatives)
    assert palette.possible.words
    store_problem(palette, presets.metamer_pair())
    assert not len(palette.alternatives)
    assert not palette.possible.words
    assert not palette.use_tints  # solving the table solves the problem, without further requests


def refused() -> list[tuple[PaletteProblem, str]]:
    problem = presets.metamer_pair()
    uneven = SpectralGrid(np.array([400.0, 410.0, 450.0, 700.0]))
    basis = np.eye(problem.grid.size)[:, :5]
    return [
        (replace(problem, grid=uneven), "equal steps"),
        (replace(problem, grid=SpectralGrid.uniform(interpolation="sampled")), "linear between them"),
        (replace(problem, reflectance_bounds=(0.0, 0.8)), "physical spectra, or no bounds"),
        (replace(problem, subspace=SubspaceCriterion(basis)), "subspace criterion"),
        (replace(problem, observers=("cie_1964_10deg", "cie_1931_2deg")), "for the observer 'cie_1964_10deg'"),
        (on_grid(problem, 250.0, 700.0, 10.0), "300 to 780"),
        (on_grid(problem, 380.0, 1000.0, 10.0), "400 to 900"),
        (on_grid(problem, 380.0, 780.0, 0.5), "5 to 601"),
        (replace(problem, lights=(PaletteLight(infrared()), problem.lights[1])), "shows nothing to the eye"),
    ]


@pytest.mark.parametrize(("problem", "message"), refused(), ids=lambda value: value if isinstance(value, str) else "")
def test_a_problem_that_the_table_cannot_hold_is_refused_and_changes_nothing(palette, problem, message):
    store_problem(palette, presets.hidden_mark())
    with pytest.raises(InvalidInputError, match=message):
        store_problem(palette, problem)
    assert_same(palette_problem(palette), presets.hidden_mark())


def test_this_file_lists_every_field_of_the_core():
    """Fails for a new field of the core until the table keeps or refuses it."""
    known = {
        PaletteProblem: "grid lights reflectances cells smoothness smoothness_operator match subspace rounds "
        "reflectance_bounds light_bounds scale_lights observers robustness robust_weight",
        PaletteLight: "spectrum free primaries white_xyz luminance variants",
        PaletteReflectance: "name spectrum",
        Cell: "mode target others box weight exact",
    }
    for cls, names in known.items():
        assert {field.name for field in fields(cls)} == set(names.split())


def test_the_light_level_is_that_of_the_first_light_and_sources_are_kept(palette):
    problem = everything()
    store_problem(palette, problem)
    assert palette.brightness == pytest.approx(2.0)
    assert [light.intensity for light in palette.lights] == pytest.approx([1.0, 0.5, 1.5])
    got = palette_problem(palette)
    assert got.lights[0].spectrum.source == problem.lights[0].spectrum.source != ""
    assert got.reflectances[2].spectrum.source == problem.reflectances[2].spectrum.source != ""


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({}, False),
        ({"use_tints": True}, True),
        ({"robustness": "worst_case"}, False),
        ({"robustness": "worst_case", "observers": {"cie_1931_2deg", "cie_2015_2deg"}}, True),
        ({"robustness": "worst_case", "observers": {"cie_2015_2deg"}}, True),  # the standard one counts, too
        ({"observers": {"cie_1931_2deg", "cie_2015_2deg"}}, False),
    ],
    ids=["plain", "tints", "worst case", "worst case of two observers", "worst case of another", "two observers"],
)
def test_a_table_that_takes_seconds_is_not_solved_while_a_slider_is_dragged(palette, changed, expected):
    store_problem(palette, presets.hidden_mark())
    for name, value in changed.items():
        setattr(palette, name, value)
    assert takes_seconds(palette) == expected


def test_distinct_cells_dyes_and_the_variants_of_lights_take_seconds(palette):
    store_problem(palette, presets.most_distinct(3))
    assert takes_seconds(palette)
    store_problem(palette, presets.hidden_mark())
    palette.materials[0].dyes.add()
    assert takes_seconds(palette)
    store_problem(palette, everything())  # the worst case, over the variants of its first light
    for material in palette.materials:
        for cell in material.cells:
            cell.mode = "IGNORE"
    palette.observers = {"cie_1931_2deg"}
    assert takes_seconds(palette)
    for light in palette.lights:
        light.design = "DESIGNED"  # has no variants, and shows none
    assert not takes_seconds(palette)
