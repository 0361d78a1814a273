# SPDX-License-Identifier: GPL-3.0-or-later
"""Sums of backgrounds: colors exactly, images on one grid of directions."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Color, ImageTexture, Paint
from spectral_core.spectra.observer import sum_of_lights
from spectral_core.spectra.spectrum import Spectrum

from ..shading.images import linear_pixels
from ..shading.reader import Reader
from ..shading.tree import Output
from ..shading.walks.shaders import all_inputs, in_order

MOST_ROWS = 1024
"""Rows of a newly drawn environment; twice as many columns."""


@dataclass(frozen=True)
class Term:
    """One background: its color or image, its strength, and the rotation of its image."""

    color: Paint
    strength: float = 1.0
    turn: NDArray[np.float64] = field(default_factory=lambda: np.eye(4), compare=False)
    is_planckian: bool = False


PLAIN_RAYS = frozenset({"Is Camera Ray", "Is Shadow Ray", "Ray Length"})
"""Outputs of Light Path whose value is known for all rays that light the scene: no shadow ray reaches a world."""


def light_paths_of(source: Output | None) -> frozenset[str]:
    """Outputs of Light Path nodes that a tree reads."""
    before = in_order(source, all_inputs)
    return frozenset(each.socket.name for each, _ in before if each.node.type == "LIGHT_PATH")


def note_ray_type(reader: Reader, name: str) -> None:
    """Name an output of Light Path that a world with a spectrum reads for diffuse rays alone."""
    reader.note(
        f"{name!r} in the world depends on the type of ray, which is not supported beside a spectrum; the value for "
        "diffuse surfaces was used"
    )


def note_sampled_ray_type(reader: Reader, name: str) -> None:
    """Name an output of Light Path by which a world that is not even depends on the type of ray."""
    reader.note(
        f"{name!r} in the world depends on the type of ray: the light that a surface samples is that for diffuse rays, "
        "in Cycles that for rays of no type; mirrors and clear glass show the same"
    )


def joined(reader: Reader, terms: list[Term]) -> Term:
    """The sum of several backgrounds as one."""
    terms = [term for term in terms if term.strength > 0]
    if not terms:
        return Term(Color(np.zeros(3)), 0.0)
    if len(terms) == 1:
        return terms[0]
    spectral = [(term.strength, term.color) for term in terms if isinstance(term.color, Spectrum)]
    if len(spectral) == len(terms):
        light, strength = sum_of_lights(spectral)
        return Term(light, strength, is_planckian=all(term.is_planckian for term in terms))
    if spectral:
        reader.note("of several backgrounds with spectra and with colors, only the strongest was used")
        return max(terms, key=lambda term: term.strength)
    plain = np.zeros(3)
    for term in terms:
        if isinstance(term.color, Color):
            plain = plain + term.strength * term.color.linear_rgb
    images = [term for term in terms if isinstance(term.color, ImageTexture)]
    if not images:
        return Term(Color(plain))
    rows = min(max(term.color.pixels.shape[0] for term in images), MOST_ROWS)  # type: ignore[union-attr]
    directions = directions_of(rows)
    total = np.broadcast_to(plain, directions.shape).copy()
    for term in images:
        assert isinstance(term.color, ImageTexture)
        total += term.strength * looked_up(term.color, directions @ term.turn[:3, :3])
    return Term(environment_of("environment", total))


def resampled(image: ImageTexture, mapping: NDArray[np.float64]) -> ImageTexture:
    """An environment after an affine map (4, 4) of directions."""
    directions = directions_of(min(max(image.pixels.shape[0], 256), MOST_ROWS))
    mapped = directions @ mapping[:3, :3].T + mapping[:3, 3]
    return environment_of(image.name, looked_up(image, mapped))


def environment_of(name: str, pixels: NDArray[np.float64]) -> ImageTexture:
    return ImageTexture(name, pixels.astype(np.float32), color_space="linear")


def directions_of(rows: int, place: tuple[float, float] = (0.5, 0.5)) -> NDArray[np.float64]:
    """Unit directions (rows, 2 rows, 3) through an equirectangular image's pixels, bottom row first; ``place``: in each
    pixel, from 0 to 1 across and up.
    """
    columns, heights = np.meshgrid(np.arange(2 * rows) + place[0] - 0.5, np.arange(rows) + place[1] - 0.5)
    return direction_at(columns, heights, rows)


def direction_at(column: NDArray[np.float64], row: NDArray[np.float64], rows: int) -> NDArray[np.float64]:
    """Unit directions (..., 3) of places of an environment of ``rows`` rows; whole ones are centers of pixels."""
    height = (row + 0.5) / rows * np.pi - np.pi / 2
    around = np.pi - (column + 0.5) / rows * np.pi
    flat = np.cos(height)
    return np.stack([flat * np.cos(around), flat * np.sin(around), np.sin(height)], axis=-1)


def pixel_of(
    directions: NDArray[np.float64], rows: int, columns: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Column and row of an environment, not whole, that belong to directions of any length."""
    x, y, z = np.moveaxis(directions, -1, 0)  # Cycles: direction_to_equirectangular
    u = 0.5 - np.arctan2(y, x) / (2 * np.pi)
    v = np.arctan2(z, np.hypot(x, y)) / np.pi + 0.5
    return u * columns - 0.5, np.clip(v * rows - 0.5, 0, rows - 1)


def looked_up(image: ImageTexture, directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Linear RGB (..., 3) of an environment along directions of any length, interpolated."""
    pixels = np.asarray(linear_pixels(image), dtype=np.float64)
    pixels = np.repeat(pixels, 3, axis=2) if pixels.shape[2] == 1 else pixels[..., :3]
    rows, columns = pixels.shape[:2]
    column, row = pixel_of(directions, rows, columns)
    left, low = np.floor(column).astype(int), np.minimum(np.floor(row).astype(int), max(rows - 2, 0))
    across, up = (column - left)[..., None], (row - low)[..., None]
    high = np.minimum(low + 1, rows - 1)
    below = pixels[low, left % columns] * (1 - across) + pixels[low, (left + 1) % columns] * across
    above = pixels[high, left % columns] * (1 - across) + pixels[high, (left + 1) % columns] * across
    result: NDArray[np.float64] = below * (1 - up) + above * up
    return result
