# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of palettes: their requests as the documentation and the thesis' figures state them."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.palette.presets import (
    color_constancy,
    design_grid,
    hidden_mark,
    light_color,
    metamer_pair,
    most_distinct,
    split_light,
    xray_smoke,
)
from spectral_core.palette.problem import CellMode, PaletteProblem
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import RGB_FROM_XYZ, WHITE_XYZ, XYZ_FROM_RGB
from spectral_core.spectra.observer import STANDARD, observer


def xyz(spectrum) -> np.ndarray:
    """By trapezoids at 0.05 nm from the observer's table."""
    viewer, fine = observer(STANDARD), np.linspace(360, 830, 9401)
    products = np.array([np.interp(fine, viewer.wavelengths_nm, row) for row in viewer.cmfs]) * spectrum.at(fine)
    return (products[:, 1:] + products[:, :-1]).sum(axis=1) * 0.05 / 2


def luminances(problem: PaletteProblem) -> list[float]:
    return [float(xyz(light.spectrum)[1]) for light in problem.lights]


def targets(problem: PaletteProblem) -> list[list[list[float] | None]]:
    return [[None if cell.target is None else list(map(float, cell.target)) for cell in row] for row in problem.cells]


def test_all_presets_design_from_380_to_780_nm() -> None:
    np.testing.assert_allclose(design_grid().wavelengths_nm, np.arange(380, 781, 10))
    np.testing.assert_allclose(design_grid(5.0).wavelengths_nm, np.arange(380, 781, 5))
    for make in (metamer_pair, split_light, color_constancy, xray_smoke, most_distinct):
        assert make().grid.same_as(design_grid())
    assert hidden_mark().grid.same_as(design_grid(5.0))
    d65 = illuminant("D65")
    np.testing.assert_allclose(light_color(d65), RGB_FROM_XYZ @ xyz(d65), rtol=1e-5)


@pytest.mark.parametrize("contrast", [1.5, 3.0])
def test_a_hidden_mark_has_one_color_and_a_contrast(contrast: float) -> None:
    problem = hidden_mark(contrast=contrast)
    assert [light.spectrum.name for light in problem.lights] == ["D65", "HP1"]
    np.testing.assert_allclose(luminances(problem), 1.0, rtol=1e-5)
    found = targets(problem)
    assert found[0][0] == found[1][0] == [0.26, 0.235, 0.19]
    assert [row[0].exact for row in problem.cells] == [True, True] and not problem.cells[0][1].exact
    mark, ground = (XYZ_FROM_RGB @ row[1] for row in found)
    np.testing.assert_allclose(mark / ground, contrast, rtol=1e-9)
    # their geometric mean is the luminance of the concealed color, in the color of sodium light
    concealed = (XYZ_FROM_RGB @ np.array([0.26, 0.235, 0.19]))[1]
    np.testing.assert_allclose(np.sqrt(mark * ground), concealed * xyz(problem.lights[1].spectrum), rtol=1e-4)
    assert problem.smoothness == 0.2
    with pytest.raises(InvalidInputError, match="contrast is 1"):
        hidden_mark(contrast=1.0)


def test_a_metamer_pair_shares_a_blue_and_differs_under_sodium() -> None:
    problem = metamer_pair()
    assert [light.spectrum.name for light in problem.lights] == ["HP1", "D65"]
    np.testing.assert_allclose(luminances(problem), 1.0, rtol=1e-5)
    assert targets(problem) == [[[0.55, 0.30, 0.02], None], [[0.30, 0.28, 0.05], None]]
    free, same = problem.cells[0][1], problem.cells[1][1]
    np.testing.assert_allclose(free.box, [[0.05, 0.10, 0.25], [0.35, 0.45, 0.9]])
    assert (same.mode, same.others, same.exact) == (CellMode.SAME, ((0, 1),), True)


