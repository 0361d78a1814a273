# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders against formulas (furnaces, slab, thin films, prism, lamps), and hard scenes whose bad pixels are counted.

A furnace: a white surface in a white world gives back at most what reaches it, at every roughness and angle. What a
formula says is computed beside the renderer, with no code of it. ``--only furnace`` (slab, absorption, prism, lamps,
thin-film, fluorescence, hard) runs one part.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.render.checks.closed_cases import CASES
from benchmarks.render.checks.closed_forms import true_slab
from benchmarks.render.checks.fluorescent_forms import energy_returned
from benchmarks.render.checks.furnace_scenes import ANGLES, BALLS, ROUGHNESS, SURFACES, ball_albedo, tile_albedos
from benchmarks.render.checks.hard_more import more_hard_scenes
from benchmarks.render.checks.hard_renders import hard_scenes
from spectral_core.errors import UnknownNameError

OPTIONS = ("--only GROUP…",)
ROUNDING = 0.001
"""Energy that 32-bit numbers may add, beside noise."""


def run(options: Options) -> dict[str, Any]:
    """Print tables and return figures."""
    only = " ".join(options.extra[options.extra.index("--only") + 1 :]) if "--only" in options.extra else None
    if only is not None and only not in (known := ("furnace", *CASES, "slab", "fluorescence", "hard")):
        raise UnknownNameError.among("group of cases", only, dict.fromkeys(known))
    samples = 64 if options.quick else 1024
    figures: dict[str, Any] = {}
    if only in (None, "furnace"):
        figures["furnace"] = _furnace(samples, ("rgb",) if options.quick else ("rgb", "spectral"))
    for name, (compare, words) in CASES.items():
        if only in (None, name):
            found = list(compare(samples, "rgb"))
            worst = max(found, key=lambda each: (not each.agrees, each.error))
            beyond = [each.case for each in found if not each.agrees]
            mean = float(np.mean([each.error for each in found]))
            print(
                f"{name:11} {words}: {len(found)} compared, mean error {mean:.3%}, {len(beyond)} beyond noise and 0.5 %"
            )
            print(f"{'':11} worst {worst.case}: {worst.measured:.5f} for {worst.expected:.5f}, noise {worst.noise:.5f}")
            figures[name] = {"count": len(found), "mean_error": mean, "beyond": beyond, "worst_error": worst.error}
    if only in (None, "slab"):
        figures["polarization"] = _polarization()
    if only in (None, "fluorescence"):
        share, noise = energy_returned(samples)
        bound = 0.999 * 405 / 520
        print(f"{'':11} power that a dye of quantum yield 1 returns: {share:.4f} ± {noise:.4f}, of photons {bound:.4f}")
        figures["fluorescent_energy"] = share
    if only in (None, "hard"):
        figures["hard"] = _hard(options.quick)
    figures["holds"] = holds(figures)
    return figures


def holds(figures: dict[str, Any]) -> dict[str, bool]:
    """Acceptance, of the parts that ran."""
    claims = {}
    if "furnace" in figures:
        claims[
            f"energy at most 1 (+ {ROUNDING:g} and noise) over all closures, {len(ROUGHNESS)} roughnesses"
        ] = not figures["furnace"]["above"]
    for name in CASES:
        if name in figures:
            claims[f"{name} as its formula says"] = not figures[name]["beyond"]
    if "fluorescent_energy" in figures:
        claims["a fluorescent surface returns at most what comes"] = figures["fluorescent_energy"] <= 1 + ROUNDING
    if "hard" in figures:
        claims["no NaN or Inf pixel over the hard scenes"] = figures["hard"]["bad_pixels"] == 0
        claims["no lost sample over the hard scenes"] = figures["hard"]["lost_samples"] == 0
    return claims


def _furnace(samples: int, transports: tuple[str, ...]) -> dict[str, Any]:
    print(f"{'white furnace':40} {'':8} {'most':>7} ± noise  {'roughness':>9} {'angle':>6} {'least':>7}")
    above, largest, lost = [], 0.0, 0
    for transport in transports:
        for name, make in SURFACES.items():
            albedo, noise, missing = tile_albedos(make, samples, transport)
            mean, error = albedo.mean(axis=-1), noise.mean(axis=-1)
            row, column = np.unravel_index(np.argmax(mean - 3 * error), mean.shape)
            most, spread = float(mean[row, column]), float(error[row, column])
            angle = f"{ANGLES[column % len(ANGLES)]:.0f}°{' back' if column >= len(ANGLES) else ''}"
            least = float(mean.min())
            print(f"{name:40} {transport:8} {most:7.4f} {spread:.4f}  {ROUGHNESS[row]:9} {angle:>8} {least:7.4f}")
            largest, lost = max(largest, most), lost + missing
            if most > 1 + ROUNDING + 4.5 * spread:
                above.append(f"{name}, {transport}: {most:.4f}")
    for name, surface in BALLS.items():
        most, spread, missing = ball_albedo(surface, max(samples // 4, 16), "rgb")
        print(f"{name:40} {'rgb':8} {most:7.4f} {spread:.4f}  a ball")
        largest, lost = max(largest, most), lost + missing
        if most > 1 + ROUNDING + 4.5 * spread:
            above.append(f"{name}: {most:.4f}")
    print(f"largest energy {largest:.4f}; above 1 by more than {ROUNDING:g} and noise: {', '.join(above) or 'none'}")
    return {"largest": largest, "above": above, "lost_samples": lost}


def _polarization() -> dict[str, float]:
    """Error of ignoring polarization: through a sheet of index 1.5."""
    found = {}
    for degrees in (30.0, 60.0, 80.0):
        sine, index = np.sin(np.radians(degrees)), 1.5
        outside, inside = np.sqrt(1 - sine**2), np.sqrt(1 - (sine / index) ** 2)
        face = ((outside - index * inside) / (outside + index * inside)) ** 2
        face = (face + ((index * outside - inside) / (index * outside + inside)) ** 2) / 2
        found[f"{degrees:.0f}°"] = float((1 - face) / (1 + face) - true_slab(index, degrees))
    words = ", ".join(f"{value:+.4f} at {angle}" for angle, value in found.items())
    print(f"{'':11} light without polarization, against nature, through a sheet: {words}")
    return found


def _hard(quick: bool) -> dict[str, Any]:
    from spectral_core.render.job import RenderJob
    from spectral_core.render.plan.effects import plan_effects

    bad = lost = scenes = 0
    for transport in ("rgb", "spectral"):
        for name, scene in (*hard_scenes(), *more_hard_scenes()):
            settings = replace(scene.settings, transport=transport)
            scene = replace(scene, settings=settings, film=replace(scene.film, samples=4 if quick else 64))
            job = RenderJob(scene, plan_effects(scene, pilot=False))
            job.trace(scene.film.samples)
            pixels = job.picture()
            wrong = int((~np.isfinite(pixels).all(axis=-1)).sum())
            missing = sum(int(n.message.split()[0]) for n in job.notes if "not finite numbers" in n.message)
            bad, lost, scenes = bad + wrong, lost + missing, scenes + 1
            if wrong or missing:
                print(f"hard: {name}, {transport}: {wrong} NaN or Inf pixels, {missing} lost samples")
    print(f"hard: {scenes} scenes, {bad} NaN or Inf pixels, {lost} lost samples")
    return {"scenes": scenes, "bad_pixels": bad, "lost_samples": lost}
