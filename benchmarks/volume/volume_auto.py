# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples and time of `auto` over uniform steps, both with empty-space skipping, at equal SNR.

Both are swept around 40, 50 and 60 dB on the whole picture and compared at that SNR exactly; times are the least
processor time of several marches, taken in turns. Arguments: names of volumes.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.volume.cases.volumes import Curve, all_volumes, reference
from spectral_core.volume.image import Stepping
from spectral_core.volume.plan import plan
from spectral_core.volume.presets import preset
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.view import View

WORDS = "VOLUME…"
FUNCTIONS = ("wide", "narrow", "opaque")
# Fields on which the rule's constants were found by trial; the other fields had no influence on them.
TUNED_ON = ("hipip", "neghip", "bolt", "nut", "mni152", "headsq", "gaussians", "embryo")


def run(options: Options) -> dict[str, Any]:
    rows = []
    size = 96 if options.quick else 512
    for number, volume in enumerate(all_volumes(options.quick, options.extra)):
        renderer = VolumeRenderer(volume)
        view = View.around(volume, 20.0 + 37.0 * number, 15.0 + 11.0 * (number % 5), width=size, height=size)
        for function in FUNCTIONS:
            rows += compare(renderer, view, function, (40.0,) if options.quick else (40.0, 50.0, 60.0))
    return report(rows)


def compare(renderer: VolumeRenderer, view: View, function: str, targets: tuple[float, ...]) -> list[dict[str, Any]]:
    """One row per target: share of samples and of processor time that `auto` takes of uniform stepping."""
    transfer = preset(function, renderer.volume)
    curve = Curve(renderer, view, transfer, reference(renderer, view, transfer, max(targets)))
    rows = []
    for target in targets:
        chosen = plan(renderer, view, transfer, target)
        base = chosen.trials[0].stepping
        row: dict[str, Any] = {"volume": renderer.volume.name, "function": function, "db": target}
        row |= {"rule": chosen.stepping.rule, "quadrature": chosen.stepping.quadrature}
        if chosen.stepping.rule == "uniform":
            row |= {"samples": 1.0, "time": 1.0}
        else:
            ours, uniform = curve.at(chosen.stepping, target), curve.at(base, target)
            ways = [Stepping(w.rule, w.quadrature, at["scale"]) for w, at in ((chosen.stepping, ours), (base, uniform))]
            times = interleaved(renderer, view, transfer, ways)
            row |= {"samples": ours["samples"] / uniform["samples"], "time": times[0] / times[1]}
        rows.append(row)
        print(f"{row['volume']:15} {function:7} {target:.0f} dB  {row['rule']:8} {row['quadrature']:14}"
              f" samples {row['samples']:.2f}  time {row['time']:.2f}", flush=True)  # fmt: skip
    return rows


def interleaved(
    renderer: VolumeRenderer, view: View, transfer: Any, ways: list[Stepping], rounds: int = 5
) -> list[float]:
    """Least processor seconds of each way, taken in turns on one core: the machine may be busy, the ratio holds."""
    import drjit as dr

    threads = dr.thread_count()
    dr.set_thread_count(1)  # idle threads of a pool would count as busy
    best = [np.inf] * len(ways)
    for _ in range(rounds + 1):  # the first compiles
        for i, way in enumerate(ways):
            start = time.process_time()
            renderer.render(view, transfer, way)
            best[i] = min(best[i], time.process_time() - start)
    dr.set_thread_count(threads)
    return best


def report(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Medians and worst of samples and time: of all, per function, per quality, and of fields that tuned nothing."""
    groups = {"all": rows, "unseen fields": [row for row in rows if row["volume"] not in TUNED_ON]}
    groups |= {function: [row for row in rows if row["function"] == function] for function in FUNCTIONS}
    groups |= {f"{db:g} dB": [row for row in rows if row["db"] == db] for db in sorted({row["db"] for row in rows})}
    both = [(function, db) for function in FUNCTIONS for db in sorted({row["db"] for row in rows})]
    groups |= {f"{f} {db:g} dB": [r for r in rows if r["function"] == f and r["db"] == db] for f, db in both}
    figures: dict[str, Any] = {"cases": len(rows), "uniform_kept": sum(row["rule"] == "uniform" for row in rows)}
    print(f"{len(rows)} cases, {figures['uniform_kept']} of them left to uniform")
    for name, group in groups.items():
        if not group:
            continue
        parts = []
        for what in ("samples", "time"):
            values = np.array([row[what] for row in group])
            figures |= {
                f"{name}: {what}_median": float(np.median(values)),
                f"{name}: {what}_worst": float(values.max()),
            }
            parts.append(f"{what} median {np.median(values):.2f}, worst {values.max():.2f}")
        print(f"{name:14} {'; '.join(parts)}")
    figures["holds"] = {
        "auto takes no more samples than uniform steps": figures["all: samples_worst"] <= 1.01,
        "auto takes no more time than uniform steps": figures["all: time_worst"] <= 1.05,
    }
    return figures | {"rows": rows}
