# SPDX-License-Identifier: GPL-3.0-or-later
"""A mark on a bank note: one white lamp hides it, another white lamp shows it.

The note is a spectral texture: the first picture is the note, the second is the note with a star printed over it.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from examples.more_scenes.shapes import box, looking, scene_of, sheet
from spectral_core.palette.texture.lights import design_lights, led_range
from spectral_core.palette.texture.reach import TEXTURE_GRID
from spectral_core.palette.texture.texture import Picture, SpectralTexture, TextureDesign, design_texture
from spectral_core.scene import AreaLight, Diffuse, Film, Scene, SpectralImage, gray
from spectral_core.spectra.spectrum import Illuminant

HEIGHT, WIDTH = 384, 768


def engraving() -> NDArray[np.uint8]:
    """Guilloche lines, a medallion and a value on tinted paper, display colors (HEIGHT, WIDTH, 3)."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] / HEIGHT
    picture = np.stack([0.90 - 0.06 * y, 0.91 - 0.05 * x / 2, 0.82 + 0.06 * x / 2], axis=-1)
    for number, color in enumerate([(0.25, 0.50, 0.44), (0.60, 0.36, 0.48), (0.30, 0.38, 0.66)]):
        phase = 2.1 * number
        wave = np.sin(14 * x + phase) * 0.16 + np.sin(43 * x - 9 * y + phase) * 0.05
        lines = np.abs(((y - 0.5 - wave) * 18 + number / 3) % 1.0 - 0.5)
        fade = np.clip(1.2 - np.abs(x - 1.0) / 1.1, 0, 1)
        picture = _printed(picture, np.clip((0.12 - lines) * 12, 0, 1) * fade * 0.6, color)
    dx, dy = (x - 0.54) / 0.8, y - 0.5
    radius, angle = np.hypot(dx, dy), np.arctan2(dy, dx)
    picture = _printed(picture, np.clip((0.34 - radius) * HEIGHT / 2, 0, 1), (0.86, 0.90, 0.86))
    for petals, depth, turns in ((12, 0.05, 9.0), (18, 0.035, 13.0)):
        rings = np.abs(((radius + depth * np.sin(petals * angle)) * turns * 2) % 1.0 - 0.5)
        inside = np.clip((0.33 - radius) * HEIGHT / 3, 0, 1)
        picture = _printed(picture, np.clip((0.2 - rings) * 6, 0, 1) * inside * 0.75, (0.16, 0.34, 0.36))
    picture = _printed(picture, np.clip((0.012 - np.abs(radius - 0.335)) * HEIGHT, 0, 1), (0.14, 0.30, 0.32))
    for left, top, high in ((1.64, 0.11, 0.17), (0.08, 0.79, 0.11)):
        picture = _printed(picture, _value(x, y, left, top, high), (0.20, 0.24, 0.42))
    edge = np.minimum(np.minimum(x, WIDTH / HEIGHT - x), np.minimum(y, 1 - y))
    border = np.clip((0.014 - np.abs(edge - 0.05)) * HEIGHT / 2, 0, 1)
    picture = _printed(picture, border * 0.8, (0.22, 0.36, 0.38))
    return np.asarray(np.round(255 * np.clip(picture, 0, 1)), dtype=np.uint8)


def _printed(picture: NDArray[np.float64], cover: NDArray[np.float64], ink: tuple[float, ...]) -> NDArray[np.float64]:
    """``picture`` with an ink of coverage ``cover`` (HEIGHT, WIDTH), from 0 to 1."""
    return np.asarray(picture + (np.array(ink) - picture) * cover[..., None])


def _value(x: NDArray[np.float64], y: NDArray[np.float64], left: float, top: float, high: float) -> NDArray[np.float64]:
    """Cover of the number 20 in strokes, ``high`` tall, with its corner at (left, top)."""
    u, v = (x - left) / high, (y - top) / high
    points = [(0.03, 0.2), (0.15, 0.02), (0.4, 0.02), (0.52, 0.2), (0.5, 0.42), (0.03, 0.97), (0.55, 0.97)]
    strokes = list(pairwise(points))
    distance = np.full(u.shape, np.inf)
    for (u0, v0), (u1, v1) in strokes:
        share = np.clip(((u - u0) * (u1 - u0) + (v - v0) * (v1 - v0)) / ((u1 - u0) ** 2 + (v1 - v0) ** 2), 0, 1)
        distance = np.minimum(distance, np.hypot(u - u0 - share * (u1 - u0), v - v0 - share * (v1 - v0)))
    zero = np.abs(np.hypot((u - 1.0) / 0.56, v - 0.5) - 0.48) * 0.6
    return np.clip((0.07 - np.minimum(distance, zero)) * high * HEIGHT, 0, 1)


def starred(note: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The note with a red star of eight points."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] / HEIGHT
    dx, dy = x - 1.24, y - 0.56
    reach = 0.18 + 0.10 * np.cos(8 * np.arctan2(dy, dx))
    cover = np.clip((reach - np.hypot(dx, dy)) * HEIGHT / 2, 0, 1)[..., None]
    return np.asarray(np.round(note + (np.array([190, 50, 60]) - note) * 0.85 * cover), dtype=np.uint8)


def note() -> TextureDesign:
    """The texture and its two white lights, of LEDs that are 30 nm wide and a fifth daylight."""
    lights = design_lights(led_range(30.0), daylight_share=0.2).lights
    plain = engraving()
    pictures = [Picture("plain", plain), Picture("starred", starred(plain))]
    return design_texture(pictures, lights, floor=0.1, slope=0.75, count=8)


def counter(texture: SpectralTexture, light: Illuminant, film: Film) -> Scene:
    """The note on a counter under one white lamp."""
    paper = SpectralImage("note", texture.weights[:, ::-1], texture.spectra, TEXTURE_GRID, extension="extend")
    parts = [
        (sheet("note", 1.5, 0.75, 0.005), Diffuse(paper)),
        (box("counter", (-3, -3, -0.1), (3, 3, 0.0)), Diffuse(gray(0.2))),
        (box("pen", (-0.72, 0.5, 0.0), (0.1, 0.535, 0.035)), Diffuse(gray(0.05))),
    ]
    lamp = AreaLight(
        name="lamp", world_from_light=looking((-0.8, 0.6, 1.8), (0.0, 0.0, 0.0)), color=light, power_w=40.0,
        size=(0.5, 0.5), shape="rectangle",
    )  # fmt: skip
    return scene_of(parts, [lamp], (looking((0.1, -1.5, 1.55), (0.0, 0.06, 0.0)), 0.82), film)
