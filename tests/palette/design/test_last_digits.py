# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes whose weights differ a million times: no side gains a millionth, by another solver on the rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.optimize import lsq_linear

from benchmarks.palette.cases.hard import hard_problem
from benchmarks.palette.cases.odd import odd_problem
from benchmarks.palette.checks import statement as independent
from benchmarks.palette.checks.optimality import side_gains
from benchmarks.palette.palette_joint import generated_palette
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, PaletteSolution, solve_palette
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import initial_state
from spectral_core.palette.design.factored import FactoredRows
from spectral_core.palette.design.orthogonal import refined
from spectral_core.palette.qp.block import Block
from spectral_core.palette.qp.engine import Engine
from spectral_core.palette.qp.quadratic import Quadratic
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid


def weighty(seed: int, *, linked: bool = False) -> PaletteProblem:
    """Two to four materials under two to four lights, weights from a thousandth to a thousand."""
    rng = np.random.default_rng(seed)
    rows, columns = rng.integers(2, 5, 2)
    grid = SpectralGrid.uniform(400, 700, float(rng.choice([10, 20])))
    nm = grid.wavelengths_nm
    lights = []
    for j in range(columns):
        wave = 1 + 0.6 * np.sin(nm / rng.uniform(20, 60) + rng.uniform(0, 6))
        lights.append(PaletteLight(Illuminant(f"l{j}", grid, wave * rng.uniform(0.5, 2) / 60), free=j > 0))
    cells = [
        [Cell.fixed(rng.uniform(0.05, 0.8, 3), weight=10 ** rng.uniform(-3, 3)) for _ in range(columns)]
        for _ in range(rows)
    ]
    if linked:
        cells[1][1] = Cell.same_as((0, 1), weight=10 ** rng.uniform(-3, 3))
    materials = tuple(PaletteReflectance(f"r{i}") for i in range(rows))
    smoothness = float(10 ** rng.uniform(-4, -1))
    return PaletteProblem(grid, tuple(lights), materials, tuple(map(tuple, cells)), smoothness=smoothness)


