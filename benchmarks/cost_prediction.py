# SPDX-License-Identifier: GPL-3.0-or-later
"""Predicted against true time and error: a plain render, a requested error, a requested time, on 16 different scenes.

True errors are mean ΔE2000 against a converged picture with other random numbers and all effects;
its own noise is subtracted. Times are compared in seconds of the processor (work), which other programs on
the machine do not change; elapsed times are printed beside. ``--only WORD``: scenes whose name has it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import Options
from benchmarks._plan_scenes import SINGLE, staged
from spectral_core.render import cost_curve, render_scene
from spectral_core.render.cost.errors import pixel_errors
from spectral_core.render.job import RenderJob
from spectral_core.render.plan.effects import plan_from_data
from spectral_core.scene import Scene
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb

OPTIONS = ("--only",)
NAMES = (
    "room", "wall", "sodium", "fluorescent", "measured paints", "lens", "sky", "sky image", "emissive", "curtain",
    "ball lamp", "lamp before lamp", "mirror", "mirror caustic", "glass caustic", "leaf",
)  # fmt: skip
ASKED = 1.0


def run(options: Options) -> dict[str, Any]:
    """Print the table and return it."""
    size, samples, converged = ((24, 18), 8, 128) if options.quick else ((160, 120), 32, 2048)
    budget = 4.0 if options.quick else 20.0
    wanted = options.extra[1] if options.extra[:1] == ["--only"] else ""
    names = [name for name in NAMES if wanted in name][: 2 if options.quick else None]
    print(
        f"{'scene':18} {'plain: predicted, true; work':>32} {'':22} {'ΔE 1 asked: said, true; work':>32} "
        f"{'asked s':>8} {'taken':>7}"
    )
    rows = {name: _row(name, staged(SINGLE[name], size, 1.0)[0], (samples, converged, budget)) for name in names}
    ratio = lambda row, what: max(row[what][0] / row[what][1], row[what][1] / row[what][0])  # noqa: E731
    worst = [max(ratio(row, "error"), ratio(row, "work")) for row in rows.values()]
    near = sum(each <= 1.25 for each in worst)
    return {
        "scenes": rows,
        "holds": {
            "time and error within 25 % in 13 of 16": near >= np.ceil(13 / 16 * len(rows)),
            "none off by more than a factor of 2": max(worst) <= 2,
            "ΔE 1 asked: 0.7 to 1.1": all(0.7 <= row["asked_error"][1] <= 1.1 for row in rows.values()),
            "time budget within 10 %": all(abs(row["budget_s"] / budget - 1) <= 0.1 for row in rows.values()),
        },
    }


def _row(name: str, scene: Scene, amounts: tuple[int, int, float]) -> dict[str, Any]:
    samples, converged, budget = amounts
    scene = replace(scene, film=replace(scene.film, samples=samples))
    halves = _converged(scene, converged)
    asked = lambda **what: replace(scene, settings=replace(scene.settings, **what))  # noqa: E731
    said = cost_curve(scene).now
    plain = render_scene(scene)
    by_error = render_scene(asked(target_error=ASKED))
    by_time = render_scene(asked(time_budget_s=budget))
    row = {
        "error": (said.delta_e, _error(plain.pixels, halves)),
        "seconds": (said.seconds, plain.seconds),
        "work": (said.work, plain.work),
        "asked_error": (by_error.outcome.delta_e if by_error.outcome else 0.0, _error(by_error.pixels, halves)),
        "asked_work": (by_error.prediction.work if by_error.prediction else 0.0, by_error.work),
        "samples": by_error.samples,
        "budget_s": by_time.seconds,
    }
    pair = lambda what, unit: f"{row[what][0]:6.2f}, {row[what][1]:6.2f}{unit}"  # noqa: E731
    print(
        f"{name:18} {'ΔE ' + pair('error', '') + '; ' + pair('work', ' s'):>32} ({pair('seconds', ' s')} wall) "
        f"{pair('asked_error', ''):>14} ({pair('asked_work', ' s')}) {budget:8.1f} {by_time.seconds:7.1f}",
        flush=True,
    )
    return row


def _converged(scene: Scene, samples: int) -> NDArray[np.float64]:
    """(2, pixels, 3): two halves of a picture with all effects."""
    far = replace(scene.settings, overrides=(*scene.settings.overrides, ("bounces", "64")))
    full = replace(scene, settings=far, film=replace(scene.film, seed=4711))
    width, height = scene.film.size
    numbers = np.arange(width * height)
    tracer = RenderJob(full, plan_from_data(full, 0.0)).chosen_pixels()
    none, more = np.zeros_like(numbers), np.full_like(numbers, samples)
    return np.stack([tracer.trace(numbers, none, more, half).colors / samples for half in (0, 1)])


def _error(pixels: NDArray[np.float32], halves: NDArray[np.float64]) -> float:
    """Mean ΔE2000 relative to the limit; the noise of the converged picture is subtracted in quadrature."""
    seen = pixels[..., :3].reshape(-1, 3).astype(np.float64)
    lab = [lab_from_linear_rgb(np.maximum(each, 0.0)) for each in (seen, halves.mean(axis=0))]
    noise = pixel_errors(halves[0], halves[1])
    return float(np.sqrt(max(0.0, float(delta_e_2000(*lab).mean()) ** 2 - float(noise.mean()) ** 2)))
