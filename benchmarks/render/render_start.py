# SPDX-License-Identifier: GPL-3.0-or-later
"""Time to the first pixels of a renderer that starts and of one that runs, of many materials, and of the demo.

The clock runs in this process, around a ``RenderProcess``: from the call (for a cold renderer: from before its process
starts) to the first picture that arrives. Kernels are kept on disk between processes; ``cold`` finds the one of its
scene there, ``cold, first ever`` starts with an empty folder. Materials differ in numbers, or in their node graphs
(20 and 200 of them); one is a mix of 120 Principled leaves; the demo's set is shown in spectral transport. The load of
the machine is printed, as these are seconds. ``--only start`` (numbers, few, graphs, leaves, demo) runs one part.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.render.cases.meshes import at, sphere, square
from spectral_core.errors import UnknownNameError
from spectral_core.render import RenderProcess
from spectral_core.scene import (
    AddSurface,
    Camera,
    Color,
    Computed,
    Diffuse,
    Film,
    Glossy,
    Instance,
    Material,
    Metal,
    MixSurface,
    PointLight,
    Principled,
    RenderSettings,
    Scene,
    Translucent,
    World,
    gray,
)
from spectral_core.scene.shading import Builder

OPTIONS = ("--only PART",)
PARTS = ("start", "numbers", "few", "graphs", "leaves", "demo")
WARM_S, COLD_S, MATERIALS_S, AGAIN_S = 0.3, 3.0, 10.0, 0.5
"""Seconds of the acceptance, on a quiet machine."""
FEW, LEAVES = 20, 120
LIMIT_S = 120.0
"""Limit for the time of a first picture; after it the printed time is a lower bound."""


def run(options: Options) -> dict[str, Any]:
    """Print seconds and the machine's load, and return them."""
    only = options.word("--only", "") or None
    if only not in (None, *PARTS):
        raise UnknownNameError.among("part", only, PARTS)
    count, repeats = (20, 1) if options.quick else (200, 3)
    print(f"load average {_load():.1f} on {os.cpu_count()} cores, {count} materials, median of {repeats}")
    figures: dict[str, Any] = {"load": _load(), "materials": count, "seconds": {}}
    rng = np.random.default_rng(3)
    found: dict[str, list[float]] = {}

    def took(name: str, seconds: float) -> None:
        found.setdefault(name, []).append(seconds)
        print(f"  {name}: {seconds:.2f} s", flush=True)

    plain = numbers(4, rng)
    for _ in range(repeats if only in (None, "start") else 0):
        with _no_kernels(), RenderProcess() as process:
            took("cold, first ever", _first_pixels(process, plain))
        with RenderProcess() as process:
            _first_pixels(process, plain)  # its kernels are on disk from now on
        with RenderProcess() as process:
            took("cold", _first_pixels(process, plain))
            took("warm, same scene", _first_pixels(process, plain))
            took("warm, other numbers", _first_pixels(process, numbers(4, rng)))
    scenes: dict[str, Callable[[], Scene | None]] = {
        "numbers": lambda: numbers(count, rng),
        "few": lambda: graphs(FEW, rng),
        "graphs": lambda: graphs(count, rng),
        "leaves": lambda: leaves(LEAVES, rng),
        "demo": demo,
    }
    for kind, build in scenes.items():
        for _ in range((repeats if kind == "numbers" else 1) if only in (None, kind) else 0):
            scene = build()
            if scene is None:
                print("  the demo needs bpy, which is not installed")
                continue
            with _no_kernels(), RenderProcess() as process:
                _first_pixels(process, plain)  # the renderer is warm, these materials are new to it
                first = _first_pixels(process, scene)
                took(f"{kind}, first picture", first)
                for _ in range(3 if first < LIMIT_S else 0):
                    scene = changed(scene, rng)
                    took(f"{kind}, after one number changed", _first_pixels(process, scene))
    for name, seconds in found.items():
        figures["seconds"][name] = float(np.median(seconds))
        each = ", ".join(f"{value:.2f}" for value in seconds)
        print(f"{name:34} {np.median(seconds):7.2f} s  ({each})")
    figures["load_after"] = _load()
    print(f"load average afterward {_load():.1f}")
    figures["holds"] = holds(figures)
    return figures


