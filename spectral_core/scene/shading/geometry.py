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

FILTER_WIDTH = 0.1
"""Steps of Bump's height samples in pixels, unless the node has another number."""


def shifted_by(axis: int, width: float = FILTER_WIDTH) -> int:
    """The ``shift`` of inputs at a step along axis 1 or 2 of the surface, of a width in pixels (thousandths count)."""
    return axis if width == FILTER_WIDTH else axis + 4 * max(round(width * 1000), 1)


def step_of(shift: int) -> tuple[int, float]:
    """Axis (0 for no step) and width in pixels of a ``shift``."""
    return shift % 4, shift // 4 / 1000 if shift >= 4 else FILTER_WIDTH


@operation("", 3, folds=False)
def vector_input(xp: Any, name: str, shift: int) -> Any:
    """A vector of the point: ``position``, ``normal``, ``true_normal``, ``incoming``, ``object``, ``attribute:…``.

    ``shift``: 0 at the point, else a small step along the surface, which Bump needs (``shifted_by``).
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


@operation("3 1", 1, folds=False)
def occlusion(xp: Any, normal: Any, distance: Any, samples: int, inside: bool, own: bool) -> Any:
    """Ambient Occlusion node: share of the directions about a normal that are open for ``distance``.

    ``inside``: looks below the surface; ``own``: only the object itself counts.
    """
    return xp.open_share(normal, distance, samples, inside, own)


@operation("1", 1, folds=False)
def wireframe(xp: Any, size: Any, in_pixels: bool) -> Any:
    """Wireframe node: 1 within half of ``size`` of an edge of the triangle; as in Cycles, its sign has no effect."""
    return xp.where(xp.edge_distance(in_pixels) < 0.5 * xp.absolute(size), 1.0 + 0.0 * size, 0.0)


@operation("3 1", 3, folds=False)
def bevel(xp: Any, normal: Any, radius: Any, samples: int) -> Any:
    """Bevel node: the mean normal of the object within a radius."""
    return xp.rounded(normal, radius, samples)


@operation("3 1 3 3 1", 3)
def normal_map(xp: Any, color: Any, strength: Any, normal: Any, tangent: Any, sign: Any) -> Any:
    """Normal Map node in tangent space, of any length; 0 without a UV map, whose ``sign`` is 0.

    A negative strength bends to the other side, as in Cycles; ``normal_blend`` reads it as 0, as Cycles does there.
    """
    x, y, z = (2.0 * c - 1.0 for c in color)
    flat = mix(1.0 + 0.0 * z, z, clip(xp, strength))
    across = multiply(cross(normal, tangent), sign)
    bent = add(add(multiply(tangent, x * strength), multiply(across, y * strength)), multiply(normal, flat))
    return multiply(bent, xp.where(sign == 0.0, 0.0, 1.0))


@operation("3 3 1", 3)
def bitangent(xp: Any, normal: Any, tangent: Any, sign: Any) -> Any:
    """Unit vector at right angles to a normal and a tangent."""
    return multiply(normalized(xp, cross(normal, tangent)), sign)


@operation("3 1 3", 3)
def on_side(xp: Any, direction: Any, backfacing: Any, normal: Any) -> Any:
    """A direction on the viewer's side of a surface: the opposite one from behind; ``normal`` in place of none."""
    return or_else(xp, multiply(direction, 1.0 - 2.0 * backfacing), normal)


@operation("3 3", 3)
def or_else(xp: Any, vector: Any, other: Any) -> Any:
    """A vector, in place of 0 another one."""
    return choose(xp, length(xp, vector) > 0.0, vector, other)


@operation("3 1 3", 3)
def normal_blend(xp: Any, direction: Any, strength: Any, normal: Any) -> Any:
    """Normal Map node in world or object space: the stored direction, mixed with the normal."""
    s = xp.maximum(strength, 0.0)
    return normalized(xp, add(normal, multiply(subtract(normalized(xp, direction), normal), s)))


