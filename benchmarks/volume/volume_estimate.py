# SPDX-License-Identifier: GPL-3.0-or-later
"""The error stated before rendering against the measured SNR, per volume, function, view and quality.

The estimate comes from 4096 pilot rays; the SNR is that of the whole picture against a fine reference. Counted is
the share within 3 dB. Arguments: names of volumes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.volume.cases.volumes import all_volumes, colors_of, reference
from spectral_core.volume.pilot.rays import snr_db
from spectral_core.volume.plan import plan
from spectral_core.volume.presets import preset
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.view import View

WORDS = "VOLUME…"
FUNCTIONS = ("wide", "narrow", "opaque", "xray")


def run(options: Options) -> dict[str, Any]:
    rng = np.random.default_rng(12)
    off, seconds, rendering = [], [], []
    size = 96 if options.quick else 256
    for volume in all_volumes(options.quick, options.extra):
        renderer = VolumeRenderer(volume)
        for function in FUNCTIONS:
            transfer = preset(function, volume)
            for number in range(1 if options.quick else 2):
                fov = None if number else 30.0
                azimuth, elevation = rng.uniform(0, 360), rng.uniform(-60, 60)
                zoom = rng.uniform(0.8, 2.0)
                view = View.around(volume, azimuth, elevation, zoom=zoom, width=size, height=size, fov_deg=fov)
                exact = reference(renderer, view, transfer)
                for quality in (40.0, 50.0, 60.0):
                    made = plan(renderer, view, transfer, quality)
                    image = renderer.render(view, transfer, made.stepping)
                    measured = snr_db(exact, colors_of(image, transfer) - exact)
                    off.append(made.estimate_db - measured)
                    seconds.append(made.seconds)
                    rendering.append(image.seconds)
                    if abs(off[-1]) > 3:
                        print(f"{volume.name} {function} {quality:.0f} dB: stated {made.estimate_db:.1f}, measured {measured:.1f}")  # fmt: skip  # noqa: E501
    errors = np.abs(off)
    figures = {
        "cases": len(off),
        "within_3_db_percent": float(100 * np.mean(errors <= 3)),
        "within_1_db_percent": float(100 * np.mean(errors <= 1)),
        "worst_db": float(errors.max()),
        "median_plan_ms": float(1e3 * np.median(seconds)),
        "median_render_ms": float(1e3 * np.median(rendering)),
    }
    for name, value in figures.items():
        print(f"{name:24} {value:.1f}")
    return figures | {
        "holds": {
            "95 % of the stated errors are within 3 dB of the measured ones": figures["within_3_db_percent"] >= 95
        }
    }
