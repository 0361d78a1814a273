# SPDX-License-Identifier: GPL-3.0-or-later
"""Time of a solve after one edit of a live palette, relative to the same problem in cvxpy.

Coupled palettes: all reflectances metameric under D65 with a free common color, random colors under the other lights.
Edits drag colors, drag the weights of cells from 1 to 1000 and back, make cells exact and soft again, and conflict now
and then. Two statements in cvxpy are timed: cell by cell from the spectra, as one would write it, and one large matrix
that is handed to it ready-made (its best case). Then colors are dragged in random palettes of exact and coupled cells,
most of which cannot hold, and one jumps anywhere in a pair of exact metamers. Last, conflicts are explained, also in
palettes of other requests.
Processor times are of this process with BLAS on one thread; ``holds`` judges those.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator
from dataclasses import replace
from time import perf_counter, process_time, thread_time

import numpy as np

from benchmarks import Options
from benchmarks.palette.cases.exact_cells import dragged, jumped
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.conflicts import with_conflicts
from spectral_core.palette.live.session import LivePalette, PaletteSession
from spectral_core.palette.presets import sine_light
from spectral_core.palette.qp.general import cvxpy_module, reflectances_by_cvxpy
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import SpectralGrid

Size = tuple[int, int, int]
SIZES: tuple[Size, ...] = ((5, 3, 31), (15, 15, 31), (15, 15, 61), (15, 15, 100), (20, 20, 100))
LIMITS_MS: dict[Size, tuple[float, float]] = {
    (5, 3, 31): (1.0, 10.0),
    (15, 15, 31): (1.0, 10.0),
    (20, 20, 100): (np.inf, 25.0),
}
"""Median and 99th percentile of processor time that mixed edits may take."""
WEIGHT_LIMITS_MS: dict[Size, float] = {(15, 15, 61): 50.0}
"""99th percentile for drags of a weight to 1000."""
EXPLAIN_LIMIT_MS = 5.0
SLOWEST = 10.0
"""Times the median edit that any edit may take."""


def coupled_palette(size: Size, rng: np.random.Generator) -> PaletteProblem:
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
    holds: dict[str, bool] = {}
    for size in SIZES[:2] if options.quick else SIZES:
        name = "x".join(map(str, size))
        edits = 40 if options.quick else 400
        figures[name] = _one_size(size, edits=edits, stated=1 if options.quick else 4)
        _print(name, figures[name])
        median, p99 = (figures[name]["mixed"][key] for key in ("median", "p99"))
        if size in LIMITS_MS:
            holds[f"{name}: edits within {LIMITS_MS[size]} ms (median, p99)"] = bool(
                median < LIMITS_MS[size][0] and p99 < LIMITS_MS[size][1]
            )
        if size in WEIGHT_LIMITS_MS:
            holds[f"{name}: weight drags, p99 under {WEIGHT_LIMITS_MS[size]:g} ms"] = bool(
                figures[name]["weights"]["p99"] < WEIGHT_LIMITS_MS[size]
            )
    exact = figures["exact"] = dragged(5, 8, 6) if options.quick else dragged(5, 60, 16)
    print(
        f"random palettes with exact cells: a drag takes {exact['median']:.2f} ms of processor time, p95 "
        f"{exact['p95']:.1f}, p99 {exact['p99']:.1f}, largest {exact['largest']:.1f}; {exact['statuses']}"
    )
    jump = figures["jumps"] = jumped(5, 20 if options.quick else 400)
    print(
        f"metamer pair: a color that jumps anywhere takes {jump['median']:.2f} ms of processor time, p99 "
        f"{jump['p99']:.1f}, largest {jump['largest']:.1f}"
    )
    figures["explain"] = {name: _explained(problem, 40 if options.quick else 200) for name, problem in _conflicting()}
    for name, each in figures["explain"].items():
        print(f"{name:>15}: conflicts explained in {each['median']:.2f} ms of processor time, p99 {each['p99']:.2f}")
    slowest = max(each["p99"] for each in figures["explain"].values())
    holds[f"a conflict explained in under {EXPLAIN_LIMIT_MS:g} ms (p99)"] = slowest < EXPLAIN_LIMIT_MS
    return {**figures, "holds": holds}


def _one_size(size: Size, *, edits: int, stated: int) -> dict:
    figures: dict = {}
    for kind in ("drags", "weights", "mixed"):
        rng = np.random.default_rng(7)
        session = PaletteSession(coupled_palette(size, rng))
        busy, clock, worst, untrusted = [], [], 0.0, 0
        for number in range(edits):
            index, cell = next_edit(session, kind, number, rng)
            started, started_busy = perf_counter(), process_time()
            answer = session.edit(index, cell)
            clock.append(perf_counter() - started)
            busy.append(process_time() - started_busy)
            untrusted += not answer.trusted and not _conflicts(session)
            worst = max(worst, answer.kkt_residual)
        milliseconds = 1e3 * np.array(busy)
        figures[kind] = {
            "median": float(np.median(milliseconds)),
            "p99": float(np.percentile(milliseconds, 99)),
            "largest": float(milliseconds.max()),
            "clock_median": 1e3 * float(np.median(clock)),
            "kkt_worst": worst,
            "untrusted": untrusted,
        }
        if kind == "drags":
            figures |= _against_cvxpy(session, answer, stated, figures[kind]["clock_median"])
    return figures


def next_edit(
    session: PaletteSession, kind: str, number: int, rng: np.random.Generator
) -> tuple[tuple[int, int], Cell]:
    """Drags of a color; of a weight from 1 to 1000 and back; or both, and now and then an exact cell."""
    rows, columns = len(session.problem.reflectances), len(session.problem.lights)
    cell = (int(rng.integers(rows)), int(rng.integers(1, columns)))
    if kind == "weights" or (kind == "mixed" and number % 4 == 1):
        # One slider at a time: six steps up, six down.
        cell = ((number // 12) % rows, 1 + (number // 12) % (columns - 1))
        step = number % 12
        weight = float(10 ** (3 * min(step, 11 - step) / 5))
        return cell, Cell.fixed(session.problem.cells[cell[0]][cell[1]].target, weight=weight)
    old = session.problem.cells[cell[0]][cell[1]]
    color = np.clip(old.target + rng.normal(scale=0.05, size=3), 0, 1)
    exact = kind == "mixed" and number % 8 == 0
    return cell, Cell.fixed(color, weight=old.weight, exact=exact)


def _conflicts(session: PaletteSession) -> bool:
    return session.solution().status == "exact_conflict"


def _against_cvxpy(session: PaletteSession, answer: LivePalette, stated: int, live_ms: float) -> dict:
    """Times of cvxpy at its default tolerances, and how its answer compares."""
    by_cells, by_matrix, difference, excess = [], [], 0.0, 0.0
    quadratic = Assembler(session.problem, compiled_requests(session.problem)).assembled("reflectances", session.state)
    for _ in range(stated):
        started = perf_counter()
        spectra = reflectances_by_cvxpy(session.problem)
        by_cells.append(perf_counter() - started)
        by_matrix.append(_seconds_by_matrix(session))
    theirs = np.clip(spectra, 0, 1)
    shown = session.state.with_values("reflectances", dict(enumerate(theirs))).colors()
    difference = float(np.abs(shown - answer.actual_linear_rgb).max())
    costs = []
    for values in (list(theirs), [each for each in session.state.reflectances if each is not None]):
        costs.append(
            quadratic.quadratic.objective(quadratic.quadratic.joined(quadratic.quadratic.best_colors(values), values))
        )
    excess = costs[0] / costs[1] - 1
    return {
        "cvxpy_cells_ms": 1e3 * float(np.median(by_cells)),
        "cvxpy_matrix_ms": 1e3 * float(np.median(by_matrix)),
        "times_faster_than_cells": 1e3 * float(np.median(by_cells)) / live_ms,
        "times_faster_than_matrix": 1e3 * float(np.median(by_matrix)) / live_ms,
        "color_difference_to_cvxpy": difference,
        "cvxpy_sum_of_squares_above_ours": float(excess),
    }


def _seconds_by_matrix(session: PaletteSession) -> float:
    """cvxpy given the assembled matrix, which costs it nothing here; CLARABEL, its own choice for this problem."""
    cp = cvxpy_module()
    problem = session.problem
    side = Assembler(problem, compiled_requests(problem)).assembled("reflectances", session.state).quadratic
    matrix, target = side.least_squares()
    started = perf_counter()
    unknown = cp.Variable(side.size)
    bounds = [unknown >= side.lower, unknown <= side.upper]
    cp.Problem(cp.Minimize(cp.sum_squares(matrix @ unknown - target)), bounds).solve(solver="CLARABEL")
    return perf_counter() - started


def _conflicting() -> Iterator[tuple[str, PaletteProblem]]:
    """Palettes whose cells conflict: metamers of three sizes, and three of 15×15×31 with other requests."""
    for size in ((9, 9, 31), (15, 15, 31), (15, 15, 61)):
        yield "x".join(map(str, size)), coupled_palette(size, np.random.default_rng(3))
    problem = coupled_palette((15, 15, 31), np.random.default_rng(3))
    odd = range(3, 15, 4)
    links = {(i, j): Cell.same_as((i - 1, j), weight=2.0) for i in odd for j in odd}
    yield "Same As", problem.with_cells(links)
    colors = np.random.default_rng(5).uniform(0.1, 0.9, (15, 3))
    yield "exact cells", problem.with_cells({(i, 2): Cell.fixed(colors[i], exact=True) for i in range(15)})
    lights = tuple(replace(light, free=number in (4, 9)) for number, light in enumerate(problem.lights))
    yield "designed lights", replace(problem, lights=lights, rounds=3)


def _explained(problem: PaletteProblem, times: int) -> dict[str, float]:
    """Milliseconds of this thread that the explanation of a palette's conflicts takes."""
    solution = solve_palette(problem, explain=False)
    taken = []
    for _ in range(times):
        started = thread_time()
        explained = with_conflicts(solution)
        taken.append(1e3 * (thread_time() - started))
    assert explained.conflicts
    return {"median": float(np.median(taken)), "p99": float(np.percentile(taken, 99))}


def _print(name: str, figures: dict) -> None:
    for kind in ("drags", "weights", "mixed"):
        each = figures[kind]
        print(
            f"{name:>9} {kind:8} processor time {each['median']:6.2f} ms, p99 {each['p99']:6.2f}, "
            f"largest {each['largest']:6.2f}; KKT {each['kkt_worst']:.0e}, untrusted {each['untrusted']}"
        )
    print(
        f"          cvxpy by cells {figures['cvxpy_cells_ms']:7.1f} ms ({figures['times_faster_than_cells']:5.0f}×), "
        f"by matrix {figures['cvxpy_matrix_ms']:6.1f} ms ({figures['times_faster_than_matrix']:4.0f}×); colors agree "
        f"to {figures['color_difference_to_cvxpy']:.1e}, its sum of squares is above ours by "
        f"{figures['cvxpy_sum_of_squares_above_ours']:.0e}"
    )
