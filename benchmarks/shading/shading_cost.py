# SPDX-License-Identifier: GPL-3.0-or-later
"""Cost of node trees: kernels compiled by edits of numbers, time of a recorded pass, textures against a constant color.

Arguments run one part: ``edits`` (200 materials of different graphs in a live view: launches recorded and kernels
compiled after edits of numbers of trees, lamps, world and camera, and the times of recorded launches) and ``textures``
(processor time per sample of noise, a ramp and both over a constant color, and of plain colors over Mitsuba's own path
tracer). Ratios are those of processor times of one run, in which the cases take turns: a busy machine slows all alike.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.render.cases.meshes import at, sphere, square
from benchmarks.render.render_start import graphs
from benchmarks.viewport.cases.latency_counts import counted
from spectral_core.errors import UnknownNameError
from spectral_core.render.job import RenderJob
from spectral_core.render.live.picture import ViewPicture
from spectral_core.render.live.stage import Stage
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.render.mitsuba_export import write_mitsuba
from spectral_core.render.plan.effects import plan_effects
from spectral_core.scene import (
    Camera,
    Color,
    Computed,
    Diffuse,
    Film,
    Instance,
    Material,
    PointLight,
    RenderSettings,
    Scene,
    World,
    gray,
)
from spectral_core.scene.shading import Builder

WORDS = "PART…"
PARTS = ("edits", "textures")
MATERIALS = 200
TEXTURE_RATIO = 2.2
"""Most processor time per sample of a textured scene over that of constant colors, of the acceptance."""
RECORD_S, REPLAY_S = 0.2, 0.1
"""Limits of a launch that is recorded and of one that is replayed, on a quiet machine."""
ROUNDS = 5
MITSUBA = "constant, in Mitsuba"


def run(options: Options) -> dict[str, Any]:
    """Print counts, times and ratios, and return them."""
    figures: dict[str, Any] = {"holds": {}}
    for word in options.extra:
        if word not in PARTS:
            raise UnknownNameError.among("part", word, PARTS)
    for part in options.extra or PARTS:
        {"edits": _edits, "textures": _textures}[part](options, figures)
    return figures


def _edits(options: Options, figures: dict[str, Any]) -> None:
    """Counts of a live view of materials of different graphs, and times of its launches."""
    count = 12 if options.quick else MATERIALS
    rounds = 2 if options.quick else 4
    for transport in ("rgb", "spectral"):
        scene = graphs(count, np.random.default_rng(5))
        scene = replace(scene, settings=replace(scene.settings, transport=transport))
        found = counted(scene, CHANGES, {"camera": _viewpoint}, rounds)
        for kind, counts in found.items():
            name, hows = f"edits, {transport}, {kind}", sorted(set(counts.how))
            figures[name] = {"first": counts.first, "later": counts.later, "how": hows}
            recorded, kernels = (counts.first[k] + counts.later[k] for k in (0, 1))
            print(
                f"edits    {transport:9} {kind:24} {rounds} edits of {count} materials: "
                f"{recorded} launches recorded, {kernels} kernels compiled; {', '.join(hows) or 'only the view'}"
            )
            figures["holds"][f"{name}: nothing is compiled"] = kernels == 0
        figures[f"launches, {transport}"] = seconds = _launches(scene)
        print(f"launches {transport:9} recorded in {seconds[0]:.3f} s, replayed in {seconds[1]:.3f} s of the processor")
        figures["holds"][f"{transport}: a launch is recorded in {RECORD_S:g} s"] = seconds[0] < RECORD_S
        figures["holds"][f"{transport}: a recorded launch takes {REPLAY_S:g} s"] = seconds[1] < REPLAY_S


def _numbers(scene: Scene, rng: np.random.Generator) -> Scene:
    """All numbers of all node trees changed."""
    fresh = graphs(len(scene.materials) - 1, rng)
    return replace(scene, materials=fresh.materials)


def _one_number(scene: Scene, rng: np.random.Generator) -> Scene:
    """The numbers of one node tree changed."""
    fresh, place = graphs(len(scene.materials) - 1, rng).materials, int(rng.integers(1, len(scene.materials)))
    return replace(scene, materials=(*scene.materials[:place], fresh[place], *scene.materials[place + 1 :]))


def _lamp(scene: Scene, rng: np.random.Generator) -> Scene:
    """Power, color and position of the lamp changed."""
    (lamp,) = scene.lights
    moved = np.array(lamp.world_from_light)
    moved[:3, 3] += rng.uniform(-1, 1, 3)
    color, power = Color(rng.uniform(0.5, 1, 3)), float(rng.uniform(1e3, 1e5))
    return replace(scene, lights=(PointLight(name=lamp.name, world_from_light=moved, color=color, power_w=power),))


def _world(scene: Scene, rng: np.random.Generator) -> Scene:
    return replace(scene, world=World(Color(rng.uniform(0, 0.3, 3)), strength=float(rng.uniform(0.5, 2))))


CHANGES: dict[str, Callable[[Scene, np.random.Generator], Scene]] = {
    "numbers of one tree": _one_number,
    "numbers of all trees": _numbers,
    "lamp": _lamp,
    "world": _world,
}


def _viewpoint(rng: np.random.Generator) -> Viewpoint:
    """A view from somewhere above the balls."""
    x, y, z = rng.uniform((-5, -5, 25), (5, 5, 40))
    eye = at(x, y, z, turn=("x", float(rng.uniform(0, 30))))
    return Viewpoint.of_camera(
        Camera(world_from_camera=eye, field_of_view_rad=float(rng.uniform(0.5, 1))), Film(96, 64)
    )


def _launches(scene: Scene) -> tuple[float, float]:
    """Processor seconds of a launch that is recorded while its kernels are known, and of one that is replayed."""
    _launch_times(scene)  # compiles
    first, *others = _launch_times(scene)
    return first, float(np.median(others))


def _launch_times(scene: Scene) -> list[float]:
    """Processor seconds of each launch of a newly loaded scene."""
    stage = Stage()
    stage.show(scene)
    stage.activate()
    viewpoint = Viewpoint.of_camera(scene.camera, scene.film)
    stage.look_from(viewpoint)
    picture = ViewPicture(stage.launcher, ViewRequest("stage", viewpoint, scene.film.width, scene.film.height, 4, 0), 4)
    times = []
    for _ in range(1 + ROUNDS):
        start = time.process_time()
        picture.step()
        times.append(time.process_time() - start)
    # the next stage gets the same numbers of Mitsuba's registry, thus the same kernel, only if nothing is left of this
    del picture
    stage.forget()
    return times


def _textures(options: Options, figures: dict[str, Any]) -> None:
    """Processor time per sample of each texture over a constant color, and of plain colors over Mitsuba's own paths."""
    size, samples = (32, 8) if options.quick else (160, 32)
    for transport in ("rgb", "spectral"):
        traced = {name: _tracer(_scene(make, transport, size)) for name, make in PAINTS.items()}
        if transport == "rgb":
            traced[MITSUBA] = _mitsuba_tracer(_scene(PAINTS["constant"], transport, size))
        for trace in traced.values():
            trace(samples)  # compiles
        seconds: dict[str, list[float]] = {name: [] for name in traced}
        for _ in range(2 if options.quick else ROUNDS):
            for name, trace in traced.items():
                start = time.process_time()
                trace(samples)
                seconds[name].append(time.process_time() - start)
        for name, values in seconds.items():
            ratio, nanoseconds = min(values) / min(seconds["constant"]), 1e9 * min(values) / size**2 / samples
            figures[f"textures, {transport}, {name}"] = {"ratio": ratio, "ns": nanoseconds}
            print(
                f"textures {transport:9} {name:20} {nanoseconds:7.0f} ns per sample, {ratio:5.2f} of a constant color"
            )
            if name in ("noise", "ramp", "noise and ramp"):
                claim = f"{transport}: {name} costs at most {TEXTURE_RATIO:g} times a constant color per sample"
                figures["holds"][claim] = ratio <= TEXTURE_RATIO
            if name == MITSUBA:
                claim = "rgb: plain colors cost at most as much per sample as in Mitsuba without node trees"
                figures["holds"][claim] = ratio >= 1


