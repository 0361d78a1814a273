# SPDX-License-Identifier: GPL-3.0-or-later
"""Cost of spectral transport against RGB at equal noise: a room under smooth and line lamps, and with palettes.

The palettes are those of ``examples``, solved: one of their lights, and two reflectances. ``--fresh COUNT``: as many
palettes drawn at random (from ``--seed N`` on) instead, with the last of their lights, which is designed. Each room is
rendered in both transports: RGB transport sees the colors of lamp and surfaces. The noise is the variance between seeds
of linear sRGB, relative to the squared mean of the picture. It falls as one over time, so the ratio of times at equal
noise is the ratio of variances times that of work. Work is seconds of the processor while paths are traced, which
neither other programs nor the loading of a scene change much; its median over the repetitions is taken. Renders are
interleaved, after a first of each that compiles.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks import ROOT, Options
from benchmarks.palette.palette_joint import generated_palette
from spectral_core.palette import PaletteProblem, solve_palette
from spectral_core.palette.files import read_palette
from spectral_core.render.cost.work import Meter
from spectral_core.render.job import RenderJob
from spectral_core.render.plan.effects import plan_effects
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

OPTIONS = ("--fresh N", "--seed N")
EXAMPLES = ROOT / "examples"
SMOOTH, LINES = ("D65", "A", "E"), ("HP1", "FL11", "FL2")
"""Lamps of the catalogue by the type of their spectra."""
DESIGNED = (("hidden_mark", 0), ("hidden_mark", 1), ("gallery_lights", 1), ("split_light", 0), ("most_distinct", 0))
"""Palettes in ``examples``, and the number of one of their lights."""


def run(options: Options) -> dict[str, Any]:
    """Print the table and return it."""
    size, samples, repeats = (64, 16, 6) if options.quick else (128, 64, 4)
    fresh, options = options.number("--fresh", 0)
    seed, options = options.number("--seed", 1)
    scenes: dict[tuple[str, str], Scene] = {}
    rooms = {name: room_scene(size, catalogue.illuminant(name)) for name in (*SMOOTH, *LINES)}
    if fresh:
        palettes = {f"palette {k}": (generated_palette(k), -1) for k in range(int(seed), int(seed + fresh))}
    else:
        palettes = {f"{name} {k + 1}": (read_palette(EXAMPLES / f"{name}.toml"), k) for name, k in DESIGNED}
    rooms |= {name: _designed(size, *palette) for name, palette in palettes.items()}
    for name, scene in rooms.items():
        for transport in ("rgb", "spectral"):
            scenes[name, transport] = replace(scene, settings=replace(scene.settings, transport=transport))
    spent: dict[tuple[str, str], list[float]] = {key: [] for key in scenes}
    variance: dict[tuple[str, str], list[float]] = {key: [] for key in scenes}
    for scene in scenes.values():
        _traced(scene, samples, 0)
    for repeat in range(repeats):
        for key, scene in scenes.items():
            (first, work), (second, again) = (_traced(scene, samples, 2 * repeat + k) for k in (1, 2))
            spent[key] += [work, again]
            variance[key].append(float(np.square(first - second).mean() / 2 / first.mean() ** 2))
    figures: dict[str, Any] = {}
    print(f"{'lamp':17} {'noise':>8} {'of RGB':>8} {'variance':>9} {'work':>6} {'time to the noise of RGB':>25}")
    for name in rooms:
        ours, rgb = ((np.mean(variance[key]), np.median(spent[key])) for key in ((name, "spectral"), (name, "rgb")))
        quiet, work = float(ours[0] / rgb[0]), float(ours[1] / rgb[1])
        figures[name] = {
            "noise": float(np.sqrt(ours[0])), "rgb_noise": float(np.sqrt(rgb[0])), "variance": quiet, "work": work,
            "ratio": quiet * work,
        }  # fmt: skip
        print(
            f"{name:17} {np.sqrt(ours[0]):8.3%} {np.sqrt(rgb[0]):8.3%} {quiet:8.2f}x {work:5.2f}x {quiet * work:24.2f}x"
        )
    designed = [name for name in rooms if name not in (*SMOOTH, *LINES)]
    for label, names in (("smooth", SMOOTH), ("lines", LINES), ("designed", designed)):
        figures[label] = float(np.median([figures[name]["ratio"] for name in names]))
    print("median: " + ", ".join(f"{label} {figures[label]:.2f}" for label in ("smooth", "lines", "designed")))
    return figures | {"holds": holds(figures)}


def holds(figures: dict[str, Any]) -> dict[str, bool]:
    """Claims of the documentation."""
    return {
        "smooth lamps cost at most 1.3 times RGB": figures["smooth"] <= 1.3,
        "line lamps cost at most 1.5 times RGB": figures["lines"] <= 1.5,
        "designed spectra cost at most 1.5 times RGB": figures["designed"] <= 1.5,
    }


def _traced(scene: Scene, samples: int, seed: int) -> tuple[np.ndarray, float]:
    """A picture, and the processor's seconds for its paths."""
    scene = replace(scene, film=replace(scene.film, seed=seed))
    job = RenderJob(scene, plan_effects(scene, pilot=False))
    meter = Meter()
    job.trace(samples)
    return job.picture()[..., :3].astype(np.float64), meter.read().work


def _designed(size: int, problem: PaletteProblem, number: int) -> Scene:
    """The room under a light of a palette, with the first and the last of its reflectances."""
    solution = solve_palette(problem)
    scene = room_scene(size, solution.illuminants[number])
    looks = (solution.reflectances[0], solution.reflectances[-1])
    materials = zip(scene.materials, looks, strict=True)
    return replace(scene, materials=tuple(replace(item, surface=Diffuse(look)) for item, look in materials))


def room_scene(size: int, lamp: Any) -> Scene:
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
