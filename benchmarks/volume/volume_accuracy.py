# SPDX-License-Identifier: GPL-3.0-or-later
"""Accuracy against time: samples and milliseconds of every rule on every volume at 40, 50 and 60 dB, as a table.

Steps come from pilot rays; the SNR is measured on the whole picture against a fine reference, and samples and time
are carried to the wanted SNR by 40 dB per decade of step (they are within 1 dB of it as a rule). Writes the table
as Markdown and a picture of it per function. Arguments: names of volumes, then of a function preset.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.volume.cases.volumes import all_volumes, colors_of, reference
from benchmarks.volume.pictures.accuracy import LOOKS, write
from spectral_core.volume.pilot.rays import snr_db
from spectral_core.volume.plan import plan
from spectral_core.volume.presets import PRESETS, preset
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.view import View

WORDS = "VOLUME_OR_FUNCTION…"
WAYS = (("uniform", "midpoint"), ("thesis", "midpoint"), ("error", "midpoint"), ("error", "preintegrated"), ("auto", "auto"))  # fmt: skip  # noqa: E501


def run(options: Options) -> dict[str, Any]:
    functions = [word for word in options.extra if word in PRESETS] or ["wide"]
    names = [word for word in options.extra if word not in PRESETS]
    targets = (40.0,) if options.quick else (40.0, 50.0, 60.0)
    size = 64 if options.quick else 512
    lines = [
        "| volume | function | dB | " + " | ".join(label for *_, label in LOOKS.values()) + " |",
        "|--" * (len(WAYS) + 3) + "|",
    ]
    rows: list[dict[str, Any]] = []
    for volume in all_volumes(options.quick, names):
        renderer = VolumeRenderer(volume)
        view = View.around(volume, 33.0, 21.0, width=size, height=size)
        for function in functions:
            transfer = preset(function, volume)
            exact = reference(renderer, view, transfer)
            for target in targets:
                cells = measured(renderer, view, transfer, exact, target)
                text = " | ".join(f"{s / 1e6:.2f} M, {1e3 * t:.1f} ms" for s, t in cells)
                lines.append(f"| {volume.name} | {function} | {target:.0f} | {text} |")
                print(lines[-1], flush=True)
                place = {"volume": volume.name, "function": function, "db": target}
                for way, (samples, seconds) in zip(WAYS, cells, strict=True):
                    rows.append(place | {"way": " ".join(way), "samples": samples, "ms": 1e3 * seconds})
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "accuracy.md").write_text("\n".join(lines) + "\n", "utf-8")
    for function in functions:
        print(write(options.out / f"accuracy-{function}.png", [r for r in rows if r["function"] == function], function))
    pairs = [[row["samples"] for row in rows[k : k + len(WAYS)]] for k in range(0, len(rows), len(WAYS))]
    return {
        "rows": rows,
        "holds": {"auto takes no more samples than uniform steps": all(each[-1] <= 1.01 * each[0] for each in pairs)},
    }


def measured(
    renderer: VolumeRenderer, view: View, transfer: Any, exact: np.ndarray, target: float
) -> list[tuple[float, float]]:
    """(samples, seconds) of each way at ``target`` dB; times are the least of several, taken in turns, on all cores."""
    ways = [plan(renderer, view, transfer, target, rule=r, quadrature=q).stepping for r, q in WAYS]  # type: ignore[arg-type]
    seconds = [np.inf] * len(ways)
    for _ in range(8):
        for number, stepping in enumerate(ways):
            start = time.perf_counter()
            renderer.render(view, transfer, stepping)
            seconds[number] = min(seconds[number], time.perf_counter() - start)
    cells = []
    for stepping, time_taken in zip(ways, seconds, strict=True):
        image = renderer.render(view, transfer, stepping, counts=True)
        reached = snr_db(exact, colors_of(image, transfer) - exact)
        carried = 10.0 ** ((target - reached) / 40.0)
        cells.append(((image.samples or 0) * carried, time_taken * carried))
    return cells
