# SPDX-License-Identifier: GPL-3.0-or-later
"""Thesis Figs. 1.2, 6.3 and 6.6 with other scenes: error of renderer and march by sweeps, dial, faders."""

from __future__ import annotations

import shutil
from typing import Any

import numpy as np

from benchmarks import ROOT, Options
from benchmarks.explore.cases.thesis_figures import dial_figure, simultaneity_figure
from spectral_core.explore.analysis.pareto import pareto_front
from spectral_core.explore.features.expression import as_column
from spectral_core.explore.page.build import table_of_store, write_page
from spectral_core.explore.page.static import draw_error_against_factors, draw_error_against_time
from spectral_core.explore.sweep.document import read_sweep
from spectral_core.explore.sweep.sweep import Sweep

SWEEPS = ROOT / "examples" / "sweeps"
FIGURES = {
    "renderer_accuracy": ("seconds", ("samples", "bounces", "transport"), "samples"),
    "volume_accuracy": ("march_seconds", ("step", "quadrature"), "step"),
}


def run(options: Options) -> dict[str, Any]:
    """Run both sweeps, draw them, and print how the error depends on the setting; draw the dial and the faders."""
    figures: dict[str, Any] = {"holds": {}}
    for name, (time, factors, knob) in FIGURES.items():
        folder = options.out / name
        shutil.rmtree(folder.with_suffix(".cdb"), ignore_errors=True)
        sweep = Sweep(read_sweep(SWEEPS / f"{name}.toml"), folder)
        report = sweep.run(sweep.plan(8 if options.quick else None), workers=1)
        columns = sweep.store.columns()
        errors = [error for error in ("rmse", "delta_e_mean", "flip") if error in columns]
        picture = draw_error_against_time(options.out / f"{name}.png", columns, time, errors, by=factors)
        draw_error_against_factors(options.out / f"{name}_factors.png", columns, factors, errors, color=knob)
        write_page(sweep.store.folder / "explore.html", table_of_store(sweep.store))
        knobs, error = as_column(columns[knob]), as_column(columns["rmse"])
        order = float(np.corrcoef(np.log(knobs), np.log(error))[0, 1])
        front = pareto_front(np.stack([as_column(columns[time]), error], axis=1))
        figures[name] = {
            "points": report.total,
            "figure": str(picture),
            "error_follows": round(order, 3),
            "front": len(front),
        }
        # more samples, or shorter steps
        is_right = order < -0.5 if knob == "samples" else order > 0.5
        figures["holds"][f"{name}: the error falls with better {knob}"] = is_right
        print(f"{name}: {figures[name]}")
    figures["light_dial"] = dial_figure(options.out / "light_dial.png", quick=options.quick)
    figures["faders"] = simultaneity_figure(options.out / "faders.png")
    dial, faders = figures["light_dial"], figures["faders"]
    figures["holds"] |= {
        "Fig. 6.3: at a bulb only its light is on": dial["largest_error_at_bulbs"] < 1e-12,
        "Fig. 6.3: a mixture has the mean color of its render": dial["mean_color_to_render"]
        < (0.2 if options.quick else 0.03),
        "Fig. 6.6: the scripted habits are detected": all(v for v in faders.values() if isinstance(v, bool)),
    }
    for name in ("light_dial", "faders"):
        print(f"{name}: {figures[name]}")
    return figures
