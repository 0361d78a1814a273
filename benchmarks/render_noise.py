# SPDX-License-Identifier: GPL-3.0-or-later
"""Noise of a picture against samples and time, ours and Mitsuba's own path tracer on the same scene.

The noise is the root mean square difference of two seeds over √2, relative to the mean. Ours draws stratified numbers
and wavelengths by observer and light; Mitsuba's ``mi.render`` (its perspective camera, film and independent sampler)
is what one gets without. Renders are interleaved, after a first of each that compiles.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from spectral_core.render.trace.scalar_sums import ScalarSums

from benchmarks import Options
from spectral_core.render.job import RenderJob
from spectral_core.render.plan.effects import plan_effects
from spectral_core.render.trace.wavelengths import plan_wavelengths
from spectral_core.scene import (
    AreaLight,
    Camera,
    Color,
    Diffuse,
    Film,
    Instance,
    Material,
    Mesh,
    RenderSettings,
    Scene,
    World,
)
from spectral_core.spectra import catalogue


def run(options: Options) -> dict[str, Any]:
    """Print the table and return it."""
    size, counts = (32, (4, 16)) if options.quick else (128, (4, 16, 64))
    figures: dict[str, Any] = {}
    print(
        f"{'scene':24} {'samples':>7} {'ours':>8} {'Mitsuba':>8} {'fewer samples':>13} {'ours s':>7} {'Mitsuba s':>9}"
    )
    for name, scene in _scenes(size).items():
        for renderer in (_ours, _mitsuba):
            renderer(scene, counts[0], 0)
        for samples in counts:
            row = _row(scene, samples)
            figures[f"{name}, {samples}"] = row
            print(
                f"{name:24} {samples:7} {row['ours']:8.3%} {row['mitsuba']:8.3%} "
                f"{row['sample_ratio']:12.1f}x {row['ours_s']:7.2f} {row['mitsuba_s']:9.2f}"
            )
    return figures


def _row(scene: Scene, samples: int) -> dict[str, float]:
    ours, mitsuba = _noise(_ours, scene, samples), _noise(_mitsuba, scene, samples)
    return {
        "ours": ours[0],
        "mitsuba": mitsuba[0],
        "sample_ratio": (mitsuba[0] / ours[0]) ** 2,
        "ours_s": ours[1],
        "mitsuba_s": mitsuba[1],
    }


def _noise(renderer: Callable[[Scene, int, int], np.ndarray], scene: Scene, samples: int) -> tuple[float, float]:
    start = time.perf_counter()
    first, second = (renderer(scene, samples, seed) for seed in (1, 2))
    seconds = (time.perf_counter() - start) / 2
    return float(np.sqrt(np.square(first - second).mean() / 2) / first.mean()), seconds


def _ours(scene: Scene, samples: int, seed: int) -> np.ndarray:
    from dataclasses import replace

    job = RenderJob(replace(scene, film=replace(scene.film, seed=seed)), plan_effects(scene))
    job.trace(samples)
    return job.picture()[..., :3].astype(np.float64)


def _mitsuba(scene: Scene, samples: int, seed: int) -> np.ndarray:
    """The same loaded scene by ``mi.render``, with its film measuring the same three responses."""
    import mitsuba as mi

    plan = plan_effects(scene)
    job = RenderJob(scene, plan)
    uniform = plan_wavelengths([]) if plan.is_spectral else None
    sums = ScalarSums(mi, scene.camera, scene.film, uniform)
    sums.samples = seed * 1000
    kept = sums.samples
    for _ in sums.add(job._first_hit, next(iter(job._integrators.values())), samples):
        pass
    return sums.picture()[..., :3].astype(np.float64) * (kept + samples) / samples


def _scenes(size: int) -> dict[str, Scene]:
    rgb = _room(size, Color([1.0, 0.9, 0.8]))
    return {
        "room, RGB": rgb,
        "room, D65": _room(size, catalogue.illuminant("D65")),
        "room, sodium": _room(size, catalogue.illuminant("HP1")),
    }


def _room(size: int, lamp: Any) -> Scene:
    """A floor, a wall and a block under one soft lamp."""
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
    fan = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    wall = np.eye(4)
    wall[:3, :3] = np.array([[4, 0, 0], [0, 0, -1], [0, 4, 0]])
    wall[:3, 3] = (0, 3, 2)
    block = np.diag([0.7, 0.7, 1.0, 1.0])
    block[:3, 3] = (0.3, 0.5, 1.0)
    above = np.eye(4)
    above[:3, 3] = (-1.5, 0, 4)
    tilted = np.eye(4)
    turn = 1.1
    tilted[1:3, 1:3] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    tilted[:3, 3] = (0, -7, 4.5)
    return Scene(
        camera=Camera(world_from_camera=tilted, field_of_view_rad=0.7),
        film=Film(size, size, filter_kind="box", filter_width=1.0),
        meshes=(Mesh("square", square, fan),),
        materials=(
            Material("gray", Diffuse(Color([0.5, 0.45, 0.4]))),
            Material("red", Diffuse(Color([0.6, 0.1, 0.1]))),
        ),
        instances=(
            Instance("floor", "square", np.diag([4.0, 4.0, 1.0, 1.0]), ("gray",)),
            Instance("wall", "square", wall, ("red",)),
            Instance("block", "square", block, ("gray",)),
        ),
        lights=(AreaLight(name="lamp", world_from_light=above, power_w=200, size=(1.5, 1.5), color=lamp),),
        world=World(Color([0.0, 0.0, 0.0])),
        settings=RenderSettings(max_bounces=4),
    )
