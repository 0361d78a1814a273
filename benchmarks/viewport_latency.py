# SPDX-License-Identifier: GPL-3.0-or-later
"""Time from a change of a scene to the first picture of it in the live session, by type of change, RGB and spectral.

Ten balls of 10,000 triangles (2,000 with ``--quick``) on a floor, ten materials, an area lamp and a world, seen at
960×540. The clock starts before the change is made and ends when the session holds the picture, without Blender: its
translation and drawing come on top. Each type is tried in turn, so that a busy machine slows all alike.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks import Options
from spectral_core.render.live.link import LiveLink
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.scene import (
    AreaLight,
    Camera,
    Color,
    Diffuse,
    Film,
    Instance,
    Material,
    Mesh,
    Principled,
    RenderSettings,
    Scene,
    World,
    gray,
)

WIDTH, HEIGHT = 960, 540
LIMITS_MS = {"camera": 120, "roughness": 120, "color": 120, "lamp": 120, "world": 120, "moved": 150, "mesh": 150}
"""First picture after each type of change, 99th percentile, of the acceptance."""
Change = Callable[[Scene, np.random.Generator], Scene]


def run(options: Options) -> dict[str, Any]:
    """Print medians and 99th percentiles and return them."""
    count = 3 if options.quick else 200
    figures: dict[str, Any] = {"holds": {}}
    for transport in ("rgb",) if options.quick else ("rgb", "spectral"):
        link = LiveLink()
        try:
            found = _measure(link, balls(options.quick, transport), count)
        finally:
            link.close()
        for kind, (times, in_place) in found.items():
            median, high = float(np.median(times)), float(np.percentile(times, 99))
            figures[f"{transport}, {kind}"] = {"median_ms": median, "p99_ms": high, "in_place": in_place}
            print(f"{transport:9} {kind:10} median {median:7.1f} ms  99th {high:7.1f} ms  in place {in_place}/{count}")
            figures["holds"][f"{transport} {kind} within {LIMITS_MS[kind]} ms"] = high <= LIMITS_MS[kind]
    return figures


def _measure(link: LiveLink, scene: Scene, count: int) -> dict[str, tuple[list[float], int]]:
    rng = np.random.default_rng(7)
    camera = scene.camera
    show(link, scene, camera, None)
    found: dict[str, tuple[list[float], int]] = {kind: ([], 0) for kind in LIMITS_MS}
    for change in CHANGES.values():  # the first of each kind may record
        scene = change(scene, rng)
        show(link, scene, camera, None)
    for _ in range(count):
        for kind in LIMITS_MS:
            start = time.perf_counter()
            if kind == "camera":
                camera = orbit(camera, rng)
            else:
                scene = CHANGES[kind](scene, rng)
            how = show(link, scene, camera, None)
            times, in_place = found[kind]
            times.append(1e3 * (time.perf_counter() - start))
            found[kind] = times, in_place + (how != "loaded")
    return found


def show(link: LiveLink, scene: Scene, camera: Camera, samples: int | None) -> str:
    """Show a change and wait for its first picture (its last one with ``samples``); how the change was made."""
    link.show("stage", scene)
    seen = Viewpoint.of_camera(camera, scene.film)
    generation = link.look("view", ViewRequest("stage", seen, WIDTH, HEIGHT, samples or 64, 0), lambda: None)
    end = time.monotonic() + 300
    while time.monotonic() < end:
        if link.wait("view", generation, 1.0):
            shown = link.latest("view")
            if shown is not None and (samples is None or shown.frame.is_done):
                return shown.frame.how
            time.sleep(0.01)
    raise TimeoutError(f"no picture within 300 s: {link.trouble('view')}")


def _material(scene: Scene, rng: np.random.Generator, **numbers: Any) -> Scene:
    place = int(rng.integers(10))
    materials = list(scene.materials)
    materials[place] = replace(materials[place], surface=replace(materials[place].surface, **numbers))
    return replace(scene, materials=tuple(materials))


def _moved(scene: Scene, rng: np.random.Generator) -> Scene:
    place = int(rng.integers(10))
    instances, matrix = list(scene.instances), np.eye(4)
    matrix[:3, 3] = (*rng.uniform(-4, 4, 2), 1.0)
    instances[place] = replace(instances[place], world_from_object=matrix)
    return replace(scene, instances=tuple(instances))


def _edited(scene: Scene, rng: np.random.Generator) -> Scene:
    place = int(rng.integers(10))
    meshes = list(scene.meshes)
    stretch = rng.uniform(0.8, 1.25, 3).astype(np.float32)
    meshes[place] = replace(meshes[place], positions=meshes[place].positions * stretch)
    return replace(scene, meshes=tuple(meshes))


CHANGES: dict[str, Change] = {
    "roughness": lambda s, rng: _material(s, rng, roughness=float(rng.uniform(0.2, 0.8))),
    "color": lambda s, rng: _material(s, rng, base_color=Color(rng.uniform(0.1, 0.9, 3))),
    "lamp": lambda s, rng: replace(s, lights=(replace(s.lights[0], power_w=float(rng.uniform(200, 900))),)),
    "world": lambda s, rng: replace(s, world=World(Color(rng.uniform(0.1, 0.5, 3)), 1.0)),
    "moved": _moved,
    "mesh": _edited,
}


def orbit(camera: Camera, rng: np.random.Generator) -> Camera:
    """The camera somewhere near."""
    matrix = camera.world_from_camera.copy()
    matrix[:3, 3] += rng.uniform(-0.2, 0.2, 3)
    return replace(camera, world_from_camera=matrix)


def balls(quick: bool, transport: str) -> Scene:
    """The scene that is changed."""
    rows = 32 if quick else 71
    polar, turn = np.meshgrid(np.linspace(0, np.pi, rows + 1), np.arange(rows) * 2 * np.pi / rows, indexing="ij")
    points = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], -1).reshape(-1, 3)
    row, column = np.meshgrid(np.arange(rows), np.arange(rows), indexing="ij")
    a, b = row * rows + column, row * rows + (column + 1) % rows
    first, second = np.stack([a, a + rows, b + rows], -1), np.stack([a, b + rows, b], -1)
    triangles = np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)]).astype(np.uint32)
    points = points.astype(np.float32)
    floor = np.array([[-20, -20, 0], [20, -20, 0], [20, 20, 0], [-20, 20, 0]], np.float32)
    placed = [np.eye(4) for _ in range(10)]
    for number, matrix in enumerate(placed):
        matrix[:3, 3] = ((number % 5 - 2) * 2.2, (number // 5) * 2.5, 1)
    tilt, eye, lamp = np.radians(75), np.eye(4), np.eye(4)
    eye[:3, :3] = [[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]]
    eye[:3, 3], lamp[:3, 3] = (0, -10, 4), (0, -2, 6)
    return Scene(
        camera=Camera(world_from_camera=eye),
        film=Film(WIDTH, HEIGHT),
        meshes=(
            *(Mesh(f"ball {k}", points, triangles, normals=points) for k in range(10)),
            Mesh("floor", floor, np.array([[0, 1, 2], [0, 2, 3]], np.uint32)),
        ),
        materials=(
            *(Material(f"paint {k}", Principled(Color([0.1 * k, 0.5, 0.9 - 0.08 * k]))) for k in range(10)),
            Material("floor", Diffuse(gray(0.5))),
        ),
        instances=(
            *(Instance(f"ball {k}", f"ball {k}", placed[k], (f"paint {k}",)) for k in range(10)),
            Instance("floor", "floor", np.eye(4), ("floor",)),
        ),
        lights=(AreaLight(name="key", world_from_light=lamp, power_w=500.0, size=(2.0, 2.0)),),
        world=World(gray(0.3), 1.0),
        settings=RenderSettings(transport=transport),  # type: ignore[arg-type]
    )
