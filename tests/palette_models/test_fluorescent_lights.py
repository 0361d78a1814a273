# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes with dyes whose lights are designed too: optimal for both sides, or reported as unfinished."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.palette.checks.optimality import side_gains
from spectral_core.errors import GridMismatchError, InvalidInputError
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.palette.assemble.criteria import second_differences
from spectral_core.palette.paint.fluorescence import color_from_light, color_from_surface
from spectral_core.palette.paint.fluorescent_design import FluorescentSolution, solve_fluorescent
from spectral_core.palette.paint.fluorescent_report import palette_solution
from spectral_core.palette.qp.answer import Check
from spectral_core.spectra import catalogue, observer
from spectral_core.spectra.fluorescence import FluorescentDye, share_between_knots
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

GRID = SpectralGrid.uniform(360, 780, 10)
DYE = FluorescentDye.gaussian("green", 400, 530)
D65 = observer.normalized(catalogue.illuminant("D65"))


def designed(cells: tuple[tuple[Cell, ...], ...], **rest: object) -> PaletteProblem:
    """Two materials under daylight and a light that is designed."""
    wave = normalized_wave()
    lights = (PaletteLight(D65), PaletteLight(wave, free=True))
    return PaletteProblem(GRID, lights, (PaletteReflectance("a"), PaletteReflectance("b")), cells, **rest)  # type: ignore[arg-type]


def normalized_wave() -> Illuminant:
    wave = Illuminant("wave", GRID, 1.02 + np.sin(GRID.wavelengths_nm / 25))
    return observer.normalized(wave, luminance=2.0)


def measured() -> PaletteProblem:
    """The same under two measured lights."""
    return replace(designed(CELLS), lights=(PaletteLight(D65), PaletteLight(normalized_wave())))


CELLS = (
    (Cell.fixed((0.3, 0.2, 0.1)), Cell.fixed((0.2, 0.9, 0.3), weight=3.0)),
    (Cell.same_as((0, 0)), Cell.fixed((0.5, 0.1, 0.4))),
)


def side_gains_with_dyes(solution: FluorescentSolution) -> list[float]:
    """By how much the sum of squares falls if either side alone is solved again by cvxpy, relative to it."""
    import cvxpy as cp

    problem, n = solution.problem, GRID.size
    rough = problem.smoothness * second_differences(GRID)
    shown, gains = solution.actual_linear_rgb, []
    for side in ("reflectances", "lights"):
        terms, constraints, here = [], [], 0.0
        color: dict[tuple[int, int], object] = {}
        for i, paint in enumerate(solution.surfaces):
            if side == "reflectances":
                x = cp.Variable(n + len(paint.dyes), nonneg=True)
                share = share_between_knots(paint.dyes, GRID.wavelengths_nm)
                constraints.append(x[:n] + (share @ x[n:] if paint.dyes else 0) <= 1)
                terms.append(cp.sum_squares(rough @ x[:n]))
                here += float(np.sum((rough @ paint.reflectance.values) ** 2))
                for j, light in enumerate(solution.illuminants):
                    color[i, j] = color_from_surface(light, paint.dyes, GRID) @ x
            else:
                color[i, 0] = shown[i, 0]
        if side == "lights":
            x = cp.Variable(n, nonneg=True)
            terms.append(cp.sum_squares(10 * rough @ x))
            here += float(np.sum((10 * rough @ solution.illuminants[1].values) ** 2))
            for i, paint in enumerate(solution.surfaces):
                color[i, 1] = color_from_light(paint, GRID) @ x
        common = cp.Variable(3)
        middle = (shown[0, 0] + shown[1, 0]) / 2
        for i, row in enumerate(problem.cells):
            for j, cell in enumerate(row):
                if cell.target is not None:
                    terms.append(cell.weight**2 / 3 * cp.sum_squares(color[i, j] - cell.target))
                    here += cell.weight**2 / 3 * float(np.sum((shown[i, j] - cell.target) ** 2))
            terms.append(cp.sum_squares(color[i, 0] - common) / 3)
            here += float(np.sum((shown[i, 0] - middle) ** 2)) / 3
        again = cp.Problem(cp.Minimize(cp.sum(cp.hstack(terms))), constraints)
        again.solve(solver="CLARABEL", tol_gap_abs=1e-11, tol_gap_rel=1e-9, tol_feas=1e-9)
        gains.append((here - again.value) / here)
    return gains


def test_a_palette_with_dyes_and_a_designed_light_is_optimal_for_both_sides() -> None:
    """One side after the other until a round gained a thousandth was called solved; a side could gain half."""
    solution = solve_fluorescent(designed(CELLS, smoothness=0.05), {0: [DYE]}, seconds=60)
    assert solution.settled
    assert solution.trusted
    assert palette_solution(solution).status in ("solved", "compromise")
    assert max(side_gains_with_dyes(solution)) < 1e-6


