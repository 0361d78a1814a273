# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights and reflectances designed together: derivatives, and optimality of the result for both sides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.palette.checks.optimality import side_gains
from benchmarks.palette.palette_joint import generated_palette
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import initial_state
from spectral_core.palette.design.interior import joint_descent
from spectral_core.palette.design.joint import Joint
from spectral_core.palette.design.rounds import Rounds, SolveTrace, is_nothing
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.color import linear_rgb_from_xyz
from spectral_core.spectra.observer import normalized, xyz_of
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid, Spectrum


def _joint(problem: PaletteProblem, rounds: int = 2) -> tuple[Joint, Assembler]:
    assembler = Assembler(problem, compiled_requests(problem))
    state, each = initial_state(problem), Rounds(assembler, SolveTrace())
    for _ in range(rounds):
        state = each.round(state)
    joint = Joint.of(assembler, state, perceptual=False)
    assert joint is not None
    return joint, assembler


@pytest.mark.parametrize("seed", [1, 9, 14, 22])
def test_derivatives_agree_with_differences(seed: int) -> None:
    """Groups, exact cells, boxes, measured spectra beside designed ones."""
    joint, _ = _joint(generated_palette(seed))
    rng = np.random.default_rng(seed)
    x = joint.start + 0.1 * np.abs(joint.start).mean() * rng.uniform(size=joint.start.size)
    step = rng.normal(size=x.size)
    total, gradient, hessian, left = joint.derivatives(x, joint.slopes(x), 100.0)
    assert total == pytest.approx(joint.objective(x, 100.0), rel=1e-12)
    np.testing.assert_allclose(left, joint.left(x))
    h = 1e-6
    ahead, behind = (joint.derivatives(x + s * step, joint.slopes(x + s * step), 100.0) for s in (h, -h))
    assert (ahead[0] - behind[0]) / (2 * h) == pytest.approx(gradient @ step, rel=1e-6)
    numeric = (ahead[1] - behind[1]) / (2 * h)
    np.testing.assert_allclose(hessian @ step, numeric, atol=1e-6 * np.abs(numeric).max())


def test_derivatives_of_groups_with_a_measured_color() -> None:
    """A measured material under measured light pulls a free color; so do cells with one measured factor."""
    grid = SpectralGrid(np.linspace(400, 700, 16))
    wave = Illuminant("wave", grid, (1.2 + np.sin(grid.wavelengths_nm / 40)) / 60)
    lights = (PaletteLight(normalized(illuminant("D65"))), PaletteLight(wave, free=True))
    leaf = reflectance("foliage")
    cells = (
        (Cell.ignore(), Cell.fixed((0.2, 0.3, 0.1))),
        (Cell.same_as((0, 0), weight=3.0), Cell.same_as((0, 0), weight=2.0)),
        (Cell.fixed((0.3, 0.2, 0.1)), Cell.same_as((0, 0), weight=0.5)),
    )
    materials = (PaletteReflectance("leaf", leaf), PaletteReflectance("a"), PaletteReflectance("b"))
    joint, _ = _joint(PaletteProblem(grid, lights, materials, cells))
    assert joint.colors == 3 and len(joint.known[0]) == 3
    rng = np.random.default_rng(5)
    x = joint.start + 0.05 * rng.uniform(size=joint.start.size) * np.abs(joint.start).mean()
    step = rng.normal(size=x.size)
    total, gradient, hessian, _ = joint.derivatives(x, joint.slopes(x), 100.0)
    assert total == pytest.approx(joint.objective(x, 100.0), rel=1e-12)
    h = 1e-6
    ahead, behind = (joint.derivatives(x + s * step, joint.slopes(x + s * step), 100.0) for s in (h, -h))
    assert (ahead[0] - behind[0]) / (2 * h) == pytest.approx(gradient @ step, rel=1e-6)
    numeric = (ahead[1] - behind[1]) / (2 * h)
    np.testing.assert_allclose(hessian @ step, numeric, atol=1e-6 * np.abs(numeric).max())
    # the pull of the measured color is its weight times its distance
    measured = normalized(illuminant("D65")), leaf
    shown = linear_rgb_from_xyz(xyz_of(*measured))
    ties, targets, weights = joint.known
    np.testing.assert_allclose(ties, np.eye(3))
    np.testing.assert_allclose(-targets, shown, atol=1e-9)
    assert np.ptp(weights) == 0 and weights[0] > 0