def holds(figures: dict[str, Any]) -> dict[str, bool]:
    """Acceptance of the parts that ran, which assumes a quiet machine: parts that fail under load are reported as
    failed.
    """
    seconds = figures["seconds"]
    count = figures["materials"]
    limits = {
        "warm, other numbers": (f"first pixel of a warm renderer under {WARM_S} s", WARM_S),
        "cold": (f"first pixel of a cold renderer under {COLD_S} s", COLD_S),
        "cold, first ever": (f"first pixel of a renderer that never ran here under {COLD_S} s", COLD_S),
    }
    kinds = {
        "numbers": f"{count} materials of different numbers",
        "few": f"{FEW} materials of different graphs",
        "graphs": f"{count} materials of different graphs",
        "leaves": f"a mix of {LEAVES} leaves",
        "demo": "the demo in spectral transport",
    }
    for kind, words in kinds.items():
        limits[f"{kind}, first picture"] = (f"{words} under {MATERIALS_S:g} s", MATERIALS_S)
        limits[f"{kind}, after one number changed"] = (f"{words} again under {AGAIN_S} s", AGAIN_S)
    claims = {words: seconds[name] < limit for name, (words, limit) in limits.items() if name in seconds}
    for kind in kinds:
        if seconds.get(f"{kind}, first picture", 0.0) >= LIMIT_S:
            claims[limits[f"{kind}, after one number changed"][0]] = False
    return claims


def numbers(count: int, rng: np.random.Generator) -> Scene:
    """Balls of Principled materials that differ in color and roughness."""
    return _balls([Principled(Color(rng.uniform(0.1, 0.9, 3)), roughness=float(rng.random())) for _ in range(count)])


def graphs(count: int, rng: np.random.Generator) -> Scene:
    """Balls whose materials are built from different closures and different node programs, no two alike."""
    return _balls([_graph(number, rng) for number in range(count)])


def leaves(count: int, rng: np.random.Generator) -> Scene:
    """A ball whose material is a chain of mixes of as many Principled leaves."""
    surface: Any = Principled(Color(rng.uniform(0.1, 0.9, 3)), roughness=0.5)
    for _ in range(count - 1):
        leaf = Principled(Color(rng.uniform(0.1, 0.9, 3)), roughness=float(rng.uniform(0.1, 1)), coat_weight=0.3)
        surface = MixSurface(float(rng.uniform(0.01, 0.1)), surface, leaf)
    return _balls([surface])


def demo() -> Scene | None:
    """The demo's set as the viewport shows it first; None without Blender."""
    try:
        import bpy
    except ImportError:
        return None
    from blender_addon import registration
    from blender_addon.translate.scene import translate_scene
    from examples.demo import still_life

    bpy.ops.wm.read_factory_settings(use_empty=True)
    registration.register_once()
    still_life.build(bpy)
    scene = translate_scene(bpy.context.evaluated_depsgraph_get())
    film, settings = scene.film, replace(scene.settings, transport="spectral")
    small = replace(film, width=90, height=max(1, round(90 * film.height / film.width)), samples=1)
    return replace(scene, film=small, settings=settings)


def changed(scene: Scene, rng: np.random.Generator) -> Scene:
    """The scene with one number of one material changed."""
    materials = list(scene.materials)
    plain = {Principled: "roughness", MixSurface: "factor"}
    numbers_of = [getattr(m.surface, plain.get(type(m.surface), ""), None) for m in materials]
    places = [k for k, value in enumerate(numbers_of) if isinstance(value, float)]
    place = int(rng.choice(places))
    amount = float(rng.uniform(0.2, 0.8))
    surface = materials[place].surface
    if isinstance(surface, Principled):
        surface = replace(surface, roughness=amount)
    elif isinstance(surface, MixSurface):
        surface = replace(surface, factor=amount)
    materials[place] = replace(materials[place], surface=surface)
    return replace(scene, materials=tuple(materials))