def test_a_split_light_is_that_of_figure_5_2() -> None:
    problem = split_light()
    rdbu = np.array([(202, 0, 32), (244, 165, 130), (247, 247, 247), (146, 197, 222), (5, 113, 176)]) / 255
    found = np.array(targets(problem))
    np.testing.assert_allclose(found[:, 2], rdbu)
    np.testing.assert_allclose(found[:, 0], np.broadcast_to(rdbu.mean(axis=0), (5, 3)))
    warm, cold = (rdbu[0] + rdbu[1]) / 2, (rdbu[3] + rdbu[4]) / 2
    np.testing.assert_allclose(found[:, 1], [warm, warm, rdbu[2], cold, cold])
    np.testing.assert_array_equal([[cell.weight for cell in row] for row in problem.cells], [[4.0, 1.0, 1.0]] * 5)
    np.testing.assert_allclose(luminances(problem), 6.0, rtol=1e-4)
    assert [light.free for light in problem.lights] == [False, True, True]
    assert [item.name for item in problem.reflectances] == [f"reflectance {k}" for k in range(1, 6)]
    nm = problem.grid.wavelengths_nm
    for light, period in zip(problem.lights[1:], (62.0, 88.4), strict=True):
        sine = 1 + np.sin(2 * np.pi * (nm - 400) / period)
        np.testing.assert_allclose(light.spectrum.values / light.spectrum.values[2], sine / sine[2], atol=1e-9)
    assert split_light(weight=2.5).cells[3][0].weight == 2.5


def test_constancy_keeps_one_color_and_changes_the_other() -> None:
    problem = color_constancy()
    assert targets(problem) == [[[0.10, 0.32, 0.12], None], [[0.35, 0.10, 0.08], [0.08, 0.16, 0.38]]]
    kept = problem.cells[0][1]
    assert (kept.mode, kept.others, kept.exact) == (CellMode.CONSTANT, ((0, 0),), True)
    np.testing.assert_allclose(luminances(problem), 2.0, rtol=1e-4)
    assert [light.free for light in problem.lights] == [False, True]


def test_smoke_is_black_under_two_white_lights() -> None:
    problem = xray_smoke()
    assert targets(problem) == [[[0.30, 0.26, 0.20]] * 3, [None, None, [0.20, 0.32, 0.38]]]
    assert [(cell.mode, cell.weight) for cell in problem.cells[1]] == [
        (CellMode.BLACK, 4.0), (CellMode.BLACK, 4.0), (CellMode.FIXED, 1.0)
    ]  # fmt: skip
    for light in problem.lights:
        assert light.free and light.luminance == 3.0
        np.testing.assert_array_equal(light.white_xyz, WHITE_XYZ)
    np.testing.assert_allclose(luminances(problem), 3.0, rtol=1e-4)
    starts = [light.spectrum.values for light in problem.lights]
    for start, period in zip(starts, (62.0, 75.0, 88.4), strict=True):
        sine = 1 + np.sin(2 * np.pi * (problem.grid.wavelengths_nm - 400) / period)
        np.testing.assert_allclose(start / start[2], sine / sine[2], atol=1e-9)


@pytest.mark.parametrize("color", [None, (0.2, 0.3, 0.1)])
def test_distinct_materials_match_the_first_and_differ_from_all_others(color: tuple[float, ...] | None) -> None:
    problem = most_distinct(3, color=color)
    for i, row in enumerate(problem.cells):
        assert row[1].mode is CellMode.DISTINCT
        assert row[1].others == tuple((k, 1) for k in range(3) if k != i)
        if color is None:
            assert row[0].mode is (CellMode.SAME if i else CellMode.FREE)
            assert row[0].others == (((0, 0),) if i else ()) and row[0].exact == bool(i)
        else:
            assert tuple(row[0].target) == color and row[0].exact
    assert len(most_distinct().reflectances) == 5 and problem.smoothness == 0.5
    assert [item.name for item in problem.reflectances] == ["material 1", "material 2", "material 3"]
    np.testing.assert_allclose(luminances(problem), 2.0, rtol=1e-4)
    with pytest.raises(InvalidInputError, match="count is 1"):
        most_distinct(1)
    assert len(most_distinct(2).cells) == 2
