# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene of ``viewport-latency`` and its changes, each of a kind that the acceptance limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from spectral_core.render.live.view import Viewpoint
from spectral_core.scene import (
    AreaLight,
    Camera,
    Color,
    Computed,
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
from spectral_core.scene.shading import Builder

WIDTH, HEIGHT = 960, 540
Change = Callable[[Scene, np.random.Generator], Scene]


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


def _added(scene: Scene, rng: np.random.Generator) -> Scene:
    """One more ball, with a mesh of its own."""
    number, matrix = len(scene.instances), np.eye(4) * (0.3, 0.3, 0.3, 1.0)
    matrix[:3, 3] = (*rng.uniform(-3, 3, 2), 2.5)
    made = replace(scene.meshes[0], name=f"new {number}")
    instance = Instance(f"new {number}", made.name, matrix, ("paint 0",))
    return replace(scene, meshes=(*scene.meshes, made), instances=(*scene.instances, instance))


def _with_node(scene: Scene, rng: np.random.Generator) -> Scene:
    """Another texture in a material: operations in an order that no material is likely to have had before."""
    build = Builder()
    place = build.add("vector_input", (), "position", 0)
    value = build.add("noise_color", (place, *map(build.number, (0.0, 3.0, 1.0, 0.5, 2.0, 0.0, 1.0, 0.0))),
                      "FBM", True, "3D")  # fmt: skip
    for digit in rng.integers(0, 3, 8):
        if digit == 0:
            value = build.add("invert", (build.number(0.3), value))
        elif digit == 1:
            value = build.add("gamma", (value, build.number(1.2)))
        else:
            value = build.add("bright_contrast", (value, build.number(0.1), build.number(0.2)))
    return _material(scene, rng, specular_tint=Computed(build.program(value)))


CHANGES: dict[str, Change] = {
    "roughness": lambda s, rng: _material(s, rng, roughness=float(rng.uniform(0.2, 0.8))),
    "color": lambda s, rng: _material(s, rng, base_color=Color(rng.uniform(0.1, 0.9, 3))),
    "lamp": lambda s, rng: replace(s, lights=(replace(s.lights[0], power_w=float(rng.uniform(200, 900))),)),
    "world": lambda s, rng: replace(s, world=World(Color(rng.uniform(0.1, 0.5, 3)), 1.0)),
    "moved": _moved,
    "mesh": _edited,
}
RARE: dict[str, Change] = {"object added": _added, "node added": _with_node}


def _camera(rng: np.random.Generator, **numbers: Any) -> Viewpoint:
    """The camera somewhere near."""
    seen = camera()
    matrix = seen.world_from_camera.copy()
    matrix[:3, 3] += rng.uniform(-0.2, 0.2, 3)
    return Viewpoint.of_camera(replace(seen, world_from_camera=matrix, **numbers), Film(WIDTH, HEIGHT))


def _orbited(rng: np.random.Generator) -> Viewpoint:
    return _camera(rng)


def _orthographic(rng: np.random.Generator) -> Viewpoint:
    return _camera(rng, kind="orthographic")


def _shifted(rng: np.random.Generator) -> Viewpoint:
    """Through a lens that is shifted, with another zoom of the view."""
    seen = _camera(rng, shift=tuple(rng.uniform(-0.1, 0.1, 2)))
    middle, half, zoom = (seen.low + seen.high) / 2, (seen.high - seen.low) / 2, rng.uniform(0.8, 1.2)
    return replace(seen, low=middle - zoom * half, high=middle + zoom * half)


VIEWPOINTS: dict[str, Callable[[np.random.Generator], Viewpoint]] = {
    "camera": _orbited, "orthographic": _orthographic, "shift and zoom": _shifted,
}  # fmt: skip


def camera() -> Camera:
    """Looks at all of the balls."""
    tilt, eye = np.radians(75), np.eye(4)
    eye[:3, :3] = [[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]]
    eye[:3, 3] = (0, -10, 4)
    return Camera(world_from_camera=eye)


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
    lamp = np.eye(4)
    lamp[:3, 3] = (0, -2, 6)
    return Scene(
        camera=camera(),
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