@pytest.mark.parametrize("seed", [0, 16])
def test_objective_is_that_of_both_sides(seed: int) -> None:
    """The joint sum of squares equals that of each side's problem plus the roughness of the other side."""
    problem = generated_palette(seed)
    joint, assembler = _joint(problem)
    state = joint.with_values(joint.start)
    side = assembler.assembled("reflectances", state).quadratic
    values = [each for each in state.reflectances if each is not None]
    common = joint.start[: joint.colors].reshape(-1, 3)
    expected = side.objective(side.joined(common[: len(side.color_lower)], values))
    gram = assembler.roughness("lights")[1]
    expected += sum(0.5 * float(each @ gram @ each) for each in state.lights if each is not None)
    assert all(item.free for item in problem.reflectances)
    assert joint.objective(joint.start, 0.0) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("seed", [3, 44, 45])
def test_a_round_after_the_descent_changes_nothing(seed: int) -> None:
    """Metamers with exact cells, where alternation and L-BFGS-B still improve after two seconds."""
    problem = generated_palette(seed)
    joint, assembler = _joint(problem)
    steps = iter(range(400))
    x = joint_descent(joint, lambda: next(steps) >= 300)
    assert joint.objective(x, 1e5) < joint.objective(joint.start, 1e5)
    rounds = Rounds(assembler, SolveTrace())
    rounds.check(rounds.round(joint.with_values(x)))
    assert rounds.trace.settled


@pytest.mark.parametrize("seed", [3, 14, 29])
def test_solved_palettes_are_optimal_for_clarabel(seed: int) -> None:
    """Solving either side alone by another formulation and another solver improves it by less than a millionth."""
    solution = solve_palette(generated_palette(seed), explain=False, seconds=60.0)
    assert solution.status.trusted
    gains = side_gains(solution)
    assert gains.pop("exact") < 1e-6
    assert max(gains.values()) < 1e-6


def test_a_table_without_requests_is_solved() -> None:
    grid = SpectralGrid(np.linspace(400, 700, 31))
    light = PaletteLight(normalized(illuminant("D65")).resampled(grid), free=True)
    problem = PaletteProblem(grid, [light], [PaletteReflectance("any")], [[Cell.free()]])
    assert solve_palette(problem, seconds=0.2).status.trusted


def test_a_decrease_by_a_millionth_is_not_optimal() -> None:
    """The limit of every status: solving a side again must not gain a millionth of its sum of squares."""
    assert not is_nothing(1e-6, 1.0)
    assert not is_nothing(1e-12, 1e-6)
    assert is_nothing(5e-7, 1.0)
    assert is_nothing(1e-17, 0.0)


def test_second_check_sees_gains_at_any_objective() -> None:
    """An absolute allowance of 1e-10 hid all gains of palettes whose targets are nearly met."""
    solution = solve_palette(generated_palette(3), explain=False)
    assert solution.status == "solved"
    assert max(gain for side, gain in side_gains(solution).items() if side != "exact") < 1e-6
    # A ripple of one sample that no color shows still has roughness, which the other spectra do not need.
    free = next(i for i, each in enumerate(solution.problem.reflectances) if each.free)
    values = np.array(solution.reflectances[free].values)
    middle = int(np.argmin(np.abs(values - 0.5)))
    values[middle] += 1e-5
    moved = Spectrum(solution.reflectances[free].name, solution.problem.grid, values)
    surfaces = [moved if i == free else each for i, each in enumerate(solution.reflectances)]
    assert side_gains(replace(solution, reflectances=tuple(surfaces)))["reflectances"] > 1e-6
