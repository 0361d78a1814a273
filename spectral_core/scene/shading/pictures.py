# SPDX-License-Identifier: GPL-3.0-or-later
"""Images at coordinates: filters, extensions, tiles, and the projection from the sides of a box."""

from __future__ import annotations

from typing import Any

from spectral_core.scene.shading.registry import operation
from spectral_core.scene.shading.tuples import choose, clip, each, safe_divide


def _wrapped(xp: Any, cell: Any, size: Any, extension: str) -> tuple[Any, Any]:
    """Column or row inside an image, and True if there is a pixel."""
    inside = (cell >= 0.0) & (cell < size)
    if extension == "repeat":
        cell = cell - size * xp.floor(cell / size)
        inside = cell == cell
    elif extension == "mirror":
        turn = cell - 2.0 * size * xp.floor(cell / (2.0 * size))
        cell = xp.where(turn >= size, 2.0 * size - 1.0 - turn, turn)
        inside = cell == cell
    elif extension == "extend":
        inside = cell == cell
    return clip(xp, cell, 0.0, size - 1.0), inside


def decoded(xp: Any, value: Any) -> Any:
    """Linear light of a display value (IEC 61966-2-1)."""
    bright = xp.power(xp.maximum((value + 0.055) / 1.055, 1e-10), 2.4)
    return xp.where(value < 0.04045, xp.maximum(value, 0.0) / 12.92, bright)


def _taps(t: Any, kind: str) -> list[tuple[float, Any]]:
    """Offsets and weights of the pixels in a filter at a position between two pixels."""
    if kind == "cubic":  # uniform B-spline, as in Cycles
        r = 1.0 - t
        return [
            (-1.0, r * r * r / 6.0),
            (0.0, (4.0 + t * t * (3.0 * t - 6.0)) / 6.0),
            (1.0, (4.0 + r * r * (3.0 * r - 6.0)) / 6.0),
            (2.0, t * t * t / 6.0),
        ]
    return [(0.0, 1.0 - t), (1.0, t)]


def read_image(
    xp: Any, u: Any, v: Any, image: Any, unassociates: bool, tile: Any = None, tiles: int = 1
) -> tuple[Any, Any, Any, Any]:
    """Color and alpha of an image at coordinates, filtered as Cycles does: stored values first, then decoded.

    ``tile``: which of ``tiles`` parts of equal height, one above the other, counts as the image; None for all of it.
    """
    width, height = xp.size(image)
    height = height * (1.0 / tiles)
    x, y = u * width, v * height
    # far away a number has no fraction left; any pixel is as good, but it must be one
    x, y = (xp.where(xp.isfinite(c) & (xp.absolute(c) < 1e9), c, 0.0) for c in (x, y))
    total = [0.0 * x] * 4
    if image.interpolation == "nearest":
        columns, rows = [(xp.floor(x), 1.0)], [(xp.floor(y), 1.0)]
    else:
        left, bottom = xp.floor(x - 0.5), xp.floor(y - 0.5)
        columns = [(left + k, w) for k, w in _taps(x - 0.5 - left, image.interpolation)]
        rows = [(bottom + k, w) for k, w in _taps(y - 0.5 - bottom, image.interpolation)]
    for row, row_weight in rows:
        row, row_inside = _wrapped(xp, row, height, image.extension)
        row = row if tile is None else row + tile * height
        for column, column_weight in columns:
            column, inside = _wrapped(xp, column, width, image.extension)
            weight = xp.where(inside & row_inside, row_weight * column_weight + 0.0 * x, 0.0)
            total = [t + weight * c for t, c in zip(total, xp.texel(image, column, row), strict=True)]
    *color, alpha = total
    if unassociates:
        scale = xp.where(alpha > 0.0, 1.0 / xp.maximum(alpha, 1e-20), 1.0)
        color = [c * scale for c in color]
    if image.color_space == "srgb":
        color = [decoded(xp, c) for c in color]
    return color[0], color[1], color[2], alpha


@operation("3", 3)
def image_color(xp: Any, place: Any, image: Any, unassociates: bool) -> Any:
    """Color of an Image Texture, flat on the first two coordinates."""
    return read_image(xp, place[0], place[1], image, unassociates)[:3]


