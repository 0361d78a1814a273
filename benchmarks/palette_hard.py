# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes made to break solvers: nothing may be called solved that is not, and engines must agree.

2,400 generated problems (60 with ``--quick``; extra numbers set another first seed and another count). Each solution
that is called solved or a compromise is checked here again, apart from the library's own check: bounds from spectra,
optimality from the gradient of a statement of its own. Every fourth problem is also given to each engine by itself.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from time import perf_counter

import numpy as np

from benchmarks import Options
from benchmarks._palette_hard_cases import hard_problem
from benchmarks._palette_hard_check import independent_kkt
from spectral_core.palette import PaletteProblem, solve_palette
from spectral_core.palette.assemble.phase import PhaseBuilder
from spectral_core.palette.assemble.phase_solve import solve_phase
from spectral_core.palette.assemble.wishes import compiled_wishes
from spectral_core.palette.live.state import initial_state
from spectral_core.palette.qp.engines import ENGINES

LIMIT = 1e-6


def run(options: Options) -> dict:
    """Print and return the counts; every count of wrong answers must be 0."""
    first = int(options.extra[0]) if options.extra else 0
    count = int(options.extra[1]) if len(options.extra) > 1 else 60 if options.quick else 2400
    statuses: Counter[str] = Counter()
    by_trap: dict[str, Counter[str]] = defaultdict(Counter)
    wrong, worst, no_remedy, crashes = 0, 0.0, 0, 0
    differences: list[float] = []
    compared = 0
    started = perf_counter()
    for seed in range(first, first + count):
        problem, traps = hard_problem(seed)
        try:
            solution = solve_palette(problem, explain=False)
        except Exception as error:  # a crash is what is being counted
            crashes += 1
            print(f"seed {seed}: {type(error).__name__}: {error}")
            continue
        statuses[solution.status.value] += 1
        for trap in traps[1:]:
            by_trap[trap][solution.status.value] += 1
        no_remedy += bool(solution.status.value != "solved" and not solution.remedy)
        if solution.status.trusted:
            kkt = max(solution.kkt_residual, independent_kkt(solution))
            worst = max(worst, kkt)
            wrong += bool(kkt > LIMIT or solution.bound_violation > 1e-9)
        if seed % 4 == 0:
            difference = _engine_difference(problem)
            compared += difference is not None
            differences += [difference] if difference is not None else []
    return _report(statuses, by_trap, {
        "problems": count,
        "called_right_but_wrong": wrong,
        "worst_kkt_called_right": worst,
        "crashes": crashes,
        "without_remedy": no_remedy,
        "engine_comparisons": compared,
        "engine_difference_linear_rgb": float(max(differences, default=0.0)),
        "seconds": perf_counter() - started,
    })  # fmt: skip


def _engine_difference(problem: PaletteProblem) -> float | None:
    """Largest difference in linear RGB between the answers that need no second engine; None if under two do."""
    builder = PhaseBuilder(problem, compiled_wishes(problem))
    state = initial_state(problem)
    phase = builder.build("reflectances", state)
    # Only colors that the problem decides: what nobody gave a target is free, and may differ.
    pinned = {target.cell for target in builder.wishes.targets if target.weight > 0}
    wished = sorted(pinned)
    shown = []
    for name in ENGINES:
        if phase.problem.size > 250 and name in ("bvls", "daqp"):
            continue  # minutes
        if phase.problem.has_equalities and name in ("bvls", "tied"):
            continue
        answer = solve_phase(phase.problem, name)
        if answer.check.good and not answer.infeasible:
            colors = state.with_reflectances(dict(zip(phase.items, answer.blocks, strict=True))).colors()
            shown.append(np.array([colors[cell] for cell in wished]))
    if len(shown) < 2 or not wished:
        return None
    return float(np.max([np.abs(each - shown[0]).max() for each in shown[1:]]))


def _report(statuses: Counter[str], by_trap: dict[str, Counter[str]], figures: dict) -> dict:
    print(f"{figures['problems']} hard palettes in {figures['seconds']:.0f} s: {dict(statuses)}")
    names = sorted(statuses)
    print(f"{'trap':28}" + "".join(f"{name:>16}" for name in names))
    for trap in sorted(by_trap):
        print(f"{trap:28}" + "".join(f"{by_trap[trap][name]:16d}" for name in names))
    print(
        f"called right but wrong: {figures['called_right_but_wrong']} (worst KKT "
        f"{figures['worst_kkt_called_right']:.1e}); crashes: {figures['crashes']}; "
        f"not solved and without remedy: {figures['without_remedy']}"
    )
    print(
        f"engines that all claim success differ by at most {figures['engine_difference_linear_rgb']:.1e} in linear RGB "
        f"({figures['engine_comparisons']} problems)"
    )
    return {**figures, "statuses": dict(statuses), "by_trap": {trap: dict(each) for trap, each in by_trap.items()}}
