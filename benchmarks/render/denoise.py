# SPDX-License-Identifier: GPL-3.0-or-later
"""Gain of denoising: the error of a denoised render against a noisy one of equal time.

A room under RGB light, under fluorescent tubes and under a sodium lamp, whose colors lie outside sRGB. The error is the
relative mean square error against a converged picture with another seed: (x - r)² / (r² + (mean r / 10)²). Each noisy
render gets as many samples as fit into the time of the denoised one, guides and filter included; programs are warm.
"brightness" is the mean of the denoised picture over the noisy one's; "unguided" is the error without albedo and
normals.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.render.render_noise import room_scene
from spectral_core.render import render_scene
from spectral_core.render.denoise import denoise
from spectral_core.scene import Color, Scene
from spectral_core.spectra import catalogue


def run(options: Options) -> dict[str, Any]:
    """Print the table and return it."""
    size, counts, converged = (96, (4, 16), 1024) if options.quick else (256, (4, 16, 64), 4096)
    lamps = {"RGB": Color([1.0, 0.9, 0.8]), "FL2": catalogue.illuminant("FL2"), "HP1": catalogue.illuminant("HP1")}
    print(f"{'lamp':4} {'samples':>7} {'seconds':>8} {'noisy at equal time':>26} {'denoised':>9} ", end="")
    print(f"{'unguided':>9} {'gain':>6} {'brightness':>10}")
    rows = []
    for name, lamp in lamps.items():
        scene = room_scene(size, lamp)
        reference = _timed(scene, converged, False, seed=5)[0]
        for is_denoised in (False, True):
            _timed(scene, 4, is_denoised)  # compiles
        for samples in counts:
            clean, seconds = _timed(scene, samples, True)
            raw, raw_seconds = _timed(scene, samples, False)
            # launches cost additional time: the number of samples that fits is found by trials
            equal, spent = samples, raw_seconds
            for _ in range(4):
                equal = max(samples, round(equal * min(seconds / spent, 8.0)))
                noisy, spent = _timed(scene, equal, False)
            row = {
                "lamp": name, "samples": samples, "seconds": seconds, "equal": equal, "equal_seconds": spent,
                "noisy": _error(noisy, reference), "denoised": _error(clean, reference),
                "unguided": _error(denoise(raw), reference),
                "brightness": float(clean.mean() / raw.mean()),
            }  # fmt: skip
            row["gain"] = row["noisy"] / row["denoised"]
            rows.append(row)
            at = f"{row['noisy']:.5f} ({equal}, {spent:.2f} s)"
            print(f"{name:4} {samples:7} {seconds:8.2f} {at:>26} {row['denoised']:9.5f} ", end="")
            print(f"{row['unguided']:9.5f} {row['gain']:5.2f}x {row['brightness']:10.4f}")
    figures = {"rows": rows, "least": min(counts)}
    return figures | {"holds": holds(figures)}


def holds(figures: dict[str, Any]) -> dict[str, bool]:
    """Claims of the documentation."""
    few = [row for row in figures["rows"] if row["samples"] == figures["least"]]
    return {
        "at few samples a denoised render has at most half the error of a noisy one that took as long": all(
            row["gain"] >= 2 for row in few
        ),
        "denoising changes the mean brightness by less than 1 %": all(
            abs(row["brightness"] - 1) < 0.01 for row in figures["rows"]
        ),
    }


def _timed(scene: Scene, samples: int, is_denoised: bool, seed: int = 1) -> tuple[np.ndarray, float]:
    film = replace(scene.film, samples=samples, seed=seed)
    # no tolerance: a difference between the plans of two renders would count as noise
    settings = replace(scene.settings, denoise=is_denoised, tolerance_delta_e=0.0)
    result = render_scene(replace(scene, film=film, settings=settings))
    return result.pixels[..., :3], result.seconds


def _error(pixels: np.ndarray, reference: np.ndarray) -> float:
    x, r = pixels.astype(np.float64), reference.astype(np.float64)
    return float((np.square(x - r) / (np.square(r) + np.square(r.mean() / 10))).mean())