def _tile_number(xp: Any, place: Any) -> Any:
    """Number of the UDIM tile that coordinates lie in, 0 outside of all; as Cycles rounds, toward 0."""
    column, row = xp.trunc(place[0]), xp.trunc(place[1])
    there = (column >= 0.0) & (row >= 0.0) & (column < 10.0)
    return xp.where(there, 1001.0 + column + 10.0 * row, 0.0)


@operation("3", 3)
def image_tiles(xp: Any, place: Any, image: Any, unassociates: bool, *numbers: int) -> Any:
    """Color of a tiled (UDIM) image whose tiles are stacked in ``image``; black outside of them."""
    number = _tile_number(xp, place)
    tile = 0.0 * number - 1.0
    for k, known in enumerate(numbers):
        tile = xp.where(xp.absolute(number - known) < 0.5, float(k) + 0.0 * number, tile)
    u, v = place[0] - xp.trunc(place[0]), place[1] - xp.trunc(place[1])
    color = read_image(xp, u, v, image, unassociates, xp.maximum(tile, 0.0), len(numbers))[:3]
    return tuple(xp.where(tile >= 0.0, c, 0.0) for c in color)


@operation("3", 1)
def outside_tiles(xp: Any, place: Any, *numbers: int) -> Any:
    """1 where coordinates lie in none of the tiles."""
    number, outside = _tile_number(xp, place), 1.0 + 0.0 * place[0]
    for known in numbers:
        outside = xp.where(xp.absolute(number - known) < 0.5, 0.0 * outside, outside)
    return outside


def _box_weights(xp: Any, normal: Any, blend: float) -> Any:
    x, y, z = each(xp.absolute, normal)
    total = xp.maximum(x + y + z, 1e-20)
    x, y, z = x / total, y / total, z / total
    limit = 0.5 * (1.0 + blend)
    only_x = (x > limit * (x + y)) & (x > limit * (x + z))
    only_y = (y > limit * (x + y)) & (y > limit * (y + z))
    only_z = (z > limit * (x + z)) & (z > limit * (y + z))
    zero, one = 0.0 * x, 1.0 + 0.0 * x
    only = (one, zero, zero), (zero, one, zero), (zero, zero, one)
    seams = only[0]
    if blend > 0.0:
        # two projections are mixed along an edge of the box, all three at a corner
        share = lambda a, b: clip(xp, (safe_divide(xp, a, a + b) - 0.5 * (1.0 - blend)) / blend)  # noqa: E731
        xy, yz, xz = share(x, y), share(y, z), share(x, z)
        corner = each(lambda c: ((2.0 - limit) * c + (limit - 1.0)) / (2.0 * limit - 1.0), (x, y, z))
        seams = choose(xp, y < (1.0 - limit) * (x + z), (xz, zero, 1.0 - xz), corner)
        seams = choose(xp, x < (1.0 - limit) * (y + z), (zero, yz, 1.0 - yz), seams)
        seams = choose(xp, z < (1.0 - limit) * (x + y), (xy, 1.0 - xy, zero), seams)
    found = choose(xp, only_z, only[2], seams)
    return choose(xp, only_x, only[0], choose(xp, only_y, only[1], found))


def _box(xp: Any, place: Any, normal: Any, image: Any, unassociates: bool, blend: float) -> tuple[Any, ...]:
    x, y, z = place
    weights = _box_weights(xp, normal, blend)
    sides = (
        (xp.where(normal[0] < 0.0, 1.0 - y, y), z),
        (xp.where(normal[1] > 0.0, 1.0 - x, x), z),
        (xp.where(normal[2] > 0.0, 1.0 - y, y), x),
    )
    total: list[Any] = [0.0 * x] * 4
    for weight, (u, v) in zip(weights, sides, strict=True):
        total = [t + weight * c for t, c in zip(total, read_image(xp, u, v, image, unassociates), strict=True)]
    return tuple(total)


@operation("3 3", 3)
def image_box(xp: Any, place: Any, normal: Any, image: Any, unassociates: bool, blend: float) -> Any:
    """Color of an image projected from the sides of a box by the object's normal."""
    return _box(xp, place, normal, image, unassociates, blend)[:3]