def rows_of(solution: PaletteSolution, side: str, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and right-hand side of one spectrum: colors by Simpson's rule, weights and roughness as documented."""
    problem, axis = solution.problem, 0 if side == "reflectances" else 1
    others = solution.illuminants if axis == 0 else solution.reflectances
    weights, smoothness = independent.weights(problem)
    rows, right = [], []
    for cell, weight in weights.items():
        if cell[axis] == k:
            rows.append(independent.color_matrix(problem.grid, others[cell[1 - axis]]) * weight / np.sqrt(3))
            right.append(problem.cells[cell[0]][cell[1]].target * weight / np.sqrt(3))
    rows.append(smoothness * (1 if axis == 0 else 10) * independent.roughness(problem))
    return np.concatenate(rows), np.concatenate([*right, np.zeros(problem.grid.size)])


@pytest.mark.parametrize("seed", range(6))
def test_no_side_gains_a_millionth_however_weights_differ(seed: int) -> None:
    solution = solve_palette(weighty(seed), explain=False, seconds=20)
    assert solution.status in ("solved", "compromise")
    for side, spectra in (("reflectances", solution.reflectances), ("lights", solution.illuminants)):
        here = best = 0.0
        bounds = getattr(solution.problem, f"{side[:-1]}_bounds")
        for k, spectrum in enumerate(spectra):
            if getattr(solution.problem, side)[k].free:
                rows, right = rows_of(solution, side, k)
                here += np.sum((rows @ spectrum.values - right) ** 2)
                found = lsq_linear(rows, right, bounds, method="bvls", tol=1e-14, lsq_solver="exact", max_iter=4000)
                best += 2 * found.cost
        assert here - best <= 1e-6 * here


@pytest.mark.parametrize("linked", [False, True], ids=["separate", "linked"])
@pytest.mark.parametrize("seed", [2, 8, 12])
def test_a_refined_side_is_the_optimum_of_its_rows(seed: int, linked: bool) -> None:
    """Also with a shared free color; the engine alone is off by parts of the objective that weights hide."""
    problem = weighty(seed, linked=linked)
    assembler = Assembler(problem, compiled_requests(problem))
    quadratic = assembler.assembled("reflectances", initial_state(problem)).quadratic
    answer = Engine().solve(quadratic)
    better = refined(quadratic, answer)
    matrix, right = quadratic.least_squares()
    bounds = quadratic.lower, quadratic.upper
    best = lsq_linear(matrix.toarray(), right, bounds, method="bvls", tol=1e-15, lsq_solver="exact", max_iter=4000)
    x = quadratic.joined(better.colors, better.values)
    assert quadratic.objective(x) <= best.cost * (1 + 1e-9) + 1e-18
    assert np.all((x >= quadratic.lower) & (x <= quadratic.upper))
    before = quadratic.objective(quadratic.joined(answer.colors, answer.values))
    assert quadratic.objective(x) <= before * (1 + 1e-12)  # the same point may have another last digit
    assert better.check.passed


def test_what_cannot_be_refined_is_returned_as_it_was() -> None:
    problem = weighty(2)
    cells = tuple((Cell.fixed(row[0].target, exact=True), *row[1:]) for row in problem.cells)
    held = PaletteProblem(problem.grid, problem.lights, problem.reflectances, cells)
    quadratic = Assembler(held, compiled_requests(held)).assembled("reflectances", initial_state(held)).quadratic
    answer = Engine().solve(quadratic)
    assert refined(quadratic, answer) is answer


def test_exact_cells_keep_the_last_digits() -> None:
    """Normal equations left a reflectance of this palette, of objective 3e-9, a gain of 4e-6."""
    solution = solve_palette(generated_palette(1005), explain=False)
    assert solution.status == "solved"
    assert max(gain for side, gain in side_gains(solution).items() if side != "exact") < 1e-7
    answered = solution.state.record["reflectances"][0].quadratic
    plain = Engine().solve(answered)
    better = refined(answered, plain)
    least, before = (answered.objective(answered.joined(each.colors, each.values)) for each in (better, plain))
    assert least < before * (1 - 1e-6)
    assert better.check.passed
    assert better.check.equality < 1e-13


@pytest.mark.parametrize("seed", [2345030, 2345084, 8120153, 1246611, 3390503])
def test_one_side_alone_keeps_the_last_digits_too(seed: int) -> None:
    """Under given lights: exact cells, CIELAB, and linked spectra with weights of 10⁴; roughness alone is left."""
    solution = solve_palette(hard_problem(seed)[0], explain=False)
    assert solution.status == "solved"
    assert side_gains(solution)["reflectances"] < 1e-6


def test_targets_that_are_met_leave_nothing_to_refine() -> None:
    problem = replace(generated_palette(3), smoothness=0.0)
    lights = tuple(replace(light, free=False) for light in problem.lights)
    cells = tuple((Cell.fixed([0.3, 0.3, 0.3]), *[Cell.ignore()] * (len(lights) - 1)) for _ in problem.cells)
    met = replace(problem, lights=lights, cells=cells)
    quadratic = Assembler(met, compiled_requests(met)).assembled("reflectances", initial_state(met)).quadratic
    answer = Engine().solve(quadratic)
    assert quadratic.objective(quadratic.joined(answer.colors, answer.values)) < 1e-20
    found = refined(quadratic, answer)
    assert found.check.passed and found.check.kkt < 1e-12


def test_a_bright_smooth_light_is_measured_by_its_roughness_itself() -> None:
    """Through the Gram matrix its roughness of 1e-27 was 1e-18, which hid that another light is smoother."""
    solution = solve_palette(generated_palette(112536), explain=False, seconds=20)
    assert solution.status == "solved"
    assert side_gains(solution).get("lights", 0.0) < 1e-6
    quadratic = solution.state.record["lights"][0].quadratic
    values = [light.values for light in solution.illuminants]
    inside = sum(float(np.sum((each.roughness @ v) ** 2)) for each, v in zip(quadratic.blocks, values, strict=True))
    assert quadratic.objective(quadratic.joined(quadratic.best_colors(values), values)) < inside + 1e-24


@pytest.mark.parametrize(
    "problem", [hard_problem(9460362)[0], odd_problem(4472011)[0]], ids=["near-identical lights", "dim lights"]
)
def test_roughness_that_moves_between_the_sides_is_settled(problem: PaletteProblem) -> None:
    """All targets are met. Rounds alone advance by 3e-6 of what is left; the barrier must be below 1e-22."""
    solution = solve_palette(problem, explain=False, seconds=20)
    assert solution.status == "solved"
    assert max(gain for side, gain in side_gains(solution).items() if side != "exact") < 1e-6


def block(rng: np.random.Generator, samples: int, colors: int, exact: int, smooth: float) -> Block:
    rows = rng.uniform(0, 1, (6, samples))
    weights = 10 ** rng.uniform(-2, 4, 6)
    weights[:exact] = np.inf
    roughness = smooth * np.diff(np.eye(samples), n=2, axis=0)
    return Block(
        rows, rng.uniform(0, 1, 6), rng.uniform(0, 1, (6, colors)), weights, roughness, roughness.T @ roughness,
        np.zeros(samples), np.ones(samples),
    )  # fmt: skip


@pytest.mark.parametrize("smooth", [0.0, 1e-3])
@pytest.mark.parametrize(("colors", "exact"), [(0, 0), (0, 2), (3, 0), (3, 2), (6, 1)])
def test_a_factored_step_is_the_least_squares_step_of_all_rows(colors: int, exact: int, smooth: float) -> None:
    """Against the null space and the pseudoinverse of the whole dense system."""
    rng = np.random.default_rng(colors * 10 + exact)
    blocks = tuple(block(rng, size, colors, exact, smooth) for size in (12, 9, 12))
    known = rng.uniform(0, 1, (4, colors)), rng.uniform(0, 1, 4), 10 ** rng.uniform(-1, 1, 4)
    box = np.zeros((colors // 3, 3)), np.ones((colors // 3, 3))
    problem = Quadratic(blocks, *box, *(known if colors else ()))
    rows, right = problem.least_squares()
    held, wanted = problem.equalities()
    x = rng.uniform(0, 1, problem.size)
    factored = FactoredRows(problem)
    for share in (1.0, 0.7, 0.7):
        free = rng.uniform(size=problem.size) < share
        left, missing = right - rows @ x, wanted - held @ x
        step = factored.step(free, left, missing)
        inner, outer = rows.toarray()[:, free], held.toarray()[:, free]
        across = null_space(outer) if exact else np.eye(int(free.sum()))
        own = np.linalg.lstsq(outer, missing, rcond=None)[0] if exact else np.zeros(len(across))
        best = own + across @ np.linalg.lstsq(inner @ across, left - inner @ own, rcond=None)[0]
        assert step is not None and not step[~free].any()
        assert np.allclose(outer @ step[free], missing, atol=1e-9)
        least = float(np.linalg.norm(inner @ best - left))
        assert float(np.linalg.norm(inner @ step[free] - left)) == pytest.approx(least, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("tied", [False, True])
def test_exact_rows_that_depend_on_each_other_leave_a_factored_step(tied: bool) -> None:
    """Zero rows and multiples: under a light without power exact cells ask nothing of the spectrum."""
    rng = np.random.default_rng(0)
    first = block(rng, 8, 3, 4, 1e-3)
    first.rows[1], first.ties[1] = 2 * first.rows[0], 2 * first.ties[0]
    first.rows[2], first.ties[2] = 0.0, [1.0, 0.0, 0.5] if tied else 0.0
    problem = Quadratic((first,), np.zeros((1, 3)), np.ones((1, 3)))
    rows, held = problem.least_squares()[0].toarray(), problem.equalities()[0].toarray()
    wanted = rng.uniform(0, 1, problem.size)
    left, missing = rng.uniform(0, 1, len(rows)), held @ wanted
    step = FactoredRows(problem).step(np.ones(problem.size, bool), left, missing)
    assert np.allclose(held @ step, missing, atol=1e-9)
    across = null_space(held, rcond=1e-10)
    best = wanted + across @ np.linalg.lstsq(rows @ across, left - rows @ wanted, rcond=None)[0]
    assert np.linalg.norm(rows @ step - left) == pytest.approx(np.linalg.norm(rows @ best - left), abs=1e-9)


@pytest.mark.parametrize("seed", [9310800, 5512878])
def test_a_light_without_power_leaves_nothing_to_gain(seed: int) -> None:
    """Roughness alone is left; multipliers that are no numbers had counted as zero."""
    solution = solve_palette(hard_problem(seed)[0], explain=False)
    gains = side_gains(solution)
    assert max(gain for side, gain in gains.items() if side != "exact") < 1e-6
    assert all(answer.check.passed for _, answer in solution.state.record.values()) == solution.status.trusted


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(6612019, id="roughness a trillionth of the colors"),
        pytest.param(6612230, id="471 samples"),
        pytest.param(6612174, id="roughness of lights a million times that of reflectances"),
    ],
)
def test_a_tiny_roughness_is_as_small_as_it_can_be(seed: int) -> None:
    """Objectives of 1e-15 to 1e-19 could lose 47 %, 0.01 % and 9 % when a side was solved again."""
    solution = solve_palette(hard_problem(seed)[0], explain=False, seconds=20)
    gains = side_gains(solution)
    assert solution.status == "solved"
    assert gains.pop("exact") == 0.0
    assert max(gains.values()) < 1e-6


def test_factors_keep_light_rows_whatever_their_order(rng: np.random.Generator) -> None:
    """Rows a trillion times larger after small ones: the small rows alone decide the directions that are left."""
    heavy, light = 1e4 * rng.standard_normal((2, 6)), 1e-9 * rng.standard_normal((6, 6))
    bounds = np.full(6, -np.inf), np.full(6, np.inf)
    block = Block(
        heavy, heavy @ np.full(6, 0.5), np.zeros((2, 0)), np.ones(2), light, light.T @ light, *bounds
    )  # fmt: skip
    rows = FactoredRows(Quadratic((block,), np.zeros((0, 3)), np.zeros((0, 3))))
    x = np.full(6, 0.5)
    for _ in range(3):
        x = x + rows.step(np.full(6, True), *rows.left(x))
    across = null_space(heavy)
    rough = light @ x
    along = np.linalg.norm((light @ across).T @ rough)
    assert along < 1e-9 * np.linalg.norm(light @ across) * np.linalg.norm(rough)
    assert np.abs(heavy @ (x - 0.5)).max() < 1e-11
