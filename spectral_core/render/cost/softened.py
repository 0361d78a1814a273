# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene with larger sources of equal power: their light then arrives on more paths, and about as much of it.

A sun, a bright spot of an environment image, a lamp or a narrow cone illuminates nearly the same region after it has
grown; the borders become soft. Paths that find such a source by chance, through glass or in a medium, find it more
often.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import AreaLight, ImageTexture, Light, Scene, SpotLight, SunLight, World
from spectral_core.spectra.color import luminance_from_linear_rgb

Array = NDArray[np.float64]

SOFT_RAD = 0.12
"""Least full angle of a grown sun, and of a bright spot of an environment image."""
SOFT_CONE_RAD = 0.35
"""Least full angle of a grown cone."""
GROWTH, CLEAR_SHARE = 5.0, 0.5
"""Most times the size of a lamp grows, and its largest extent as a part of the distance to the nearest surface."""
MOST_ROWS = 512
"""Rows of the image of a softened environment."""
BRIGHT = 8.0
"""Radiance over the mean of an environment image from which a pixel belongs to a bright spot."""


def softened(scene: Scene, clearance: Callable[[NDArray[np.float64]], float]) -> Scene:
    """``scene`` with larger sources; itself if none can grow. ``clearance``: distance from a point (3,) to surfaces."""
    lights = tuple(_light(light, clearance) for light in scene.lights)
    world = _world(scene.world)
    same = world is scene.world and all(new is old for new, old in zip(lights, scene.lights, strict=True))
    return scene if same else replace(scene, lights=lights, world=world)


def narrow_cones(scene: Scene) -> list[str]:
    """Names of the spots whose cones would grow."""
    lamps = [light for light in scene.lights if isinstance(light, SpotLight) and light.power_w != 0]
    return [light.name for light in lamps if light.cone_angle_rad < SOFT_CONE_RAD]


def _light(light: Light, clearance: Callable[[NDArray[np.float64]], float]) -> Light:
    if isinstance(light, SunLight):
        return light if light.angle_rad >= SOFT_RAD else replace(light, angle_rad=SOFT_RAD)
    if light.pattern is not None:  # its size belongs to the pattern
        return light
    room = CLEAR_SHARE * clearance(light.world_from_light[:3, 3])
    if isinstance(light, AreaLight):
        half = 0.5 * float(np.linalg.norm(light.world_from_light[:3, :2] @ np.array(light.size)))
        growth = _growth(half, room)
        return light if growth == 1.0 else replace(light, size=(growth * light.size[0], growth * light.size[1]))
    changes: dict[str, Any] = {}
    growth = _growth(light.radius, room)
    if growth > 1.0:
        changes["radius"] = growth * light.radius
    if isinstance(light, SpotLight) and light.cone_angle_rad < SOFT_CONE_RAD:
        solid = [1 - np.cos(angle / 2) for angle in (light.cone_angle_rad, SOFT_CONE_RAD)]
        changes |= {"cone_angle_rad": SOFT_CONE_RAD, "power_w": float(light.power_w * solid[0] / solid[1])}
    return replace(light, **changes) if changes else light


def _growth(extent: float, room: float) -> float:
    return 1.0 if extent <= 0 else float(np.clip(room / extent, 1.0, GROWTH))


def _world(world: World) -> World:
    """The environment with bright spots of its image spread over a disk of ``SOFT_RAD``."""
    image = world.color
    if world.is_black or not isinstance(image, ImageTexture) or image.pixels.dtype != np.float32:
        return world
    pixels = _reduced(image.pixels.astype(np.float64))
    light = luminance_from_linear_rgb(
        pixels[..., :3] if pixels.shape[2] >= 3 else np.repeat(pixels[..., :1], 3, axis=2)
    )
    height, width = light.shape
    area = np.sin(np.pi * (np.arange(height) + 0.5) / height)[:, None]  # of a pixel on the sphere
    mean = float((light * area).sum() / (area.sum() * width))
    rest = np.minimum(1.0, BRIGHT * mean / np.maximum(light, 1e-30))
    if not np.any(rest < 1.0):
        return world
    excess = pixels * (1 - rest)[..., None]
    blurred = _blurred(excess * area[..., None], height, width) / area[..., None]
    made = (pixels * rest[..., None] + blurred).astype(np.float32)
    return replace(world, color=replace(image, name=f"{image.name} softened", pixels=made))


def _reduced(pixels: Array) -> Array:
    """An image with at most ``MOST_ROWS`` rows: means over groups of pixels, weighted by their area on the sphere."""
    height, width, _ = pixels.shape
    factor = -(-height // MOST_ROWS)
    if factor == 1:
        return pixels
    area = np.sin(np.pi * (np.arange(height) + 0.5) / height)[:, None, None]
    down, across = np.arange(0, height, factor), np.arange(0, width, factor)
    sums = np.add.reduceat(np.add.reduceat(pixels * area, down, axis=0), across, axis=1)
    weights = np.add.reduceat(np.add.reduceat(area * np.ones((1, width, 1)), down, axis=0), across, axis=1)
    return np.asarray(sums / weights)


def _blurred(amount: Array, height: int, width: int) -> Array:
    """Amounts of light (height, width, channels), spread over neighbors on the sphere row by row, then up and down."""
    sigma = SOFT_RAD / 4
    spread = amount.copy()
    column = np.minimum(np.arange(width), width - np.arange(width)) * (2 * np.pi / width)
    for row in np.flatnonzero(np.any(amount != 0, axis=(1, 2))):
        wide = sigma / max(float(np.sin(np.pi * (row + 0.5) / height)), sigma)
        kernel = np.exp(-0.5 * (column / wide) ** 2)
        kernel /= kernel.sum()
        # by Fourier transforms, because a row goes around the circle
        product = np.fft.rfft(amount[row], axis=0) * np.fft.rfft(kernel)[:, None]
        spread[row] = np.fft.irfft(product, n=width, axis=0)
    rows = np.arange(height) * (np.pi / height)
    kernels = np.exp(-0.5 * ((rows[:, None] - rows[None, :]) / sigma) ** 2)
    kernels /= kernels.sum(axis=0, keepdims=True)
    return np.asarray(np.maximum(np.tensordot(kernels, spread, axes=(1, 0)), 0.0))
