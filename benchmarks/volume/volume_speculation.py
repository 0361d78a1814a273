# SPDX-License-Identifier: GPL-3.0-or-later
"""Savings and misses of speculative steps: iterations per ray, and the SNR to the careful picture, in dB.

Narrow functions, pre-integrated, with steps fine enough that the two differ by little else. Arguments: volume names.
"""

from __future__ import annotations

from typing import Any

from benchmarks import Options
from benchmarks.volume.cases.volumes import all_volumes, colors_of
from spectral_core.volume.image import Stepping
from spectral_core.volume.march.march_input import Limits
from spectral_core.volume.pilot.rays import snr_db
from spectral_core.volume.presets import preset
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.view import View

WORDS = "VOLUME…"


def run(options: Options) -> dict[str, Any]:
    size = 64 if options.quick else 256
    figures: dict[str, Any] = {}
    for volume in all_volumes(options.quick, options.extra):
        renderer, transfer = VolumeRenderer(volume), preset("narrow", volume)
        view = View.around(volume, 33.0, 21.0, width=size, height=size)
        way = Stepping("error", "preintegrated", 0.01)
        careful, speculative = (
            renderer.render(view, transfer, way, counts=True, limits=limits)
            for limits in (Limits(most_stretch=1.0), Limits())
        )
        truth = colors_of(careful, transfer)
        difference = snr_db(truth, colors_of(speculative, transfer) - truth)
        share = (speculative.steps or 0) / max(careful.steps or 1, 1)
        print(
            f"{volume.name:15} speculative: {share:.2f} of the iterations, {difference:.1f} dB",
            flush=True,
        )
        figures |= {f"{volume.name}_iterations": share, f"{volume.name}_db": difference}
    shares = [value for key, value in figures.items() if key.endswith("_iterations")]
    return figures | {
        "holds": {
            "long steps take fewer iterations": max(shares) < 1,
            "pictures with and without long steps differ by 60 dB or more": (
                min(value for key, value in figures.items() if key.endswith("_db")) >= 60
            ),
        }
    }
