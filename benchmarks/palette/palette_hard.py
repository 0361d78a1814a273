# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes that are difficult for solvers: no wrong answer may be called solved.

2,400 generated problems (60 with ``--quick``; extra numbers set another first seed and another count). Every solution
that is called solved or a compromise is checked by a statement of its own (``checks/optimality.py``): bounds, exact
cells, and whether solving either side again by Clarabel lowers the objective. ``--odd``: palettes with one oddity
each, of sixteen (``cases/odd.py``). ``--limits``: ill-conditioned exact cells (``cases/exact_limits.py``), which a
linear program decides (``checks/linear_program.py``).
"""

from __future__ import annotations

from collections import Counter, defaultdict
from time import perf_counter

from benchmarks import Options
from benchmarks.palette.cases.exact_limits import limiting_problem
from benchmarks.palette.cases.hard import hard_problem
from benchmarks.palette.cases.odd import odd_problem
from benchmarks.palette.checks.linear_program import exact_miss, least_miss
from benchmarks.palette.checks.optimality import EXACT_LIMIT, side_gains
from spectral_core.palette import solve_palette

OPTIONS = ("--odd", "--limits")
WORDS = "FIRST_SEED PALETTES"
LIMIT = 1e-6
"""Of the scaled KKT residual, and of the relative gain of solving a side again."""
HOLD, CANNOT = 1e-10, 1e-7
"""Least possible miss of the worst exact cell, in linear RGB, below which cells hold, and above which they cannot."""


def run(options: Options) -> dict:
    """Print and return the counts; every count of wrong answers must be 0."""
    numbers = options.counts("first seed", "palettes")
    first = numbers[0] if numbers else 0
    count = numbers[1] if len(numbers) > 1 else 60 if options.quick else 2400
    if "--limits" in options.extra:
        return _limits(range(first, first + (numbers[1] if len(numbers) > 1 else 60 if options.quick else 500)))
    stated = odd_problem if "--odd" in options.extra else hard_problem
    statuses: Counter[str] = Counter()
    by_trap: dict[str, Counter[str]] = defaultdict(Counter)
    wrong, worst, worst_gain, no_remedy, crashes, checked, sides = 0, 0.0, 0.0, 0, 0, 0, 0
    started = perf_counter()
    for seed in range(first, first + count):
        problem, traps = stated(seed)
        try:
            solution = solve_palette(problem, explain=False)
        except Exception as error:  # crashes are counted
            crashes += 1
            print(f"seed {seed}: {type(error).__name__}: {error}")
            continue
        statuses[solution.status.value] += 1
        for trap in traps[1:]:
            by_trap[trap][solution.status.value] += 1
        no_remedy += bool(solution.status.value != "solved" and not solution.remedy)
        if solution.status.trusted:
            gains = side_gains(solution)
            exact = gains.pop("exact")
            gain = max(gains.values(), default=0.0)
            checked += 1
            sides += len(gains)
            worst, worst_gain = max(worst, solution.kkt_residual), max(worst_gain, gain)
            bad = gain > LIMIT or exact > EXACT_LIMIT or solution.kkt_residual > LIMIT
            if bad or solution.bound_violation > 1e-9:
                wrong += 1
                print(f"seed {seed} called {solution.status}: gains {gains}, exact cells off by {exact:.1e}, {traps}")
    return _report(statuses, by_trap, {
        "problems": count,
        "called_right_but_wrong": wrong,
        "checked": checked,
        "sides_solved_again": sides,
        "worst_kkt_called_right": worst,
        "worst_gain_of_a_side": worst_gain,
        "crashes": crashes,
        "without_remedy": no_remedy,
        "seconds": perf_counter() - started,
    })  # fmt: skip


def _report(statuses: Counter[str], by_trap: dict[str, Counter[str]], figures: dict) -> dict:
    print(f"{figures['problems']} hard palettes in {figures['seconds']:.0f} s: {dict(statuses)}")
    names = sorted(statuses)
    print(f"{'trap':28}" + "".join(f"{name:>16}" for name in names))
    for trap in sorted(by_trap):
        print(f"{trap:28}" + "".join(f"{by_trap[trap][name]:16d}" for name in names))
    print(
        f"called right: {figures['checked']}, {figures['sides_solved_again']} sides solved again; wrong: "
        f"{figures['called_right_but_wrong']} (worst KKT {figures['worst_kkt_called_right']:.1e}, largest gain of a "
        f"side {figures['worst_gain_of_a_side']:.1e}); crashes: {figures['crashes']}; not solved and without remedy: "
        f"{figures['without_remedy']}"
    )
    holds = {
        "none called right is wrong, by a second statement": figures["called_right_but_wrong"] == 0,
        "nothing crashes, and all that is not solved has a remedy": figures["crashes"] + figures["without_remedy"] == 0,
    }
    traps = {trap: dict(each) for trap, each in by_trap.items()}
    return {**figures, "statuses": dict(statuses), "by_trap": traps, "holds": holds}


def _limits(seeds: range) -> dict:
    """Statuses of palettes whose exact cells a linear program decides.

    Those that hold in black alone are reported as a conflict, with that message.
    """
    statuses: Counter[str] = Counter()
    refused, accepted, undecided, worst, started = [], [], 0, 0.0, perf_counter()
    for seed in seeds:
        problem, traps = limiting_problem(seed)
        solution = solve_palette(problem, explain=False)
        least = least_miss(problem)
        undecided += not (least < HOLD or least > CANNOT)  # a program without an answer has NaN
        statuses[solution.status.value] += 1
        if solution.status.trusted:
            worst = max(worst, exact_miss(problem, solution))
        if least < HOLD and not solution.status.trusted and "only in black" not in solution.remedy:
            refused.append(seed)
            print(f"seed {seed} holds, and is called {solution.status}: {traps}")
        elif least > CANNOT and solution.status.trusted:
            accepted.append(seed)
            print(f"seed {seed} misses by {least:.1e}, and is called {solution.status}: {traps}")
    print(
        f"{len(seeds)} palettes in {perf_counter() - started:.0f} s: {dict(statuses)}; {len(refused)} of those that "
        f"hold refused, {len(accepted)} of those that cannot accepted; {undecided} undecided; exact cells off by "
        f"{worst:.1e} at most"
    )
    return {
        "problems": len(seeds),
        "statuses": dict(statuses),
        "held_but_refused": len(refused),
        "impossible_but_accepted": len(accepted),
        "undecided": undecided,
        "worst_exact_miss": worst,
        "holds": {
            "the linear program decides nine of ten palettes": undecided <= 0.1 * len(seeds),
            f"exact cells of trusted answers are met within {CANNOT:g}": worst <= CANNOT,
            "none that cannot hold is accepted, by a linear program": not accepted,
            "all but one in a hundred of those that hold are solved": len(refused) <= 0.01 * len(seeds),
        },
    }
