# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs of a program at the shaded point, and operations that depend on the view: Fresnel, Bump, Normal Map."""

from __future__ import annotations

from math import pi
from typing import Any

from spectral_core.scene.shading.registry import operation
from spectral_core.scene.shading.tuples import (
    add,
    choose,
    clip,
    cross,
    dot,
    each,
    length,
    mix,
    multiply,
    normalized,
    safe_divide,
    subtract,
)


@operation("", 3, folds=False)
def vector_input(xp: Any, name: str, shift: int) -> Any:
    """A vector of the point: ``position``, ``normal``, ``true_normal``, ``incoming``, ``object``, ``attribute:…``.

    ``shift``: 0 at the point, 1 and 2 a small step along the surface, which Bump needs.
    """
    return xp.input(name, shift)


@operation("", 1, folds=False)
def number_input(xp: Any, name: str, shift: int) -> Any:
    """A number of the point: ``backfacing``, ``random``, ``object_index``, …."""
    return xp.input(name, shift)


@operation("3", 3, folds=False)
def transformed(xp: Any, vector: Any, kind: str, source: str, target: str) -> Any:
    """Vector Transform: a point, vector or normal between ``WORLD``, ``OBJECT`` and ``CAMERA`` space."""
    for space, inverse in ((source, True), (target, False)):
        if space != "WORLD":
            vector = xp.transform(vector, kind, space, inverse)
    return normalized(xp, vector) if kind == "NORMAL" else vector


def dielectric(xp: Any, cosine: Any, eta: Any) -> Any:
    """Unpolarized Fresnel reflectance, ``eta`` inside over outside."""
    c = xp.absolute(cosine)
    g_squared = eta * eta - 1.0 + c * c
    g = xp.sqrt(xp.maximum(g_squared, 0.0))
    a = safe_divide(xp, g - c, g + c)
    b = safe_divide(xp, c * (g + c) - 1.0, c * (g - c) + 1.0)
    return xp.where(g_squared > 0.0, 0.5 * a * a * (1.0 + b * b), 1.0)


@operation("1 3 3 1", 1)
def fresnel(xp: Any, ior: Any, normal: Any, incoming: Any, backfacing: Any) -> Any:
    """Fresnel node."""
    eta = xp.maximum(ior, 1e-5)
    eta = xp.where(backfacing > 0.5, 1.0 / eta, eta)
    return dielectric(xp, dot(normal, incoming), eta)


@operation("1 3 3 1", 1)
def layer_fresnel(xp: Any, weight: Any, normal: Any, incoming: Any, backfacing: Any) -> Any:
    """Layer Weight's Fresnel."""
    eta = xp.maximum(1.0 - weight, 1e-5)
    eta = xp.where(backfacing > 0.5, eta, 1.0 / eta)
    return dielectric(xp, dot(normal, incoming), eta)


@operation("1 3 3", 1)
def layer_facing(xp: Any, weight: Any, normal: Any, incoming: Any) -> Any:
    """Layer Weight's Facing."""
    facing = xp.absolute(dot(normal, incoming))
    w = clip(xp, weight, 0.0, 1.0 - 1e-5)
    exponent = xp.where(w < 0.5, 2.0 * w, 0.5 / (1.0 - w))
    return 1.0 - xp.where(
        facing > 0.0, xp.power(xp.maximum(facing, 1e-20), exponent), xp.where(exponent > 0.0, 0.0, 1.0)
    )


@operation("3 1 1 1 1 1 3 3", 3)
def bump(
    xp: Any,
    normal: Any,
    strength: Any,
    distance: Any,
    height: Any,
    height_x: Any,
    height_y: Any,
    step_x: Any,
    step_y: Any,
) -> Any:
    """Bump node (Mikkelsen 2010, "Bump mapping unparametrized surfaces on the GPU")."""
    along_x, along_y = cross(step_y, normal), cross(normal, step_x)
    determinant = dot(step_x, along_x)
    slope = add(multiply(along_x, height_x - height), multiply(along_y, height_y - height))
    sign = xp.where(determinant < 0.0, -1.0, 1.0)
    raised = subtract(multiply(normal, xp.absolute(determinant)), multiply(slope, distance * sign))
    raised = normalized(xp, raised)
    return normalized(xp, mix(normal, raised, xp.maximum(strength, 0.0)))