def _place(build: Builder) -> int:
    return build.add("vector_input", (), "position", 0)


def _noise(detail: float) -> Any:
    build = Builder()
    rest = (0.0, 4.0, detail, 0.5, 2.0, 0.0, 1.0, 0.0)
    return Computed(
        build.program(build.add("noise_color", (_place(build), *map(build.number, rest)), "FBM", True, "3D"))
    )


def _ramp(build: Builder, factor: int) -> Any:
    table = np.linspace((0.1, 0.2, 0.8, 1), (0.9, 0.5, 0.1, 1), 256)
    return Computed(build.program(build.add("ramp_color", (factor,), data=table)))


def _plain_ramp() -> Any:
    build = Builder()
    return _ramp(build, build.as_width(_place(build), 1))


def _ramp_of_noise() -> Any:
    build = Builder()
    rest = (0.0, 4.0, 2.0, 0.5, 2.0, 0.0, 1.0, 0.0)
    noise = build.add("noise", (_place(build), *map(build.number, rest)), "FBM", True, "3D")
    return _ramp(build, noise)


PAINTS: dict[str, Callable[[], Any]] = {
    "constant": lambda: Color(np.array([0.6, 0.4, 0.3])),
    "noise": lambda: _noise(2.0),
    "noise, 8 octaves": lambda: _noise(8.0),
    "ramp": _plain_ramp,
    "noise and ramp": _ramp_of_noise,
}


def _scene(make: Callable[[], Any], transport: str, size: int) -> Scene:
    """A ball on a floor, both of one paint, which fill the picture, under a lamp and a dim world."""
    eye = at(0, -3, 3, turn=("x", 45))
    return Scene(
        camera=Camera(world_from_camera=eye, field_of_view_rad=0.7),
        film=Film(size, size, samples=1),
        meshes=(square(), sphere()),
        materials=(Material("paint", Diffuse(make())),),
        instances=(
            Instance("floor", "square", at(scale=(8.0,) * 3), ("paint",)),
            Instance("ball", "sphere", at(z=0.7, scale=(0.7,) * 3), ("paint",)),
        ),
        lights=(PointLight(name="lamp", world_from_light=at(2, -2, 4), power_w=300.0, radius=0.2),),
        world=World(gray(0.2)),
        settings=RenderSettings(transport=transport),  # type: ignore[arg-type]
    )


def _tracer(scene: Scene) -> Callable[[int], Any]:
    """Traces samples of a scene, which is loaded once."""
    return RenderJob(scene, plan_effects(scene, pilot=False)).trace


def _mitsuba_tracer(scene: Scene) -> Callable[[int], Any]:
    """Mitsuba's own path tracer and surfaces for the same scene."""
    job = RenderJob(scene, plan_effects(scene, pilot=False))
    with tempfile.TemporaryDirectory() as folder:
        write_mitsuba(scene, Path(folder) / "scene")
        loaded = job.mitsuba.load_file(str(Path(folder) / "scene" / "scene.xml"))
    return lambda samples: np.array(job.mitsuba.render(loaded, spp=samples))
