# SPDX-License-Identifier: GPL-3.0-or-later
"""Alternative solutions of a palette: all meet the requests, they differ elsewhere, and locked materials stay."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, presets, solve_palette
from spectral_core.palette.alternatives import ROUGHEST, _Pusher, alternatives
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.distinct.search import distinct_solutions, solve_distinct
from spectral_core.palette.files import read_solution, write_solution
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.observer import linear_rgb_from_product, normalized, observer, xyz_from_product
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid


def colors(solution, names=()):
    """Colors of all cells, integrated again from the spectra."""
    return np.array(
        [
            [
                linear_rgb_from_product(Illuminant(light.name, light.grid, light.values), item.grid) @ item.values
                for light in solution.illuminants
            ]
            for item in solution.reflectances
        ]
    )


@pytest.mark.parametrize("preset", ["hidden_mark", "metamer_pair", "color_constancy"])
def test_every_solution_meets_the_requests(preset) -> None:
    found = alternatives(getattr(presets, preset)(), count=3)
    assert len(found) == 3
    first = found[0].solution
    asked = np.isfinite(first.delta_e_2000)
    base = colors(first)
    for other in found[1:]:
        assert other.apart > 3
        again = colors(other.solution)
        np.testing.assert_allclose(again, other.solution.actual_linear_rgb, atol=1e-9)
        assert np.abs(again - base)[asked].max() < 1e-6
        for item in other.solution.reflectances:
            assert item.values.min() >= 0
            assert item.values.max() <= 1


def test_locked_materials_are_kept_and_the_others_vary() -> None:
    problem = presets.hidden_mark()
    first = alternatives(problem, count=2)
    kept = first[1].solution.reflectances[0]
    again = alternatives(problem, count=2, locked={0: kept}, seed=4)
    for each in again:
        np.testing.assert_array_equal(each.solution.reflectances[0].values, kept.values)
    assert again[1].apart > 1
    with pytest.raises(InvalidInputError, match="unlock one"):
        alternatives(problem, locked=dict(enumerate(first[0].solution.reflectances)))


def test_the_starts_of_most_distinct_are_alternatives() -> None:
    problem = presets.most_distinct(3)
    every = distinct_solutions(problem, starts=3)
    assert len(every) == 3
    best = solve_distinct(problem, starts=3)
    assert best.residuals["least_delta_e_2000"] == pytest.approx(every[0].residuals["least_delta_e_2000"])
    for (
        solution
    ) in every:  # each is a complete solution: matches hold, and the stated difference is that of its spectra
        shown = lab_from_linear_rgb(np.maximum(colors(solution), 0))
        least = min(float(delta_e_2000(shown[a, 1], shown[b, 1])) for a in range(3) for b in range(a))
        assert least == pytest.approx(solution.residuals["least_delta_e_2000"], abs=0.1)
        assert np.ptp(colors(solution)[:, 0], axis=0).max() < 1e-6


def test_a_palette_without_freedom_has_one_solution() -> None:
    problem = presets.split_light()
    assert solve_palette(problem).status.usable
    found = alternatives(problem, count=3)
    assert found[0].apart == 0


@pytest.mark.parametrize(("step", "share"), [(10.0, 1.0), (5.0, 0.25), (20.0, 1.0)])
def test_alternatives_bend_as_much_per_wavelength_on_any_grid(step: float, share: float) -> None:
    """Second differences of one curve fall as the square of the step; beyond 10 nm the limit does not grow."""
    grid = SpectralGrid.uniform(400, 700, step)
    problem = PaletteProblem(
        grid,
        (PaletteLight(illuminant("D65")), PaletteLight(illuminant("A"))),
        (PaletteReflectance("R"),),
        ((Cell.fixed([0.4, 0.4, 0.4]), Cell.ignore()),),
        smoothness=1.0,
    )
    pusher = _Pusher(Assembler(problem, compiled_requests(problem)), solve_palette(problem).state, 0)
    assert np.abs(pusher.second @ pusher.values).max() < ROUGHEST * share
    assert pusher.limit == pytest.approx(ROUGHEST * share)


D65, LAMP = normalized(illuminant("D65")), normalized(illuminant("A"))
BROWN = (0.3, 0.25, 0.2)


def table(*rows, lights=(D65, LAMP), grid=None, **settings) -> PaletteProblem:
    columns = tuple(each if isinstance(each, PaletteLight) else PaletteLight(each) for each in lights)
    items = tuple(PaletteReflectance(f"paint {number}") for number in range(len(rows)))
    return PaletteProblem(grid or presets.design_grid(), columns, items, rows, **settings)


@pytest.mark.parametrize("exact", [False, True])
def test_alternatives_stay_in_a_range_of_colors(exact: bool) -> None:
    low, high = np.array([0.1, 0.1, 0.0]), np.array([0.35, 0.3, 0.2])
    found = alternatives(table((Cell.fixed(BROWN, exact=True), Cell.free((low, high), exact=exact))))
    assert len(found) > 1
    for each in found:
        shown = colors(each.solution)
        np.testing.assert_allclose(shown[0, 0], BROWN, atol=1e-6)
        assert np.all(shown[0, 1] > low - 1e-5) and np.all(shown[0, 1] < high + 1e-5)


def test_alternatives_match_for_all_observers() -> None:
    names = ("cie_1931_2deg", "cie_1964_10deg")
    found = alternatives(
        table((Cell.free(), Cell.fixed((0.4, 0.2, 0.05))), (Cell.same_as((0, 0)), Cell.ignore()), observers=names)
    )
    assert len(found) > 1 and found[1].apart > 1
    for each in found:
        one, two = each.solution.reflectances
        for name in names:
            matrix = xyz_from_product(D65, one.grid, observer(name))
            np.testing.assert_allclose(matrix @ one.values, matrix @ two.values, atol=1e-5)
        assert each.solution.max_delta_e_2000 < 0.01


def test_alternatives_match_under_variants_and_state_their_own_residuals() -> None:
    variant = normalized(illuminant("D50"))
    rows = (Cell.free(), Cell.fixed((0.4, 0.2, 0.05))), (Cell.black(), Cell.ignore())
    found = alternatives(table(*rows, lights=(PaletteLight(D65, variants=(variant,)), illuminant("HP1"))))
    first = alternatives(table((Cell.fixed(BROWN), Cell.ignore())))
    for each in found:
        dark = linear_rgb_from_product(variant, each.solution.problem.grid) @ each.solution.reflectances[1].values
        np.testing.assert_allclose(dark, 0.0, atol=1e-5)
    roughness = [each.solution.residuals["smoothness"] for each in first]
    assert roughness[1] > 10 * roughness[0]


def test_no_alternative_is_said_to_be_black_that_is_not() -> None:
    """The notes were those of the first solution."""
    rows = (Cell.constant((0, 1)), Cell.ignore()), (Cell.fixed(BROWN), Cell.ignore())
    found = alternatives(table(*rows))
    assert any("is black" in note for note in found[0].solution.notes)
    assert len(found) > 1
    for each in found:
        is_black = bool(each.solution.reflectances[0].values.max() < 1e-6)
        assert is_black == any("is black" in note for note in each.solution.notes)


@pytest.mark.parametrize("bounds", [(0.1, 0.6), (-np.inf, np.inf), (0.0, 1.0)])
def test_alternatives_keep_the_bounds_of_their_palette(bounds) -> None:
    asked = (1.3, 0.25, 0.0) if np.isinf(bounds[1]) else BROWN
    found = alternatives(table((Cell.fixed(asked, exact=True), Cell.ignore()), reflectance_bounds=bounds))
    assert len(found) > 1
    for each in found:
        values = each.solution.reflectances[0].values
        assert values.min() >= bounds[0] and values.max() <= bounds[1]
        np.testing.assert_allclose(colors(each.solution)[0, 0], asked, atol=1e-6)
    assert np.isfinite(found[1].solution.reflectances[0].values).all()


def test_lights_of_one_name_are_told_apart() -> None:
    """The second of two lights named A has no request, so that materials differ under it."""
    twin = Illuminant("D65", LAMP.grid, LAMP.values)
    found = alternatives(table((Cell.ignore(), Cell.fixed(BROWN, exact=True)), lights=(twin, D65)))
    assert len(found) > 1 and found[1].apart > 3
    (seen,) = found[1].seen_under
    np.testing.assert_array_equal(seen.values, twin.values)


def test_alternatives_of_a_solution_from_a_file(tmp_path) -> None:
    problem = table((Cell.fixed(BROWN), Cell.ignore()), scale_lights=True)
    write_solution(tmp_path / "solved.json", solve_palette(problem))
    stored = read_solution(tmp_path / "solved.json")
    found = alternatives(stored.problem, solution=stored)
    assert len(found) > 1
    for each in found:
        np.testing.assert_allclose(colors(each.solution), each.solution.actual_linear_rgb, atol=1e-9)
        np.testing.assert_allclose(each.solution.actual_linear_rgb[0, 0], BROWN, atol=1e-4)


def test_a_number_of_answers_is_whole() -> None:
    """2.7 meant 2 without a message."""
    with pytest.raises(InvalidInputError, match=r"count is 2\.7; expected a whole number"):
        alternatives(presets.metamer_pair(), count=2.7)  # type: ignore[arg-type]


@pytest.mark.parametrize("lamps", [("D65", "HP1"), ("D65", "LPS")])
def test_the_stated_difference_is_that_of_the_colors_outside_of_the_gamut_too(lamps) -> None:
    """Negative RGB was clipped before the difference: 12.3 was stated for 12.7."""
    lights = tuple(PaletteLight(normalized(illuminant(name))) for name in lamps)
    row = (Cell.fixed((0.4, 0.25, 0.1)), *(Cell.ignore() for _ in lamps[1:]))
    names = ("a", "b")
    problem = PaletteProblem(presets.design_grid(), lights, tuple(map(PaletteReflectance, names)), (row, row))
    first, *others = alternatives(problem, count=4)
    assert others

    def seen(solution) -> np.ndarray:
        shown = [
            [linear_rgb_from_product(light, item.grid) @ item.values for light in first.seen_under]
            for item in solution.reflectances
        ]
        assert np.min(shown) < 0.0, "the case has no color outside of the gamut"
        return lab_from_linear_rgb(np.array(shown))

    for other in others:
        largest = delta_e_2000(seen(first.solution), seen(other.solution)).max()
        assert other.apart == pytest.approx(largest, abs=1e-6)