@operation("3 1 3 3 3", 3)
def normal_map(xp: Any, color: Any, strength: Any, normal: Any, tangent: Any, bitangent: Any) -> Any:
    """Normal Map node in tangent space; ``bitangent`` carries the handedness of the UV map."""
    x, y, z = (2.0 * c - 1.0 for c in color)
    s = xp.maximum(strength, 0.0)
    flat = mix(1.0 + 0.0 * z, z, clip(xp, s))
    bent = add(add(multiply(tangent, x * s), multiply(bitangent, y * s)), multiply(normal, flat))
    size = length(xp, bent)
    return choose(xp, size > 0.0, multiply(bent, 1.0 / xp.maximum(size, 1e-20)), normal)


@operation("3 1 3", 3)
def normal_blend(xp: Any, direction: Any, strength: Any, normal: Any) -> Any:
    """Normal Map node in world or object space: the stored direction, mixed with the normal."""
    s = xp.maximum(strength, 0.0)
    return normalized(xp, add(normal, multiply(subtract(normalized(xp, direction), normal), s)))


@operation("3", 3)
def around_z(xp: Any, generated: Any) -> Any:
    """Direction around the Z axis through the middle of generated coordinates."""
    return 0.5 - generated[1], generated[0] - 0.5, 0.0 * generated[2]


@operation("3 3", 3)
def along_surface(xp: Any, vector: Any, normal: Any) -> Any:
    """The tangential part of a direction, normalized."""
    return normalized(xp, cross(normal, normalized(xp, cross(vector, normal))))


@operation("3 3", 3)
def reflection(xp: Any, incoming: Any, normal: Any) -> Any:
    """Reflection output of Texture Coordinate."""
    return subtract(multiply(normal, 2.0 * dot(incoming, normal)), incoming)


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


def read_image(xp: Any, u: Any, v: Any, image: Any, unassociates: bool) -> tuple[Any, Any, Any, Any]:
    """Color and alpha of an image at coordinates, filtered as Cycles does: stored values first, then decoded."""
    width, height = xp.size(image)
    x, y = u * width, v * height
    # a number far away has no fraction left; any pixel serves, but it must exist
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


@operation("3", 3)
def round_coordinates(xp: Any, vector: Any, kind: str) -> Any:
    """Sphere or tube projection of an image: coordinates of [0, 1]³ to the image's."""
    x, y, z = each(lambda c: (c - 0.5) * 2.0, vector)
    if kind == "SPHERE":
        size = length(xp, (x, y, z))
        u = xp.where((x == 0.0) & (y == 0.0), 0.0, (1.0 - xp.atan2(x, y) / pi) / 2.0)
        return u, xp.where(size > 0.0, 1.0 - xp.acos(safe_divide(xp, z, size)) / pi, 0.0), 0.0 * x
    size = xp.sqrt(x * x + y * y)
    u = xp.where(size > 0.0, (1.0 - xp.atan2(x, y) / pi) * 0.5, 0.0)
    return u, xp.where(size > 0.0, (z + 1.0) * 0.5, 0.0), 0.0 * x


@operation("3", 3)
def sphere_place(xp: Any, direction: Any) -> Any:
    """Equirectangular coordinates of a direction, as an Environment Texture reads it."""
    x, y, z = normalized(xp, direction)
    return -xp.atan2(y, x) / (2 * pi) + 0.5, xp.atan2(z, xp.sqrt(x * x + y * y)) / pi + 0.5, 0.0 * x
