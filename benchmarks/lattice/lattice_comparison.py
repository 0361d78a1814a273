# SPDX-License-Identifier: GPL-3.0-or-later
"""Lattices against Sobol, Halton, Latin hypercubes, Poisson disk, rank-1, R-sequence, grids: evenness and time.

Prints the tables of docs/lattice.md, the errors of integration among them. Means over seeds; see
``spectral_core.lattice.measure.measures`` for the measures.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.lattice.cases.designs import DESIGNS, PROGRESSIVE, Points
from benchmarks.lattice.cases.genz import DIFFICULTY, integrand
from spectral_core.lattice import evenness, prefix_separations

MEASURES = ("separation", "fill_distance", "mean_square", "discrepancy", "gap_1d", "fill_2d")
SOBOL = "Sobol, scrambled"
INTEGRATION_DESIGNS = ("random", "Latin hypercube", SOBOL, "ours, rate 2, packing", "ours, rate 2, packing, latinized")
CASES = ((2, 256), (3, 256), (3, 1024), (6, 256), (6, 1024), (10, 64), (10, 256), (10, 1024))


def run(options: Options) -> dict[str, Any]:
    """Both tables: every design at fixed sizes, and the worst prefix of those that can stop anywhere."""
    cases = ((2, 64), (6, 64)) if options.quick else CASES
    seeds = 1 if options.quick else 2
    figures = {f"{n},{m}": _table(n, m, seeds) for n, m in cases}
    sizes = ((3, 256),) if options.quick else ((3, 1024), (6, 1024), (6, 4096), (10, 1024))
    figures["prefixes"] = {f"{n},{m}": _prefixes(n, m) for n, m in sizes}
    dimensions = (3,) if options.quick else (3, 6, 10)
    figures["integration"] = {str(n): _integration(n, *((256, 4) if options.quick else (1024, 12))) for n in dimensions}
    return figures | {"holds": holds(figures, [f"{n},{m}" for n, m in cases])}


def holds(figures: dict[str, Any], cases: list[str]) -> dict[str, bool]:
    """Claims of docs/lattice.md, where ours loses among them."""
    ours = "ours, rate 2, packing"
    return {
        "ours separates points farther than Sobol at every size": all(
            figures[case][ours]["separation"] > figures[case][SOBOL]["separation"] for case in cases
        ),
        "latinized points have no gap on an axis": all(
            figures[case][f"{ours}, latinized"]["gap_1d"] < 1.05 for case in cases
        ),
        "every prefix of ours separates points farther than any other design's": all(
            rows[ours]["least"] > max(row["least"] for name, row in rows.items() if not name.startswith("ours"))
            for rows in figures["prefixes"].values()
        ),
        "Sobol integrates better": all(min(rows[ours].values()) > 1 for rows in figures["integration"].values()),
    }


def _integration(n: int, m: int, seeds: int) -> dict[str, dict[str, float]]:
    """Root mean square error of the mean over a design, relative to that of scrambled Sobol points, by Genz family."""
    print(f"\n### Integration, n = {n}, m = {m}: error relative to scrambled Sobol points\n")
    print("| design | " + " | ".join(DIFFICULTY) + " |\n|---" + "|---" * len(DIFFICULTY) + "|")
    sets = {name: [points for seed in range(seeds) if (points := DESIGNS[name](n, m, seed)) is not None]
            for name in INTEGRATION_DESIGNS}  # fmt: skip
    errors: dict[str, dict[str, float]] = {name: {} for name in INTEGRATION_DESIGNS}
    for family in DIFFICULTY:
        rng = np.random.default_rng(20 + n)
        tests = [integrand(family, n, rng) for _ in range(6)]
        for name, designs in sets.items():
            relative = [[float(t.evaluate(x).mean()) / t.integral - 1 for x in designs] for t in tests]
            errors[name][family] = float(np.sqrt(np.square(relative).mean()))
    rows = {name: {family: row[family] / errors[SOBOL][family] for family in row} for name, row in errors.items()}
    for name, row in rows.items():
        print(f"| {name} | " + " | ".join(f"{value:.2g}" for value in row.values()) + " |", flush=True)
    return rows


def _table(n: int, m: int, seeds: int) -> dict[str, dict[str, float]]:
    print(f"\n### n = {n}, m = {m}\n")
    print("| design | separation | fill distance | mean square | discrepancy | 1D gap | 2D fill | seconds |")
    print("|---|---|---|---|---|---|---|---|")
    rows: dict[str, dict[str, float]] = {}
    for name, design in DESIGNS.items():
        row = table_row(name, design, n, m, seeds=seeds)
        if row is not None:
            print(row[0], flush=True)
            rows[name] = row[1]
    return rows


def table_row(
    name: str, design: Callable[[int, int, int], Points], n: int, m: int, *, seeds: int
) -> tuple[str, dict[str, float]] | None:
    """One design's row as printed, and its figures; None if the design cannot have that size."""
    row = _averaged(design, n, m, seeds)
    if row is None:
        return None
    values = [row["separation"], row["fill_distance"], row["mean_square"], row["discrepancy"]]
    cells = [f"{value:.4f}" if value < 0.2 else f"{value:.3f}" for value in values]
    cells += [f"{row['gap_1d']:.1f}", f"{row['fill_2d']:.2f}", f"{row['seconds']:.3f}"]
    return f"| {name} | " + " | ".join(cells) + " |", row


def _averaged(design: Callable[[int, int, int], Points], n: int, m: int, seeds: int) -> dict[str, float] | None:
    rows = []
    for seed in range(seeds):
        start = time.process_time()
        points = design(n, m, seed)
        seconds = time.process_time() - start
        if points is None:
            return None
        measured = evenness(points, samples=16384, seed=99)
        rows.append({name: getattr(measured, name) for name in MEASURES} | {"seconds": seconds, "points": len(points)})
    return {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}


def _prefixes(n: int, m: int) -> dict[str, dict[str, float]]:
    """Least separation over all prefixes of 2 to m points, and over those of 16 to m."""
    print(f"\n### Every prefix, n = {n}, m = {m}\n\n| design | least separation | from 16 points on |\n|---|---|---|")
    rows = {}
    for name in PROGRESSIVE:
        points = DESIGNS[name](n, m, 0)
        separations = prefix_separations(points)
        rows[name] = {"least": float(separations.min()), "from_16": float(separations[14:].min())}
        print(f"| {name} | {rows[name]['least']:.3f} | {rows[name]['from_16']:.3f} |", flush=True)
    return rows
