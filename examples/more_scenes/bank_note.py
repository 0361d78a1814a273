# SPDX-License-Identifier: GPL-3.0-or-later
"""A mark on a bank note: one white lamp hides it, another white lamp shows it.

The note is a spectral texture: the first picture is the note, the second is the note with a star printed over it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from examples.more_scenes.shapes import box, looking, scene_of, sheet
from spectral_core.palette.texture.lights import design_lights, led_range
from spectral_core.palette.texture.reach import TEXTURE_GRID
from spectral_core.palette.texture.texture import Picture, SpectralTexture, TextureDesign, design_texture
from spectral_core.scene import AreaLight, Diffuse, Film, Scene, SpectralImage, gray
from spectral_core.spectra.spectrum import Illuminant

HEIGHT, WIDTH = 256, 512


def engraving() -> NDArray[np.uint8]:
    """Guilloche lines on tinted paper, display colors (HEIGHT, WIDTH, 3)."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] / HEIGHT
    picture = np.stack([0.86 - 0.05 * y, 0.88 - 0.04 * x / 2, 0.80 + 0.03 * x / 2], axis=-1)
    for number, color in enumerate([(0.25, 0.45, 0.40), (0.55, 0.35, 0.45), (0.30, 0.35, 0.60)]):
        phase = 2.1 * number
        wave = np.sin(14 * x + phase) * 0.16 + np.sin(43 * x - 9 * y + phase) * 0.05
        lines = np.abs(((y - 0.5 - wave) * 18 + number / 3) % 1.0 - 0.5)
        fade = np.clip(1.2 - np.abs(x - 1.0) / 1.1, 0, 1)
        cover = np.clip((0.12 - lines) * 12, 0, 1) * fade * 0.8
        picture = picture + (np.array(color) - picture) * cover[..., None]
    edge = np.minimum(np.minimum(x, WIDTH / HEIGHT - x), np.minimum(y, 1 - y))
    border = np.clip((0.045 - np.abs(edge - 0.06)) * 60, 0, 1) * 0.5
    picture = picture + (np.array([0.3, 0.42, 0.42]) - picture) * border[..., None]
    return np.asarray(np.round(255 * np.clip(picture, 0, 1)), dtype=np.uint8)


def starred(note: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The note with a red star of eight points."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] / HEIGHT
    dx, dy = x - 1.4, y - 0.5
    reach = 0.19 + 0.11 * np.cos(8 * np.arctan2(dy, dx))
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
        (box("pen", (-0.85, 0.55, 0.0), (0.05, 0.59, 0.035)), Diffuse(gray(0.05))),
    ]
    lamp = AreaLight(
        name="lamp", world_from_light=looking((-0.8, 0.6, 1.8), (0.0, 0.0, 0.0)), color=light, power_w=24.0,
        size=(0.5, 0.5), shape="rectangle",
    )  # fmt: skip
    return scene_of(parts, [lamp], (looking((0.15, -1.75, 1.45), (0.0, 0.03, 0.0)), 0.66), film)
