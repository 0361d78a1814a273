# SPDX-License-Identifier: GPL-3.0-or-later
"""Most distinct colors: materials that match exactly in daylight, and how different they become under other lamps.

Differences are over all pairs of materials, CIELAB under the white of sRGB; beside the best of six starts stands what
the first one alone gives. Roughness is the length of a reflectance's second differences at 10 nm; the reflectances that
the thesis prints in Figure 5.2 have 0.18 to 1.78.
"""

from __future__ import annotations

import time
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.palette.pictures.palettes import draw_palette
from spectral_core.palette import PaletteProblem, PaletteSolution
from spectral_core.palette.distinct.search import solve_distinct
from spectral_core.palette.presets import most_distinct
from spectral_core.spectra.color import delta_e_1976, delta_e_2000, lab_from_linear_rgb

CASES = [
    ("5 under HP1 (the preset)", {}, 0.5),
    ("5 under HP1, smoother", {}, 0.7),
    ("5 under HP1, rougher", {}, 0.1),
    ("5 under HP1, lights of luminance 1", {"luminance": 1.0}, 0.25),
    ("5 under HP1, lights of luminance 6", {"luminance": 6.0}, 0.5),
    ("2 under HP1", {"count": 2}, 0.5),
    ("8 under HP1", {"count": 8}, 0.5),
    ("12 under HP1", {"count": 12}, 0.5),
    ("5 under A", {"reveal": "A"}, 0.5),
    ("5 under FL11", {"reveal": "FL11"}, 0.5),
    ("5 under LED-RGB1", {"reveal": "LED-RGB1"}, 0.5),
    ("5 under LPS", {"reveal": "LPS"}, 0.5),
]
"""Name, arguments of the preset, smoothness."""


def figures_of(solution: PaletteSolution) -> dict[str, float]:
    """Differences over all pairs of rows, and roughness."""
    lab = lab_from_linear_rgb(solution.actual_linear_rgb)
    pairs = list(combinations(range(len(lab)), 2))
    rough = [float(np.linalg.norm(np.diff(each.values, 2))) for each in solution.reflectances]
    return {
        "daylight_max": max(float(delta_e_2000(lab[a, 0], lab[b, 0])) for a, b in pairs),
        "least_delta_e_2000": min(float(delta_e_2000(lab[a, 1], lab[b, 1])) for a, b in pairs),
        "least_delta_e_1976": min(float(delta_e_1976(lab[a, 1], lab[b, 1])) for a, b in pairs),
        "roughness_max": max(rough),
        "roughness_mean": float(np.mean(rough)),
    }


def case(name: str, problem: PaletteProblem, starts: int) -> tuple[dict[str, Any], PaletteSolution]:
    """One row of the table."""
    begun = time.perf_counter()
    solution = solve_distinct(problem, starts=starts)
    seconds = time.perf_counter() - begun
    one = figures_of(solve_distinct(problem, starts=1))["least_delta_e_2000"]
    figures: dict[str, Any] = {"case": name, **figures_of(solution), "one_start": one, "seconds": seconds}
    figures["trusted"] = solution.status.trusted
    print(
        f"{name:38} {figures['least_delta_e_2000']:7.2f} {figures['least_delta_e_1976']:7.1f} {one:9.2f} "
        f"{figures['daylight_max']:9.1e} {figures['roughness_mean']:6.2f} {figures['roughness_max']:6.2f} "
        f"{seconds:7.2f}"
    )
    return figures, solution


def run(options: Options) -> dict[str, Any]:
    cases = CASES[:2] if options.quick else CASES
    starts = 2 if options.quick else 6
    print(f"{'':38} {'ΔE2000':>7} {'ΔE1976':>7} {'one start':>9} {'daylight':>9} {'roughness':^13} {'seconds':>7}")
    print(f"{'materials and light':38} {'least':>7} {'least':>7} {'ΔE2000':>9} {'ΔE2000':>9} {'mean':>6} {'max':>6}")
    rows = []
    for name, arguments, smoothness in cases:
        problem = replace(most_distinct(**arguments), smoothness=smoothness)
        figures, solution = case(name, problem, starts)
        rows.append(figures)
        if not rows[1:]:
            draw_palette(solution, options.out / "most_distinct.png")
    preset = rows[0]
    return {
        "rows": rows, "least_delta_e_2000": preset["least_delta_e_2000"], "daylight_max": preset["daylight_max"],
        "holds": {
            "every answer passed its check": all(row["trusted"] for row in rows),
            "all materials are equal in daylight within ΔE2000 1e-9": all(row["daylight_max"] < 1e-9 for row in rows),
            "the preset's materials differ by ΔE2000 30 under sodium light": preset["least_delta_e_2000"] >= 30,
        },
    }  # fmt: skip