def _graph(number: int, rng: np.random.Generator) -> Any:
    """A mix of leaves by the digits of ``number``, one of them with a program of its own."""
    paint = Computed(_program(number, rng))
    leaves = (
        Diffuse(paint),
        Glossy(paint, 0.3),
        Metal(paint, gray(0.8), 0.4),
        Translucent(paint),
        Principled(paint, coat_weight=0.5),
    )
    first, second = leaves[number % 5], leaves[number // 5 % 5]
    if number // 25 % 2:
        second = AddSurface(second, Diffuse(Color(rng.uniform(0, 0.2, 3))))
    return MixSurface(float(rng.uniform(0.2, 0.8)), first, second)


def _program(number: int, rng: np.random.Generator) -> Any:
    """Noise over the place, then arithmetic whose order of operations is ``number`` written in base 3."""
    build = Builder()
    place = build.add("vector_input", (), "position", 0)
    rest = (0.0, float(rng.uniform(1, 5)), 1.0, 0.5, 2.0, 0.0, 1.0, 0.0)
    value = build.add("noise_color", (place, *map(build.number, rest)), "FBM", True, "3D")
    for _ in range(5):  # digits of the number in base 3: 243 programs of different order
        number, digit = divmod(number, 3)
        if digit == 0:
            value = build.add("invert", (build.number(float(rng.random())), value))
        elif digit == 1:
            value = build.add("gamma", (value, build.number(float(rng.uniform(0.5, 2)))))
        else:
            value = build.add("bright_contrast", (value, build.number(0.1), build.number(float(rng.random()))))
    return build.program(value)


def _balls(surfaces: list[Any]) -> Scene:
    """One ball per surface on a floor, under a lamp."""
    side = int(np.ceil(np.sqrt(len(surfaces))))
    lamp = PointLight(name="lamp", world_from_light=at(0, -side, 2 * side), power_w=200.0 * side**2)
    eye = at(0, -2.5 * side, 2.5 * side, turn=("x", 45))
    places = [at(2.2 * (k % side - side / 2), 2.2 * (k // side - side / 2), 1) for k in range(len(surfaces))]
    balls = tuple(Instance(f"ball {k}", "sphere", place, (f"paint {k}",)) for k, place in enumerate(places))
    return Scene(
        camera=Camera(world_from_camera=eye, field_of_view_rad=0.8),
        film=Film(96, 64, samples=1),
        meshes=(square(), sphere(16)),
        materials=(
            Material("floor", Diffuse(gray(0.5))),
            *(Material(f"paint {k}", surface) for k, surface in enumerate(surfaces)),
        ),
        instances=(Instance("floor", "square", at(scale=(3.0 * side,) * 3), ("floor",)), *balls),
        lights=(lamp,),
        world=World(gray(0.1)),
        settings=RenderSettings(transport="rgb"),
    )


def _first_pixels(process: RenderProcess, scene: Scene) -> float:
    """Seconds from the call to the first picture."""
    arrived: list[float] = []
    start = time.perf_counter()
    process.render(
        scene,
        on_progress=lambda _: arrived.append(time.perf_counter()),
        should_stop=lambda: time.perf_counter() - start > LIMIT_S,
    )
    return (arrived[0] if arrived else time.perf_counter()) - start


@contextmanager
def _no_kernels() -> Iterator[None]:
    """An empty folder of kernels for the processes that are started meanwhile."""
    name = "DRJIT_CACHE_DIR"
    before = os.environ.get(name)
    with tempfile.TemporaryDirectory() as folder:
        os.environ[name] = folder
        try:
            yield
        finally:
            del os.environ[name]
            if before is not None:
                os.environ[name] = before


def _load() -> float:
    return float(os.getloadavg()[0])
