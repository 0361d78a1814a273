# SPDX-License-Identifier: GPL-3.0-or-later
"""Furnaces: white surfaces in a white world, flat tiles at chosen angles in columns, roughnesses in rows.

A tile is hidden from everything but the camera, so each pixel shows one reflection (or transmission) of one surface:
its directional albedo, which no surface may have above 1.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.render.cases.meshes import sphere
from spectral_core.render.job import RenderJob
from spectral_core.render.plan.effects import plan_effects
from spectral_core.scene import (
    AddSurface,
    Camera,
    Diffuse,
    Film,
    Glass,
    Glossy,
    Instance,
    Material,
    Mesh,
    Metal,
    MixSurface,
    Principled,
    Rays,
    RenderSettings,
    Scene,
    Sheen,
    Subsurface,
    Toon,
    Translucent,
    Transparent,
    World,
    gray,
)

Array = NDArray[np.float64]
WHITE = gray(1.0)
ROUGHNESS = tuple(float(value) for value in np.round(np.linspace(0.0, 1.0, 20) ** 1.5, 3))
"""Densest where surfaces are smoothest."""
ANGLES = (0.0, 30.0, 60.0, 75.0, 85.0, 89.0)
"""Degrees between the view and the normal; each is tried from the front and from behind."""
PIXELS = 4
"""Pixels of a tile along each side."""

SURFACES: dict[str, Callable[[float], Any]] = {
    "Diffuse": lambda r: Diffuse(WHITE, r),
    "Glossy, GGX, multiple scattering": lambda r: Glossy(WHITE, r),
    "Glossy, GGX, single scattering": lambda r: Glossy(WHITE, r, multiple_scattering=False),
    "Glossy, Beckmann": lambda r: Glossy(WHITE, r, distribution="beckmann"),
    "Glossy, Ashikhmin and Shirley": lambda r: Glossy(WHITE, r, distribution="ashikhmin"),
    "Glass, index 1.5": lambda r: Glass(WHITE, r, 1.5),
    "Glass, index 2.4": lambda r: Glass(WHITE, r, 2.4),
    "Glass, single scattering": lambda r: Glass(WHITE, r, 1.5, multiple_scattering=False),
    "Glass, thin film": lambda r: Glass(WHITE, r, 1.5, thin_film_thickness=400.0),
    "Translucent": lambda r: Translucent(WHITE),
    "Sheen, microfiber": lambda r: Sheen(WHITE, r),
    "Sheen, Ashikhmin": lambda r: Sheen(WHITE, r, microfiber=False),
    "Toon": lambda r: Toon(WHITE, 0.1 + 0.9 * r, 0.5 * r),
    "Toon, glossy": lambda r: Toon(WHITE, 0.1 + 0.9 * r, 0.5 * r, glossy=True),
    "Metal": lambda r: Metal(WHITE, WHITE, r),
    "Metal, physical": lambda r: Metal(WHITE, gray(0.5), r, physical=True),
    "Metal, thin film": lambda r: Metal(WHITE, WHITE, r, thin_film_thickness=500.0, thin_film_ior=2.0),
    "Transparent": lambda r: Transparent(WHITE),
    "Principled": lambda r: Principled(WHITE, roughness=r),
    "Principled, metallic": lambda r: Principled(WHITE, metallic=1.0, roughness=r),
    "Principled, coat": lambda r: Principled(WHITE, roughness=r, coat_weight=1.0, coat_roughness=r, coat_ior=1.8),
    "Principled, smooth coat": lambda r: Principled(WHITE, roughness=r, coat_weight=1.0, coat_roughness=0.0),
    "Principled, rough coat on metal": lambda r: Principled(
        WHITE, metallic=1.0, roughness=0.1, coat_weight=1.0, coat_roughness=r, coat_ior=2.5
    ),
    "Principled, thin film": lambda r: Principled(WHITE, roughness=r, thin_film_thickness=400.0),
    "Principled, thick film": lambda r: Principled(WHITE, roughness=r, thin_film_thickness=1000.0, thin_film_ior=1.22),
    "Principled, sheen": lambda r: Principled(WHITE, roughness=r, sheen_weight=1.0),
    "Principled, transmission": lambda r: Principled(WHITE, roughness=r, transmission=1.0),
    "Principled, specular level 1": lambda r: Principled(WHITE, roughness=r, specular_level=1.0, ior=2.0),
    "Principled, half of everything": lambda r: Principled(
        WHITE, metallic=0.5, roughness=r, alpha=0.5, transmission=0.5, coat_weight=0.5, diffuse_roughness=r
    ),
    "Mix of diffuse and glossy": lambda r: MixSurface(0.5, Diffuse(WHITE), Glossy(WHITE, r)),
    "Sum of half diffuse and half glossy": lambda r: AddSurface(Diffuse(gray(0.5)), Glossy(gray(0.5), r)),
}
"""Surfaces that reflect everything that reaches them, by their roughness."""


def tile_albedos(make: Callable[[float], Any], samples: int, transport: str, seed: int = 0) -> tuple[Array, Array, int]:
    """Directional albedo of each tile (roughness, angle, channel), its standard error, and lost samples."""
    sides = [(angle, flip) for flip in (False, True) for angle in ANGLES]
    instances, materials = [], []
    for row, roughness in enumerate(ROUGHNESS):
        materials.append(Material(f"white {row}", make(roughness)))
        for column, (angle, flip) in enumerate(sides):
            turn = np.radians(angle) + (np.pi if flip else 0.0)
            tilt = np.eye(4)
            tilt[:3, :3] = [[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]]
            placed = tilt @ np.diag([1 / np.cos(np.radians(angle)), 1.0, 1.0, 1.0])  # fills its square as seen
            placed[:2, 3] = (column + 0.5, row + 0.5)
            instances.append(
                Instance(f"tile {row} {column}", "tile", placed, (f"white {row}",), hidden_from=Rays.ALL & ~Rays.CAMERA)
            )
    corners = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]], np.float32)
    width, height = len(sides), len(ROUGHNESS)
    eye = np.eye(4)
    eye[:3, 3] = (width / 2, height / 2, 60)
    scene = Scene(
        camera=Camera(world_from_camera=eye, kind="orthographic", orthographic_scale=width, sensor_fit="width"),
        film=Film(width * PIXELS, height * PIXELS, samples, seed, filter_kind="box", filter_width=1.0),
        meshes=(Mesh("tile", corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32)),),
        materials=tuple(materials),
        instances=tuple(instances),
        world=World(WHITE),
        settings=RenderSettings(transport=transport, max_bounces=64),  # type: ignore[arg-type]
    )
    pixels, lost = traced(scene)
    tiles = pixels.reshape(height, PIXELS, width, PIXELS, 3).transpose(0, 2, 1, 3, 4).reshape(height, width, -1, 3)
    noise = tiles.std(axis=2, ddof=1) / PIXELS
    # a tile has few pixels: no noise is taken to be less than that of most tiles of its roughness
    return tiles.mean(axis=2), np.maximum(noise, np.median(noise, axis=1, keepdims=True)), lost


def ball_albedo(surface: Any, samples: int, transport: str) -> tuple[float, float, int]:
    """Largest mean over rings of a ball in a white world, its standard error, and lost samples."""
    size, eye = 24, np.eye(4)
    eye[2, 3] = 20
    scene = Scene(
        camera=Camera(world_from_camera=eye, kind="orthographic", orthographic_scale=2.0),
        film=Film(size, size, samples, filter_kind="box", filter_width=1.0),
        meshes=(sphere(),),
        materials=(Material("white", surface),),
        instances=(Instance("ball", "sphere", np.eye(4), ("white",)),),
        world=World(WHITE),
        settings=RenderSettings(transport=transport, max_bounces=256),  # type: ignore[arg-type]
    )
    pixels, lost = traced(scene)
    y, x = np.mgrid[:size, :size] - (size - 1) / 2
    ring = np.minimum(np.hypot(x, y) / (size / 2) * 4, 4).astype(int)
    means = [pixels[ring == k].mean() for k in range(4)]
    errors = [pixels[ring == k].mean(axis=-1).std() / np.sqrt((ring == k).sum()) for k in range(4)]
    most = int(np.argmax(means))
    return float(means[most]), float(errors[most]), lost


BALLS: dict[str, Any] = {
    "Subsurface, short paths": Subsurface(WHITE, scale=0.01),
    "Subsurface, long paths": Subsurface(WHITE, radius=(1.0, 1.0, 1.0), scale=1.0),
    "Principled, subsurface": Principled(WHITE, subsurface_weight=1.0),
}
"""Surfaces that need an interior."""


def traced(scene: Scene) -> tuple[Array, int]:
    """Linear sRGB picture (height, width, 3), and how many samples were no numbers."""
    job = RenderJob(scene, plan_effects(scene, pilot=False))
    job.trace(scene.film.samples)
    lost = sum(int(note.message.split()[0]) for note in job.notes if "not finite numbers" in note.message)
    return job.picture()[..., :3].astype(np.float64), lost
