# SPDX-License-Identifier: GPL-3.0-or-later
"""The time budget of a solve, on a clock that the test advances: every solve of a side takes a stated time."""

from __future__ import annotations

from contextlib import nullcontext

import numpy as np
import pytest

from spectral_core.blas_threads import on_one_thread
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.design import rounds as rounds_module
from spectral_core.palette.design.rounds import Budget
from spectral_core.palette.paint.fluorescent_design import solve_fluorescent
from spectral_core.palette.paint.fluorescent_spectra import FluorescentSpectra
from spectral_core.palette.qp.color_newton import DENSE_LIMIT
from spectral_core.palette.qp.engine import Engine
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid


class Clock:
    """The clock of budgets."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 0.0
        monkeypatch.setattr(rounds_module, "thread_time", lambda: self.now)
        monkeypatch.setattr(rounds_module, "perf_counter", lambda: self.now)


def palette(samples: int = 16, **cell: object) -> PaletteProblem:
    """Two materials under two designed lights; colors that no few rounds meet."""
    grid = SpectralGrid(np.linspace(400, 700, samples))
    lights = tuple(
        PaletteLight(Illuminant(f"l{k}", grid, 1.2 + np.sin(grid.wavelengths_nm / (20 + 9 * k))), free=True)
        for k in range(2)
    )
    colors = np.random.default_rng(4).uniform(5, 70, (2, 2, 3))
    cells = [[Cell.fixed(colors[i, j]) for j in range(2)] for i in range(2)]
    if cell:
        cells[0][0] = Cell.fixed(colors[0, 0], **cell)  # type: ignore[arg-type]
    return PaletteProblem(grid, lights, (PaletteReflectance("a"), PaletteReflectance("b")), tuple(map(tuple, cells)))


def test_a_budget_counts_processor_time_or_three_times_that_on_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    busy, clock = [10.0], [100.0]
    monkeypatch.setattr(rounds_module, "thread_time", lambda: busy[0])
    monkeypatch.setattr(rounds_module, "perf_counter", lambda: clock[0])
    budget = Budget(2.0)
    assert (budget.left, budget.spent) == (2.0, False)
    busy[0], clock[0] = 11.5, 102.0
    assert budget.left == 0.5
    budget.reserved = 0.25
    assert budget.left == 0.25
    clock[0] = 105.2  # three times 1.75 s is over in 0.05 s
    assert budget.left == pytest.approx(0.05)
    budget.reserved = 0.0
    assert budget.left == 0.5
    clock[0] = 106.0
    assert budget.spent and budget.left == 0.0


@pytest.mark.parametrize("seconds", [1.0, 2.0, 10.0])
@pytest.mark.parametrize("each", [0.02, 0.1, 0.3])
def test_a_solve_ends_within_its_budget_and_one_round(
    monkeypatch: pytest.MonkeyPatch, seconds: float, each: float
) -> None:
    """However long one solve of a side takes: only the first rounds, of two solves each, may exceed the budget."""
    clock = Clock(monkeypatch)
    solve = Engine.solve

    def slow(self: Engine, *arguments: object) -> object:
        clock.now += each
        return solve(self, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(Engine, "solve", slow)
    monkeypatch.setattr("spectral_core.palette.design.together.LARGEST", 0)  # by variable projection
    monkeypatch.setattr("spectral_core.palette.design.lights.PlainPalette.of", lambda *_, **__: None)
    solution = solve_palette(palette(), seconds=seconds, explain=False)
    assert clock.now <= max(seconds, 2 * each) + 2 * each + 1e-9
    assert clock.now > 0.5 * seconds or solution.status != "still_improving"


def test_a_descent_makes_no_evaluation_that_does_not_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch)
    half = FluorescentSpectra.half_round
    taken = []

    def slow(self: FluorescentSpectra, side: str, **options: bool) -> object:
        clock.now += 0.125
        taken.append(clock.now)
        return half(self, side, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(FluorescentSpectra, "half_round", slow)
    dye = FluorescentDye.gaussian("green", 420, 530)
    unit = 1 / 60
    problem = palette(22)
    dim = tuple(tuple(Cell.fixed(np.asarray(cell.target) * unit * 0.5) for cell in row) for row in problem.cells)
    solution = solve_fluorescent(PaletteProblem(problem.grid, problem.lights, problem.reflectances, dim), {0: [dye]})
    assert taken[-1] <= 2.0
    assert solution.settled or taken[-1] > 1.5


def test_dyes_are_designed_with_one_thread_of_blas(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two threads made small products half as fast again, so that the time ended before the design did."""
    from threadpoolctl import threadpool_info

    seen = []

    def checked(self: FluorescentSpectra, side: str, **_options: bool) -> tuple[float, float]:
        seen.extend(each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas")
        return 0.0, 1.0

    monkeypatch.setattr(FluorescentSpectra, "half_round", checked)
    solve_fluorescent(palette(), {}, seconds=0.05)
    assert seen and set(seen) == {1}


@pytest.mark.parametrize("fails", [False, True])
def test_the_number_of_threads_is_restored(fails: bool) -> None:
    """Other libraries of the same process keep the threads that they had, after an error too."""
    from threadpoolctl import threadpool_info, threadpool_limits

    def threads() -> dict[str, int]:
        return {each["filepath"]: each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}

    seen: list[dict[str, int]] = []

    @on_one_thread
    def solved() -> None:
        seen.append(threads())
        if fails:
            raise ZeroDivisionError

    with threadpool_limits(2, user_api="blas"):
        before = threads()
        assert 2 in before.values()  # a solver's own library may have been built for one thread
        with pytest.raises(ZeroDivisionError) if fails else nullcontext():
            solved()
        assert set(seen[0].values()) == {1}
        assert threads() == before


@pytest.mark.parametrize("cell", [{}, {"exact": True}], ids=["soft", "exact"])
def test_large_spectra_take_few_steps_from_any_start(cell: dict[str, bool], monkeypatch: pytest.MonkeyPatch) -> None:
    """Walks of thousands of steps through 401 samples took 3 s for one side; piqp solves it cold in a tenth of that."""
    steps = []
    walk = Engine._warm

    def counted(self: Engine, *arguments: object) -> object:
        found = walk(self, *arguments)  # type: ignore[arg-type]
        steps.append(self._active.steps if self._active is not None else 0)
        return found

    monkeypatch.setattr(Engine, "_warm", counted)
    solution = solve_palette(palette(DENSE_LIMIT, **cell), seconds=0.3, explain=False)
    assert solution.status != "inaccurate"
    assert max(steps) <= 300
