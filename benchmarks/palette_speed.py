# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole re-solve after one edit of a live palette, against the same problem stated afresh in cvxpy.

Coupled palettes: all reflectances metameric under D65 with a free common color, random colors under the other lights.
Each edit changes one cell: its color, its weight, or both. Edits and cvxpy solves are interleaved, so that a busy
machine slows both. Two statements in cvxpy are timed: cell by cell from the spectra, as one would write it, and one
large matrix that is handed to it ready-made (its best case).
"""

from __future__ import annotations

import os
import platform
from time import perf_counter, process_time

import numpy as np

from benchmarks import Options
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.palette.assemble.compiled import WishArrays
from spectral_core.palette.assemble.criteria import second_differences
from spectral_core.palette.assemble.phase import PhaseBuilder
from spectral_core.palette.assemble.wishes import compiled_wishes
from spectral_core.palette.live.session import PaletteSession
from spectral_core.palette.live.state import PaletteState
from spectral_core.palette.presets import sine_light
from spectral_core.palette.qp.general import cvxpy_module, reflectances_by_cvxpy
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import SpectralGrid

SIZES = ((5, 3, 31), (15, 15, 31), (15, 15, 100))
BUDGET_MS = {(5, 3, 31): 2.0, (15, 15, 31): 16.0, (15, 15, 100): 50.0}


def coupled_palette(size: tuple[int, int, int], rng: np.random.Generator) -> PaletteProblem:
    """(reflectances, lights, samples); metamers under D65, other lights given."""
    rows, columns, samples = size
    grid = SpectralGrid(np.linspace(400.0, 700.0, samples))
    lights = [normalized(illuminant("D65"), luminance=6.0)]
    lights += [sine_light(62.0 + 90.0 * j / max(columns - 2, 1), grid, luminance=6.0) for j in range(columns - 1)]
    colors = rng.uniform(0.1, 0.9, (rows, columns, 3))
    cells = []
    for i in range(rows):
        first = Cell.same_as((0, 0), weight=4.0) if i else Cell.free(([0.0] * 3, [1.0] * 3), weight=4.0)
        cells.append([first, *(Cell.fixed(colors[i, j]) for j in range(1, columns))])
    materials = tuple(PaletteReflectance(f"R{i}") for i in range(rows))
    return PaletteProblem(grid, tuple(map(PaletteLight, lights)), materials, tuple(map(tuple, cells)))


def run(options: Options) -> dict:
    """Print and return milliseconds, ratios and differences."""
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}")
    figures: dict = {"processors": os.cpu_count(), "load": os.getloadavg()[0]}
    for size in SIZES:
        name = "x".join(map(str, size))
        figures[name] = _one_size(size, edits=20 if options.quick else 400, stated=1 if options.quick else 6)
        _print(name, figures[name], BUDGET_MS[size])
    return figures


def _one_size(size: tuple[int, int, int], *, edits: int, stated: int) -> dict:
    rng = np.random.default_rng(7)
    session = PaletteSession(coupled_palette(size, rng))
    live, busy, by_cells, by_matrix, differences, excess, worst = [], [], [], [], [], [], 0.0
    compare_at = set(np.linspace(0, edits - 1, stated).astype(int).tolist())
    for number in range(edits):
        cell = (int(rng.integers(size[0])), int(rng.integers(1, size[1])))
        old = session.problem.cells[cell[0]][cell[1]]
        color = np.clip(old.target + rng.normal(scale=0.05, size=3), 0, 1)
        weight = float(rng.choice([0.5, 1.0, 2.0])) if number % 2 else old.weight
        wish = Cell.fixed(color, weight=weight)
        started, started_busy = perf_counter(), process_time()
        answer = session.edit(cell, wish)
        live.append(perf_counter() - started)
        busy.append(process_time() - started_busy)
        if not answer.trusted:
            raise AssertionError(f"edit {number} failed its check: {answer.kkt_residual}")
        worst = max(worst, answer.kkt_residual)
        if number in compare_at:
            started = perf_counter()
            spectra = reflectances_by_cvxpy(session.problem)
            by_cells.append(perf_counter() - started)
            by_matrix.append(_seconds_by_matrix(session))
            theirs = session.state.with_reflectances(dict(enumerate(np.clip(spectra, 0, 1))))
            differences.append(float(np.abs(theirs.colors() - answer.actual_linear_rgb).max()))
            excess.append(_cost(session.problem, theirs) / _cost(session.problem, session.state) - 1)
    return {
        "edit_ms": {"median": 1e3 * float(np.median(live)), "p99": 1e3 * float(np.percentile(live, 99))},
        "edit_processor_ms": {"median": 1e3 * float(np.median(busy)), "p99": 1e3 * float(np.percentile(busy, 99))},
        "cvxpy_cells_ms": 1e3 * float(np.median(by_cells)),
        "cvxpy_matrix_ms": 1e3 * float(np.median(by_matrix)),
        "times_faster_than_cells": float(np.median(by_cells) / np.median(live)),
        "times_faster_than_matrix": float(np.median(by_matrix) / np.median(live)),
        "kkt_worst": worst,
        "color_difference_to_cvxpy": float(np.max(differences)),
        "cvxpy_sum_of_squares_above_ours": float(np.max(excess)),
    }


def _cost(problem: PaletteProblem, state: PaletteState) -> float:
    """The sum of squares that is minimized, for the spectra of a state and the best common colors."""
    wishes = compiled_wishes(problem)
    colors = state.colors()
    common = np.array(
        [np.clip(np.mean([colors[at] for at in group.members], axis=0), *group.box) for group in wishes.groups]
    )
    rough = wishes.smoothness * second_differences(problem.grid, problem.smoothness_operator)
    smooth = sum(float(np.sum((rough @ values) ** 2)) for values in state.reflectances if values is not None)
    return WishArrays.of(problem, wishes).sum_of_squares(colors, common) + smooth


def _seconds_by_matrix(session: PaletteSession) -> float:
    """cvxpy given the assembled matrix, which costs it nothing here; CLARABEL, its own choice for this problem."""
    cp = cvxpy_module()
    problem = session.problem
    phase = PhaseBuilder(problem, compiled_wishes(problem)).build("reflectances", session.state).problem
    matrix, target = phase.rows
    started = perf_counter()
    unknown = cp.Variable(phase.size)
    bounds = [unknown >= phase.lower, unknown <= phase.upper]
    cp.Problem(cp.Minimize(cp.sum_squares(matrix @ unknown - target)), bounds).solve(solver="CLARABEL")
    return perf_counter() - started


def _print(name: str, figures: dict, budget: float) -> None:
    edit = figures["edit_ms"]
    print(
        f"{name:>9}: edit {edit['median']:6.2f} ms, p99 {edit['p99']:6.2f} (budget {budget:g}), "
        f"p99 of processor time {figures['edit_processor_ms']['p99']:.2f}; "
        f"cvxpy by cells {figures['cvxpy_cells_ms']:7.1f} ms ({figures['times_faster_than_cells']:5.0f}×), "
        f"by matrix {figures['cvxpy_matrix_ms']:6.1f} ms ({figures['times_faster_than_matrix']:4.0f}×); "
        f"colors agree to {figures['color_difference_to_cvxpy']:.1e}, cvxpy's sum of squares is above ours by "
        f"{figures['cvxpy_sum_of_squares_above_ours']:.0e}, KKT {figures['kkt_worst']:.0e}"
    )