def test_a_design_that_runs_out_of_time_is_reported_and_continues() -> None:
    problem = designed(CELLS, smoothness=0.05)
    early = solve_fluorescent(problem, {0: [DYE]}, seconds=0)
    assert not early.settled
    assert palette_solution(early).status == "still_improving"
    later = solve_fluorescent(problem, {0: [DYE]}, seconds=0, start=early.illuminants)
    assert max(side_gains_with_dyes(later)) < max(side_gains_with_dyes(early))
    with pytest.raises(GridMismatchError):
        solve_fluorescent(problem, {0: [DYE]}, start=(D65, D65))


def test_a_designed_light_without_dyes_is_as_smooth_as_in_a_plain_palette() -> None:
    found = palette_solution(solve_fluorescent(designed(CELLS, smoothness=0.05), {}, seconds=60))
    gains = side_gains(found)
    assert max(gains["reflectances"], gains["lights"]) < 1e-6


def test_the_colors_with_dyes_are_those_of_the_observer() -> None:
    ten = "cie_1964_10deg"
    solution = solve_fluorescent(replace(measured(), observers=(ten,)), {0: [DYE]})
    for i, paint in enumerate(solution.surfaces):
        for j, light in enumerate(solution.illuminants):
            np.testing.assert_allclose(
                solution.actual_linear_rgb[i, j], paint.linear_rgb(light, observer.observer(ten)), atol=1e-9
            )


def test_the_status_with_dyes_counts_the_worst_pair() -> None:
    solution = solve_fluorescent(measured(), {0: [DYE]})
    apart = replace(solution, worst_pair_delta_e_2000=5.0, delta_e_2000=np.zeros((2, 2)))
    assert palette_solution(apart).status == "compromise"
    assert palette_solution(apart).max_delta_e_2000 == 5.0


def test_the_report_of_dyes_names_amounts_and_the_largest_share() -> None:
    found = solve_fluorescent(measured(), {0: [DYE], 1: [DYE]})
    solution = palette_solution(found)
    worst = float(np.nanmax(found.delta_e_2000))
    assert solution.status == ("solved" if max(worst, found.worst_pair_delta_e_2000) <= 3.0 else "compromise")
    for surface in found.surfaces:
        amount = float(surface.amounts[0])
        returned = 100 * surface.returned_share().max()
        text = f"{surface.name} holds {amount:.2f} of green; it returns at most {returned:.0f} %."
        assert (text in solution.notes) == (amount > 1e-4)
    assert bool(solution.notes) == any(surface.amounts[0] > 1e-4 for surface in found.surfaces)
    if solution.notes:
        assert solution.notes[-1].startswith("Apply to Scene gives materials their dyes")
    assert solution.bound_violation == max(found.largest_returned_share - 1.0, 0.0) < 1e-9
    assert solution.rounds == found.rounds and solution.kkt_residual == found.check.kkt
    np.testing.assert_array_equal(solution.delta_e_2000, found.delta_e_2000)
    assert found.largest_returned_share == max(float(each.returned_share().max()) for each in found.surfaces)
    for each, surface in zip(solution.reflectances, found.surfaces, strict=True):
        np.testing.assert_allclose(each.values, np.clip(surface.reflectance.values, 0, 1))


@pytest.mark.parametrize(
    ("changed", "status"),
    [({"exact_error": 2e-6}, "exact_conflict"), ({"settled": False}, "still_improving"),
     ({"check": Check(1.0, 0.0, 0.0)}, "inaccurate"), ({"delta_e_2000": np.full((2, 2), 3.01)}, "compromise"),
     ({"delta_e_2000": np.full((2, 2), 2.99)}, "solved"), ({"delta_e_2000": np.full((2, 2), np.nan)}, "solved")],
)  # fmt: skip
def test_the_status_with_dyes_follows_from_the_solution(changed: dict, status: str) -> None:
    solution = solve_fluorescent(measured(), {0: [DYE]})
    plain = replace(solution, worst_pair_delta_e_2000=0.0, delta_e_2000=np.zeros((2, 2)), settled=True)
    assert plain.trusted and palette_solution(plain).status == "solved"
    assert palette_solution(replace(plain, **changed)).status == status


@pytest.mark.parametrize(
    "wrong",
    [{"observers": ("cie_1931_2deg", "cie_1964_10deg")}, {"match": "perceptual"}, {"reflectance_bounds": (-0.1, 1.0)},
     {"reflectance_bounds": (0.0, 1.1)}, {"scale_lights": True}],
)  # fmt: skip
def test_settings_that_dyes_do_not_support_are_named(wrong: dict) -> None:
    with pytest.raises(InvalidInputError, match="a palette with fluorescence has"):
        solve_fluorescent(replace(measured(), **wrong), {0: [DYE]})
    for item in (-1, 2):
        with pytest.raises(InvalidInputError, match="expected 0 to 1"):
            solve_fluorescent(measured(), {item: [DYE]})
    solve_fluorescent(measured(), {1: [DYE]}, seconds=0.0)
