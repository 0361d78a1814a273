# SPDX-License-Identifier: GPL-3.0-or-later
"""Dial to pixels and new spectrum to pixels at 1920×1080 with 3 lights, against the render that they replace."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from itertools import cycle
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.relight.cases.scenes import scenes
from spectral_core.render import render_scene
from spectral_core.render.relight.band_storage import BandStorage
from spectral_core.render.relight.mix import LiveMix
from spectral_core.render.relight.storage import MixtureStorage, Storage
from spectral_core.render.relight.transport import Transport
from spectral_core.spectra import catalogue

SAMPLES = 64


def run(options: Options) -> dict[str, Any]:
    """Median of repeated mixes; the render is timed once, on the same machine, at 64 samples per pixel."""
    width, height = (192, 108) if options.quick else (1920, 1080)
    figures: dict[str, Any] = {"width": width, "height": height, "lights": 3, "samples": SAMPLES}
    rng = np.random.default_rng(0)
    dial = LiveMix(filled(MixtureStorage(), width, height, rng))
    mixes = cycle(rng.uniform(0, 1, (100, 3)))
    figures["dial_ms"] = _median_ms(lambda: dial.picture(next(mixes)))
    bands = LiveMix(filled(BandStorage(31), width, height, rng))
    for group in bands.transport.groups:
        bands.set_light(group, catalogue.illuminant("D65"))
    lamps = cycle([catalogue.illuminant(name) for name in ("HP1", "D65", "FL11", "A")])

    def another_spectrum() -> None:
        bands.set_light("Key", next(lamps))
        bands.picture([1, 1, 1])

    figures["new_spectrum_ms"] = _median_ms(another_spectrum)
    print(f"dial to pixels {figures['dial_ms']:.1f} ms, new spectrum to pixels {figures['new_spectrum_ms']:.1f} ms")
    for name, scene in scenes(width, height, SAMPLES if not options.quick else 2).items():
        start = time.perf_counter()
        render_scene(replace(scene, settings=replace(scene.settings, transport="spectral")))
        seconds = time.perf_counter() - start
        figures[name] = {"render_s": seconds, "dial_times_faster": 1000 * seconds / figures["dial_ms"],
                         "spectrum_times_faster": 1000 * seconds / figures["new_spectrum_ms"]}  # fmt: skip
        print(f"{name:20} render {seconds:6.1f} s: dial {figures[name]['dial_times_faster']:.0f}×, "
              f"new spectrum {figures[name]['spectrum_times_faster']:.0f}× faster")  # fmt: skip
    rows = [row for row in figures.values() if isinstance(row, dict)]
    figures["holds"] = {
        "a turn of the dial takes a hundredth of a render": all(row["dial_times_faster"] > 100 for row in rows),
        "a new spectrum takes a tenth of a render": all(row["spectrum_times_faster"] > 10 for row in rows),
    }
    return figures


def filled(storage: Storage, width: int, height: int, rng: np.random.Generator) -> Transport:
    """Transport of random numbers: a mix takes as long whatever the numbers are."""
    channels = rng.random((3, storage.channel_count, height, width), dtype=np.float32)
    coverage = np.ones((height, width), np.float32)
    return Transport(storage, ("Key", "Fill", "Sky"), channels, coverage, (None,) * 3, 1.0, "0" * 64, 1, 0)


def _median_ms(work: Callable[[], Any], repeats: int = 31) -> float:
    work()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(1000 * (time.perf_counter() - start))
    return float(np.median(times))
