# SPDX-License-Identifier: GPL-3.0-or-later
"""Sensitivity, regions of similar outcome and proposals against known answers: Ishigami, two phases, three optima."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from benchmarks import Options
from spectral_core.explore.analysis.embedding import cluster, spectral_embedding
from spectral_core.explore.analysis.process import propose
from spectral_core.explore.analysis.sensitivity import sobol_indices
from spectral_core.lattice import progressive_fill, unit_cube

Array = NDArray[np.float64]
FIRST = (0.3139, 0.4424, 0.0, 0.0, 0.0, 0.0)
"""Ishigami and Homma 1990, a = 7, b = 0.1, and three dummies."""
TOTAL = (0.5576, 0.4424, 0.2437, 0.0, 0.0, 0.0)
STARTED = 10
"""Points before the first proposal."""
FRACTION = 0.002
"""The optimum counts as found when a value is this near to it, as a share of the range of values."""


def run(options: Options) -> dict[str, Any]:
    """Three types of known answers."""
    figures: dict[str, Any] = {"sensitivity": _ishigami(256 if options.quick else 512)}
    figures["phases"] = _phases(150 if options.quick else 400)
    repeats, limit = (3, 40) if options.quick else (20, 120)
    figures["proposals"] = {name: _race(function, repeats, limit) for name, function in OPTIMA.items()}
    for name, value in figures["proposals"].items():
        print(f"{name}: {value}")
    error = figures["sensitivity"]["largest_error"]
    figures["holds"] = {
        "Ishigami with dummies: indices within 0.05": error <= 0.05,
        "two phases: adjusted Rand index over 0.95": figures["phases"]["adjusted_rand"] > 0.95,
        "proposals need fewer renders than Sobol": all(
            one["proposals"] < one["sobol"] for one in figures["proposals"].values()
        ),
    }
    return figures


def _ishigami(count: int) -> dict[str, Any]:
    points = progressive_fill(unit_cube(6), count, seed=3).points
    angle = np.pi * (2 * points - 1)
    values = np.sin(angle[:, 0]) + 7 * np.sin(angle[:, 1]) ** 2 + 0.1 * angle[:, 2] ** 4 * np.sin(angle[:, 0])
    found = {one.name: one for one in sobol_indices(points, values, [f"x{k}" for k in range(6)])}
    errors = [abs(found[f"x{k}"].first - FIRST[k]) for k in range(6)]
    errors += [abs(found[f"x{k}"].total - TOTAL[k]) for k in range(6)]
    inside = [one.first_interval[0] <= FIRST[k] <= one.first_interval[1] for k, one in
              ((k, found[f"x{k}"]) for k in range(6))]  # fmt: skip
    print(
        f"Ishigami, {count} points in 6 dimensions: largest error {max(errors):.4f}; {sum(inside)} of 6 in the interval"
    )
    return {
        "points": count, "largest_error": max(errors), "first_in_interval": sum(inside),
        "first": [found[f"x{k}"].first for k in range(6)], "total": [found[f"x{k}"].total for k in range(6)],
    }  # fmt: skip


def _phases(count: int) -> dict[str, Any]:
    """Profiles of a pattern that is still below a curved threshold of two parameters and oscillates above it."""
    rng = np.random.default_rng(5)
    points = progressive_fill(unit_cube(2), count, seed=1).points
    above = points[:, 1] > 0.35 + 0.3 * np.sin(3 * points[:, 0])
    place = np.linspace(0, 1, 64)
    phase = points[:, :1]
    still = np.exp(-0.5 * ((place - 0.5) / (0.1 + 0.1 * phase)) ** 2)
    waves = 0.5 + 0.5 * np.sin(2 * np.pi * (4 * place + 0.15 * phase))
    features = np.where(above[:, None], waves, still) + rng.normal(0, 0.05, (count, 64))
    where = spectral_embedding(features, "cosine")
    score = _adjusted_rand(cluster(where, 2), above.astype(int))
    print(f"two phases, {count} points: adjusted Rand index {score:.3f}")
    return {"points": count, "adjusted_rand": score}


def _adjusted_rand(one: NDArray[Any], other: NDArray[Any]) -> float:
    """Hubert and Arabie 1985."""
    table = np.array([[np.sum((one == a) & (other == b)) for b in np.unique(other)] for a in np.unique(one)], float)

    def pairs(counts: Any) -> float:
        return float(np.sum(counts * (counts - 1) / 2))

    both, rows, columns, all_ = pairs(table), pairs(table.sum(1)), pairs(table.sum(0)), pairs(np.array(len(one)))
    expected = rows * columns / all_
    return (both - expected) / ((rows + columns) / 2 - expected)


def _branin(x: Array) -> Array:
    a, b = 15 * x[:, 0] - 5, 15 * x[:, 1]
    return (b - 5.1 / (4 * np.pi**2) * a**2 + 5 / np.pi * a - 6) ** 2 + 10 * (1 - 1 / (8 * np.pi)) * np.cos(a) + 10


def _camel(x: Array) -> Array:
    a, b = 4 * x[:, 0] - 2, 2 * x[:, 1] - 1
    return (4 - 2.1 * a**2 + a**4 / 3) * a**2 + a * b + (-4 + 4 * b**2) * b**2


def _hartmann(x: Array) -> Array:
    alpha = np.array([1.0, 1.2, 3.0, 3.2])
    a = np.array([[3.0, 10, 30], [0.1, 10, 35], [3.0, 10, 30], [0.1, 10, 35]])
    p = 1e-4 * np.array([[3689, 1170, 2673], [4699, 4387, 7470], [1091, 8732, 5547], [381, 5743, 8828]])
    return -np.sum(alpha * np.exp(-np.sum(a * (x[:, None] - p) ** 2, axis=2)), axis=1)


OPTIMA: dict[str, Callable[[Array], Array]] = {"Branin": _branin, "six-hump camel": _camel, "Hartmann 3": _hartmann}
MINIMA = {"Branin": 0.397887, "six-hump camel": -1.031628, "Hartmann 3": -3.86278}
DIMENSIONS = {"Branin": 2, "six-hump camel": 2, "Hartmann 3": 3}


def _race(function: Callable[[Array], Array], repeats: int, limit: int) -> dict[str, float]:
    """Median number of evaluations until the optimum is found, by proposals and by Sobol points."""
    name = next(key for key, value in OPTIMA.items() if value is function)
    n = DIMENSIONS[name]
    spread = np.ptp(function(qmc.Sobol(n, rng=np.random.default_rng(0)).random(4096)))
    goal = MINIMA[name] + FRACTION * spread
    counts: dict[str, list[int]] = {"proposals": [], "sobol": []}
    for seed in range(repeats):
        points = progressive_fill(unit_cube(n), STARTED, seed=seed).points
        values = function(points)
        while values.min() > goal and len(values) < limit:
            fresh, _ = propose(points, values, seed=seed)
            points = np.concatenate([points, fresh[None]])
            values = np.append(values, function(fresh[None]))
        counts["proposals"].append(len(values))
        drawn = function(qmc.Sobol(n, rng=np.random.default_rng(seed)).random(2**14))
        hits = np.flatnonzero(drawn <= goal)
        counts["sobol"].append(int(hits[0]) + 1 if len(hits) else len(drawn))
    return {kind: float(np.median(found)) for kind, found in counts.items()}
