# SPDX-License-Identifier: GPL-3.0-or-later
"""Overhead of a sweep beyond its renders, against a process per point; each picture against its point alone."""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
from typing import Any

import numpy as np

from benchmarks import ROOT, Options
from spectral_core.explore.features.picture_files import read_linear
from spectral_core.explore.sweep.document import read_sweep
from spectral_core.explore.sweep.sweep import Sweep

DOCUMENT = ROOT / "examples" / "sweeps" / "corner.toml"
WORKERS = 2
_ALONE = """import sys
from pathlib import Path
from spectral_core.explore.sweep.document import read_sweep
from spectral_core.explore.sweep.store import Store
from spectral_core.explore.sweep.task import compute_point
document = read_sweep(Path(sys.argv[1]))
with Store.open(Path(sys.argv[2])) as store:
    rows = {row.key: row for row in store.ledger.rows()}
    receipt = compute_point(document.node(), rows[sys.argv[3]].parameters, document.seed, sys.argv[3], None)
name = next(name for name in receipt.contents if name.endswith(".exr"))
Path(sys.argv[4]).write_bytes(receipt.contents[name])
"""


def run(options: Options) -> dict[str, Any]:
    """Sweep four properties of a small scene with two workers, then some of its points each in a new process."""
    points, alone = (6, 2) if options.quick else (128, 6)
    folder = options.out / "overhead"
    shutil.rmtree(folder.with_suffix(".cdb"), ignore_errors=True)
    sweep = Sweep(read_sweep(DOCUMENT), folder)
    plan = sweep.plan(points)
    start = time.perf_counter()
    report = sweep.run(plan, workers=WORKERS)
    wall = time.perf_counter() - start
    # with two workers on as many cores, the renders alone would take this long
    rendering = report.computing_seconds / WORKERS
    overhead = wall / rendering - 1
    rows = sweep.store.ledger.rows("done")
    chosen = [rows[int(k)] for k in np.linspace(0, len(rows) - 1, alone)]
    worst, single = 0.0, []
    for row in chosen:
        target = options.out / "alone.exr"
        command = [sys.executable, "-c", _ALONE, str(DOCUMENT), str(folder), row.key]
        start = time.perf_counter()
        # as many at a time as the sweep has workers: they share the cores as the workers did
        others = [subprocess.Popen([*command, str(options.out / f"other{k}.exr")]) for k in range(1, WORKERS)]
        subprocess.run([*command, str(target)], check=True)
        for other in others:
            other.wait()
        single.append(time.perf_counter() - start)
        difference = read_linear(target) - read_linear(sweep.store.folder / row.files["FILE_linear"])
        worst = max(worst, float(np.abs(difference).max()))
    per_process = float(np.median(single)) * points / WORKERS
    figures: dict[str, Any] = {
        "points": points, "wall_s": round(wall, 2), "rendering_s": round(rendering, 2), "overhead": round(overhead, 4),
        "process_per_point_s": round(per_process, 1), "times_faster": round(per_process / wall, 2),
        "largest_difference_to_alone": worst, "compared": len(chosen),
    }  # fmt: skip
    figures["holds"] = {
        "overhead beyond the renders below 10 %": overhead < 0.10,
        "every picture equals that of the point alone": worst == 0.0,
        "at least 5 times faster than a process per point": per_process / wall >= 5,
    }
    for name, value in figures.items():
        print(f"{name:28} {value}")
    return figures
