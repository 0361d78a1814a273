# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendered mode against Cycles' viewport: time from an edit to the same error, five scenes, in a window of Blender.

SPECTRAL_REAL_BLENDER and SPECTRAL_PATHS as in ``launch``. Both engines show the same view with the same samples
after a number of a material was changed, in turn, after a first edit of each that compiles. Work is processor time of
all threads that trace and prepare: of our render process, and of Blender without its main thread and without software
OpenGL, which only Cycles' figure is freed of. Error is the relative mean square error of F12 with the same samples
against a converged picture of the same engine: both viewports trace the samples of F12 (Cycles' with its pattern set
to the same one). As error falls as one over time, the ratio at equal error is (our work · our error) / (its work ·
its error). Nothing is denoised or clamped, and pixels are of full size.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.viewport.window import launch
from spectral_core.errors import MissingDependencyError, UnknownNameError

WORDS = "SCENE…"
SCENES = ("Cornell box", "interior, window", "glass", "HDRI", "sun and sky")
LIMIT = 1.2


def run(options: Options) -> dict[str, Any]:
    """Print the table and return it."""
    for word in options.extra:
        if word not in SCENES:
            raise UnknownNameError.among("scene", word, SCENES)
    if not launch.has_window():
        raise MissingDependencyError(f"nothing is measured: {launch.MISSING}")
    names = options.extra or list(SCENES)[: 1 if options.quick else None]
    settings = {"scenes": names, "samples": 4, "rounds": 1, "many": 128} if options.quick else {}
    settings = settings or {"scenes": names, "samples": 16, "rounds": 2, "many": 512}
    return _figures(launch.told_by("rivals.py", settings, options, (420, 320)))


def _figures(told: dict[str, Any]) -> dict[str, Any]:
    print(f"Blender {told['version']}, {told['size'][0]} × {told['size'][1]} pixels, {told['samples']} samples")
    print(
        f"{'scene':18} {'our work':>8} {'its work':>8} {'our s':>7} {'its s':>7} {'error':>6} {'ratio':>6} {'wall':>6}"
    )
    rows: dict[str, Any] = {}
    for name, found in told["scenes"].items():
        ours, its = (found[engine] for engine in ("SPECTRAL", "CYCLES"))
        errors = ours["error"] / its["error"]
        work, wall = ([float(np.median(side[kind])) for side in (ours, its)] for kind in ("work", "wall"))
        rows[name] = {
            "our_work": work[0], "its_work": work[1], "our_s": wall[0], "its_s": wall[1],
            "our_error": ours["error"], "its_error": its["error"], "ratio": work[0] / work[1] * errors,
            "ratio_on_wall": wall[0] / wall[1] * errors, "mean_difference": ours["mean"] / its["mean"] - 1,
        }  # fmt: skip
        print(f"{name:18} {work[0]:8.2f} {work[1]:8.2f} {wall[0]:7.2f} {wall[1]:7.2f} {errors:6.2f} "
              f"{rows[name]['ratio']:6.2f} {rows[name]['ratio_on_wall']:6.2f}")  # fmt: skip
    for text in told["errors"]:
        print(text, file=sys.stderr)
    largest = max((row["ratio"] for row in rows.values()), default=float("nan"))
    print(f"largest ratio {largest:.2f}")
    holds = {f"{name}: at most {LIMIT} of the time of Cycles": row["ratio"] <= LIMIT for name, row in rows.items()}
    return {"scenes": rows, "largest": largest, "troubles": told["errors"], "holds": holds}
