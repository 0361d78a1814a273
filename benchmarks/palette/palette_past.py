# SPDX-License-Identifier: GPL-3.0-or-later
"""Beyond the thesis: Figure 5.2 and random 9×9 palettes with the default rounds instead of one.

All settings but the requests are the defaults of ``PaletteProblem``. Then what counting errors in CIELAB gains.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks import Options
from benchmarks.palette.cases import thesis_data as thesis
from benchmarks.palette.palette_thesis import mean_delta_e_1976
from spectral_core.palette import PaletteProblem, solve_palette
from spectral_core.palette.presets import split_light


def run(options: Options) -> dict:
    """Print and return the errors."""
    defaults = PaletteProblem.__dataclass_fields__
    chosen = {name: defaults[name].default for name in ("rounds", "smoothness", "smoothness_operator")}
    split = {
        "thesis grid": replace(thesis.from_scratch(1, 1.0), **chosen),
        "preset, as rendered": replace(split_light(), **chosen),
    }
    figures: dict = {"defaults": chosen, "split_light_max_delta_e_2000": {}}
    for name, problem in split.items():
        solution = solve_palette(problem, explain=False)
        figures["split_light_max_delta_e_2000"][name] = solution.max_delta_e_2000
        print(f"5×3 of Figure 5.2, {name:20} {solution.rounds:3d} rounds, max ΔE2000 {solution.max_delta_e_2000:.5f}")
    seeds = 2 if options.quick else 20
    errors = []
    for seed in range(seeds):
        one = thesis.random_palette((9, 9), np.random.default_rng(100 + seed))
        errors.append(mean_delta_e_1976(solve_palette(replace(one, **chosen), explain=False)))
    figures["random_9x9_mean_delta_e_1976"] = {"mean": float(np.mean(errors)), "worst": float(np.max(errors))}
    print(f"random 9×9, {seeds} seeds: mean ΔE76 {np.mean(errors):.3f}, worst palette {np.max(errors):.3f}")
    figures["perceptual_match"] = _perceptual(2 if options.quick else 6)
    figures["holds"] = {
        "every cell of Figure 5.2 is met within ΔE2000 0.001": (
            max(figures["split_light_max_delta_e_2000"].values()) < 0.001
        ),
        "the mean ΔE76 of random 9×9 palettes is below 2": float(np.mean(errors)) < 2,
    }
    return figures


def _perceptual(seeds: int) -> dict:
    """Mean ΔE2000 of random palettes after 10 rounds, errors counted in linear RGB and in linearized CIELAB."""
    figures = {}
    for size in (10, 15):
        errors: dict[str, list[float]] = {"linear": [], "perceptual": []}
        for seed in range(seeds):
            problem = thesis.random_palette((size, size), np.random.default_rng(seed), rounds=10)
            for match, found in errors.items():
                solution = solve_palette(replace(problem, match=match), explain=False)
                found.append(float(np.mean(solution.delta_e_2000)))
        figures[f"{size}x{size}"] = {match: float(np.mean(found)) for match, found in errors.items()}
        print(f"random {size}×{size}, 10 rounds, mean ΔE2000: " + str(figures[f"{size}x{size}"]))
    return figures
