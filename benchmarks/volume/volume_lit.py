# SPDX-License-Identifier: GPL-3.0-or-later
"""Quality of volumes that a lamp lights: stated, measured against an integration in NumPy, and what it costs.

Three sample fields with three functions each, under a sun and under a lamp near the field, at 50 dB. The steps that
pilot rays under the lamp choose are compared with those of pilot rays under even light: SNR, iterations per ray, and
processor time of the picture. Arguments: names of fields, which may be real ones.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.volume.cases.volumes import all_volumes
from benchmarks.volume.checks.lit_light import Lamp, LitScene, lit_light
from spectral_core.llvm_library import use_newest_llvm
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping
from spectral_core.volume.pilot.rays import snr_db
from spectral_core.volume.plan import plan
from spectral_core.volume.presets import preset
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.samples import sample_volume
from spectral_core.volume.view import View

ASKED_DB = 50.0
FIELDS, SIZE = ("gaussians", "engine", "noise"), 24
FUNCTIONS = ("wide", "narrow", "opaque")
STEP = 1 / 400  # voxels, of the integration
TIMED, SAMPLES, ROUNDS = 256, 8, 3  # pixels, samples per pixel, and renders of which the fastest counts
WORDS = "FIELD…"


def run(options: Options) -> dict[str, Any]:
    use_newest_llvm()
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    from spectral_core.volume.mitsuba_integrator.plugin import register_integrator

    register_integrator()
    pixels, functions = (12, FUNCTIONS[:1]) if options.quick else (24, FUNCTIONS)
    fields = all_volumes(options.quick, options.extra) if options.extra else (
        sample_volume(name, 12 if options.quick else SIZE) for name in FIELDS
    )  # fmt: skip
    rows = [
        judge(volume, function, name, pixels, timed=not options.quick)
        for volume in fields
        for function in functions
        for name in ("sun", "lamp")
    ]
    return report(rows)


def lamp_of(name: str, volume: ScalarVolume) -> Lamp:
    """A sun, or a point lamp beside the field."""
    if name == "sun":
        return Lamp(np.array([-0.3, 0.5, -0.8]), np.array([3.0, 2.0, 1.0]), is_sun=True)
    corners = volume.corners_world
    middle = corners.mean(axis=0)
    radius = float(np.linalg.norm(corners - middle, axis=-1).max())
    return Lamp(middle + 0.7 * radius * np.array([0.9, -0.8, 0.9]), radius**2 * np.array([3.0, 2.0, 1.0]), is_sun=False)


def judge(volume: ScalarVolume, function: str, name: str, pixels: int, *, timed: bool) -> dict[str, Any]:
    """One case: the steps of lit pilot rays and those of even light, under the lamp."""
    transfer, lamp = preset(function, volume), lamp_of(name, volume)
    view = View.around(volume, 30.0, 25.0, width=pixels, height=pixels)
    made = LitScene.of(volume, transfer, lamp, view, quality=ASKED_DB)
    (lit,) = made.integrator.fields.plans
    renderer = VolumeRenderer(volume)
    even = plan(renderer, view, transfer, ASKED_DB)
    picture, eye, along = made.at_centers()
    exact = lit_light(volume, transfer, lamp, eye, along, STEP)
    before, *_ = LitScene.of(volume, transfer, lamp, view, **_fixed(even.stepping)).at_centers()
    steps = [renderer.render(view, transfer, each.stepping, counts=True).steps for each in (lit, even)]
    row = {
        "volume": volume.name, "function": function, "lamp": name, "stated_db": lit.estimate_db,
        "measured_db": snr_db(exact, picture - exact), "even_db": snr_db(exact, before - exact),
        "iterations": float(steps[0]) / max(float(steps[1]), 1.0),
    }  # fmt: skip
    if timed:
        row["time"] = _time_ratio(volume, transfer, lamp, [lit.stepping, even.stepping])
    print(
        f"{volume.name:11}{function:8}{name:5} stated {row['stated_db']:5.1f}, measured {row['measured_db']:5.1f};"
        f" steps of even light {row['even_db']:5.1f}; iterations × {row['iterations']:.2f}"
        + (f", time × {row['time']:.2f}" if timed else ""),
        flush=True,
    )
    return row


def _fixed(way: Stepping) -> dict[str, Any]:
    return {"rule": way.rule, "quadrature": way.quadrature, "scale": way.scale}


def _time_ratio(volume: ScalarVolume, transfer: Any, lamp: Lamp, ways: list[Stepping]) -> float:
    """Processor time of the lit picture with the first stepping over that with the second one."""
    import mitsuba as mi

    view = View.around(volume, 30.0, 25.0, width=TIMED, height=TIMED)
    made = [LitScene.of(volume, transfer, lamp, view, **_fixed(way)) for way in ways]
    least = [np.inf] * len(made)
    for number in range(ROUNDS):
        for place, each in enumerate(made):
            start = time.process_time()
            np.array(mi.render(each.scene, spp=SAMPLES, seed=number))
            least[place] = min(least[place], time.process_time() - start)
    return least[0] / least[1]


def report(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Extremes and medians, and True if they meet the claims."""
    below = [ASKED_DB - row["measured_db"] for row in rows]
    figures: dict[str, Any] = {
        "cases": len(rows),
        "most_below_db": float(max(below)),
        "most_above_db": float(max(row["stated_db"] - row["measured_db"] for row in rows)),
        "most_better_db": float(max(row["measured_db"] - row["stated_db"] for row in rows)),
        "even_least_db": float(min(row["even_db"] for row in rows)),
        "even_median_db": float(np.median([row["even_db"] for row in rows])),
        "iterations_median": float(np.median([row["iterations"] for row in rows])),
        "iterations_most": float(max(row["iterations"] for row in rows)),
    }
    if "time" in rows[0]:
        figures["time_median"] = float(np.median([row["time"] for row in rows]))
        figures["time_most"] = float(max(row["time"] for row in rows))
    for name, value in figures.items():
        print(f"{name:20} {value:.2f}")
    return figures | {
        "holds": {
            "no lit picture is more than 1.5 dB below the wanted quality": figures["most_below_db"] <= 1.5,
            "the stated quality is at most 2 dB above the measured one": figures["most_above_db"] <= 2.0,
        }
    }