@operation("3", 3)
def around_axis(xp: Any, generated: Any, axis: str) -> Any:
    """Direction around an axis through the middle of generated coordinates."""
    x, y, z = (c - 0.5 for c in generated)
    return {"X": (0.0 * x, -z, y), "Y": (-z, 0.0 * y, x), "Z": (-y, x, 0.0 * z)}[axis]


@operation("3 3", 3)
def along_surface(xp: Any, vector: Any, normal: Any) -> Any:
    """The tangential part of a direction, normalized."""
    return normalized(xp, cross(normal, normalized(xp, cross(vector, normal))))


@operation("3 3", 3)
def reflection(xp: Any, incoming: Any, normal: Any) -> Any:
    """Reflection output of Texture Coordinate."""
    return subtract(multiply(normal, 2.0 * dot(incoming, normal)), incoming)


@operation("3", 3)
def round_coordinates(xp: Any, vector: Any, kind: str) -> Any:
    """Coordinates on an image that is projected on a sphere or tube, of coordinates in [0, 1]³."""
    x, y, z = each(lambda c: (c - 0.5) * 2.0, vector)
    if kind == "SPHERE":
        size = length(xp, (x, y, z))
        u = xp.where((x == 0.0) & (y == 0.0), 0.0, (1.0 - xp.atan2(x, y) / pi) / 2.0)
        return u, xp.where(size > 0.0, 1.0 - xp.acos(safe_divide(xp, z, size)) / pi, 0.0), 0.0 * x
    size = xp.sqrt(x * x + y * y)
    u = xp.where(size > 0.0, (1.0 - xp.atan2(x, y) / pi) * 0.5, 0.0)
    return u, xp.where(size > 0.0, (z + 1.0) * 0.5, 0.0), 0.0 * x


@operation("3", 3)
def sphere_place(xp: Any, direction: Any, is_corner: bool) -> Any:
    """Equirectangular coordinates of a direction, as an Environment Texture reads it.

    ``is_corner``: True if a direction of length 0 is the corner of the image, as in Cycles, which the sky does not do.
    """
    x, y, z = normalized(xp, direction)
    u, v = -xp.atan2(y, x) / (2 * pi) + 0.5, xp.atan2(z, xp.sqrt(x * x + y * y)) / pi + 0.5
    if is_corner:
        is_some = (x != 0.0) | (y != 0.0) | (z != 0.0)
        u, v = xp.where(is_some, u, 0.0), xp.where(is_some, v, 0.0)
    return u, v, 0.0 * x


@operation("3", 3)
def ball_place(xp: Any, direction: Any) -> Any:
    """Coordinates of a direction in the picture of a mirror ball, as an Environment Texture reads it."""
    x, y, z = normalized(xp, direction)
    bent = 2.0 * xp.sqrt(xp.maximum(0.5 * (1.0 - y), 0.0))
    return 0.5 * (safe_divide(xp, x, bent) + 1.0), 0.5 * (safe_divide(xp, z, bent) + 1.0), 0.0 * x


MERIDIAN = 181
"""Entries of a luminaire's table from straight down to straight up."""


@operation("3", 1)
def luminaire(xp: Any, direction: Any, table: Any) -> Any:
    """IES Texture: strength of a luminaire along a direction toward the receiver.

    ``table``: (361 · 181, 1), by whole degrees around and from -Z.
    """
    x, y, z = normalized(xp, direction)
    down = xp.acos(clip(xp, -z, -1.0, 1.0)) * (180.0 / pi)
    around = (xp.atan2(x, y) + pi) * (180.0 / pi)
    row, column = (xp.minimum(xp.floor(angle), last) for angle, last in ((around, 359.0), (down, MERIDIAN - 2.0)))
    start = row * MERIDIAN + column
    low, high, low_next, high_next = (xp.entry(table, start + k, 0) for k in (0, 1, MERIDIAN, MERIDIAN + 1))
    share = down - column
    found = mix(mix(low, high, share), mix(low_next, high_next, share), around - row)
    return xp.where((x != 0.0) | (y != 0.0) | (z != 0.0), found, 0.0)  # nothing without a direction
