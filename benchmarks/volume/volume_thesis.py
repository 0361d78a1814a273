# SPDX-License-Identifier: GPL-3.0-or-later
"""Thesis Fig. 4.6 on HIPIP: quality against samples, thesis rule against uniform stepping; samples at equal SNR.

Only samples of non-zero opacity are counted (thesis 4.2), three views are pooled. Writes the curves as a figure if
matplotlib is installed. Without the shared HIPIP data a synthetic field is used.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.volume.cases.volumes import all_volumes, colors_of, reference, shared_data
from spectral_core.volume.image import Stepping
from spectral_core.volume.pilot.rays import snr_db
from spectral_core.volume.presets import preset
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.view import View

RULES = ("uniform", "thesis", "error")
DECIBELS = (35.0, 40.0, 45.0, 50.0, 55.0, 60.0)


def run(options: Options) -> dict[str, Any]:
    name = "hipip" if shared_data() and not options.quick else "gaussians"
    volume = next(all_volumes(options.quick, [name]))
    renderer, transfer = VolumeRenderer(volume), preset("wide", volume)
    size = 64 if options.quick else 256
    views = [View.around(volume, azimuth, 25.0, width=size, height=size) for azimuth in (20.0, 75.0, 140.0)]
    curves = {rule: curve(renderer, transfer, views, rule) for rule in RULES}
    figures: dict[str, Any] = {"volume": name}
    for rule in RULES[1:]:
        shares = [_samples(curves[rule], db) / _samples(curves["uniform"], db) for db in DECIBELS]
        figures |= {f"{rule}_fewer_percent_{db:.0f}_db": 100 * (1 - s) for db, s in zip(DECIBELS, shares, strict=True)}
        print(f"{name}: {rule:8} samples fewer than uniform, % at", end=" ")
        print("  ".join(f"{db:.0f} dB: {100 * (1 - s):.0f}" for db, s in zip(DECIBELS, shares, strict=True)))
    figures["figure"] = draw(curves, options)
    thesis, ours = ([figures[f"{rule}_fewer_percent_{db:.0f}_db"] for db in DECIBELS] for rule in RULES[1:])
    figures["holds"] = {
        f"{name}: the thesis rule takes fewer samples than uniform steps": min(thesis) > 0,
        f"{name}: steps of equal error take fewer than the thesis rule": all(
            each > other for each, other in zip(ours, thesis, strict=True)
        ),
    }
    return figures


def curve(renderer: VolumeRenderer, transfer: Any, views: list[View], rule: Any) -> np.ndarray:
    """Rows (SNR in dB, samples) over a range of step scales; errors and samples of all views together."""
    start, stop = {"uniform": (4.0, 0.12), "thesis": (90.0, 0.9), "error": (6.0, 0.2)}[rule]
    exact = [reference(renderer, view, transfer) for view in views]
    rows = []
    for scale in np.geomspace(start, stop, 16):
        shown = [
            renderer.render(view, transfer, Stepping(rule, "midpoint", float(scale)), counts=True) for view in views
        ]
        error = np.stack([colors_of(image, transfer) - e for image, e in zip(shown, exact, strict=True)])
        rows.append((snr_db(np.stack(exact), error), sum(image.samples or 0 for image in shown)))
    return np.array(rows)


def _samples(rows: np.ndarray, db: float) -> float:
    best = np.maximum.accumulate(rows[:, 0]) + 1e-9 * np.arange(len(rows))
    return float(np.exp(np.interp(db, best, np.log(rows[:, 1]))))


def draw(curves: dict[str, np.ndarray], options: Options) -> str:
    try:
        import matplotlib
    except ImportError:
        return "matplotlib is not installed"
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6, 4), layout="constrained")
    for (rule, rows), style in zip(curves.items(), ("s-", "o-", "^-"), strict=True):
        axes.plot(rows[:, 1] / 1e6, rows[:, 0], style, label=rule, markersize=4)
    axes.set(xlabel="samples of non-zero opacity, millions", ylabel="signal to noise ratio, dB", ylim=(20, 80))
    axes.set_xlim(0, 1.05 * max(_samples(rows, 65.0) for rows in curves.values()) / 1e6)
    axes.grid(alpha=0.3)
    axes.legend()
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / "fig-4-6.png"
    figure.savefig(path, dpi=150)
    pyplot.close(figure)
    return str(path)
