# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 5.1 to 5.4 of the thesis: its printed spectra, its design, its errors by palette size.

``--quick`` runs few seeds and sizes. Pictures go to the output folder where matplotlib is installed.
"""

from __future__ import annotations

import numpy as np

from benchmarks import Options
from benchmarks.palette.cases import thesis_data as thesis
from benchmarks.palette.pictures.palettes import draw_distances, draw_errors, draw_palette
from spectral_core.palette import PaletteSolution, solve_palette
from spectral_core.palette.assemble.kernel import color_kernel
from spectral_core.palette.presets import metamer_pair
from spectral_core.spectra.color import delta_e_1976, delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.spectrum import SpectralGrid

GRID_100 = SpectralGrid(np.linspace(400.0, 700.0, 100), "sampled")
MODELS = {"31 positive": (thesis.GRID, True), "100 positive": (GRID_100, True), "31 unbounded": (thesis.GRID, False)}


def run(options: Options) -> dict:
    """Print the tables, write the pictures, return the figures."""
    figures = {
        "figure_5_1": _metamer_pair(options),
        "figure_5_2": _split_lights(options),
        "figure_5_3": _errors_by_size(options),
        "figure_5_4": _distances(options),
    }
    print(f"pictures in {options.out}")
    printed, sizes = figures["figure_5_2"], figures["figure_5_3"]
    figures["holds"] = {
        "the printed spectra give the printed colors to 0.5/255": printed["printed_colors_largest_difference_255"]
        <= 0.5,
        "the second phase returns the printed lights within 3e-4": max(printed["phase_2_lights_rms"]) < 3e-4,
        "100 positive samples and 31 unbounded ones meet 7×7 colors": (
            max(sizes["100 positive"]["7"], sizes["31 unbounded"]["7"]) < 0.05
        ),
    }
    return figures


def mean_delta_e_1976(solution: PaletteSolution) -> float:
    """Mean over all cells, as the thesis measures it."""
    wanted, actual = solution.target_linear_rgb, solution.actual_linear_rgb
    return float(delta_e_1976(lab_from_linear_rgb(wanted), lab_from_linear_rgb(actual)).mean())


def _metamer_pair(options: Options) -> dict:
    solution = solve_palette(metamer_pair(), explain=False)
    lab = lab_from_linear_rgb(solution.actual_linear_rgb)
    figures = {
        "status": solution.status.value,
        "pair_delta_e_2000": {
            light.name: float(delta_e_2000(lab[0, j], lab[1, j])) for j, light in enumerate(solution.illuminants)
        },
    }
    print("Figure 5.1, metamer pair: ΔE2000 of the pair", figures["pair_delta_e_2000"])
    draw_palette(solution, options.out / "figure_5_1.png")
    return figures


def _split_lights(options: Options) -> dict:
    rows = [thesis.reflectance(f"refl{i + 1}") for i in range(5)]
    columns = [thesis.light(name) for name in ("d65", "split1", "split2")]
    kernel = color_kernel(thesis.GRID)
    shown = 255 * np.array([[kernel.color_of(light, row)[0] for light in columns] for row in rows])
    lights = solve_palette(thesis.lights_only(), explain=False)
    draw_palette(lights, options.out / "figure_5_2_printed.png")
    away = [
        float(np.sqrt(np.mean((lights.illuminants[k].values / thesis.PER_NM - thesis.PRINTED[f"split{k}"]) ** 2)))
        for k in (1, 2)
    ]
    figures = {
        "printed_colors_largest_difference_255": float(np.abs(shown - thesis.PRINTED_COLORS_255).max()),
        "phase_2_lights_rms": away,
        "rounds": {},
    }
    print("Figure 5.2: the printed spectra give, in linear RGB × 255 (D65 | split 1 | split 2):")
    for row in shown:
        print("   " + " | ".join(" ".join(f"{value:6.1f}" for value in color) for color in row))
    print(f"   largest difference to the table {figures['printed_colors_largest_difference_255']:.2f}")
    print(f"   phase 2 returns the printed lights within rms {away[0]:.1e}, {away[1]:.1e}")
    print(f"{'ω_D':>8} {'rounds':>7} {'mean ΔE00':>10} {'max ΔE00':>10}")
    for smoothness, rounds in ((1.0, 1), (1.0, 3), (1.0, 10), (0.01, 3), (0.01, 20)):
        solution = solve_palette(thesis.from_scratch(rounds, smoothness), explain=False)
        mean, largest = float(np.mean(solution.delta_e_2000)), solution.max_delta_e_2000
        figures["rounds"][f"{smoothness:g} x {rounds}"] = {"mean": mean, "max": largest}
        print(f"{smoothness:8g} {solution.rounds:7d} {mean:10.4f} {largest:10.4f}")
        if (smoothness, rounds) == (1.0, 1):
            draw_palette(solution, options.out / "figure_5_2_from_scratch.png")
    return figures


def _errors_by_size(options: Options) -> dict:
    sizes = (2, 7) if options.quick else tuple(range(1, 16))
    seeds = 1 if options.quick else 20
    figures: dict[str, dict[str, float]] = {}
    print(f"Figure 5.3, mean ΔE76 of k×k palettes, one round, {seeds} seeds (standard deviation):")
    print("  k " + " ".join(f"{name:>16}" for name in MODELS))
    untrusted = 0
    for size in sizes:
        line = [f"{size:3d} "]
        for name, (grid, bounded) in MODELS.items():
            errors = []
            for seed in range(seeds):
                problem = thesis.random_palette((size, size), np.random.default_rng(seed), grid, bounded=bounded)
                solution = solve_palette(problem, explain=False)
                untrusted += not solution.status.trusted
                errors.append(mean_delta_e_1976(solution))
            figures.setdefault(name, {})[str(size)] = float(np.mean(errors))
            line.append(f"{np.mean(errors):9.3f} ({np.std(errors):4.2f})")
        print(" ".join(line))
    draw_errors(figures, options.out / "figure_5_3.png")
    return {**figures, "untrusted_solutions": untrusted}


def _distances(options: Options) -> dict:
    """Figure 5.4: wanted against actual distance of all pairs of a 10×10 palette."""
    drawn, figures = {}, {}
    for name, (grid, bounded) in MODELS.items():
        solution = solve_palette(thesis.random_palette((10, 10), np.random.default_rng(1), grid, bounded=bounded))
        pairs = np.triu_indices(100, 1)
        distances = []
        for colors in (solution.target_linear_rgb, solution.actual_linear_rgb):
            lab = lab_from_linear_rgb(colors).reshape(-1, 3)
            distances.append(delta_e_1976(lab[pairs[0]], lab[pairs[1]]))
        drawn[name] = distances
        figures[name] = {
            "correlation": float(np.corrcoef(*distances)[0, 1]),
            "rms": float(np.sqrt(np.mean((distances[0] - distances[1]) ** 2))),
        }
        print(f"Figure 5.4, {name:13} r = {figures[name]['correlation']:.4f}, rms {figures[name]['rms']:.2f} ΔE76")
    draw_distances(drawn, options.out / "figure_5_4.png")
    return figures
