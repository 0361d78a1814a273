# SPDX-License-Identifier: GPL-3.0-or-later
"""Patterns without random points or octaves: Wave, Magic, Gradient, Checker, Brick."""

from __future__ import annotations

from math import pi
from typing import Any

from spectral_core.scene.shading.registry import operation
from spectral_core.scene.shading.textures.noise import fbm
from spectral_core.scene.shading.tuples import add, clip, each, length, mix, multiply, safe_divide


def _inside(p: Any) -> Any:
    """Coordinates moved off integers, where the cells of a pattern meet."""
    return multiply(add(p, 0.000001), 0.999999)


@operation("3 1 1 1 1 1 1", 1)
def wave(
    xp: Any, vector: Any, scale: Any, distortion: Any, detail: Any, detail_scale: Any, rough: Any, phase: Any,
    kind: str, direction: str, profile: str,
) -> Any:  # fmt: skip
    """Wave Texture."""
    p = _inside(multiply(vector, scale))
    if kind == "BANDS":
        axes = {"X": p[0], "Y": p[1], "Z": p[2]}
        n = axes[direction] * 20.0 if direction in axes else (p[0] + p[1] + p[2]) * 10.0
    else:
        kept = tuple(0.0 * c if axis == direction else c for axis, c in zip("XYZ", p, strict=True))
        n = length(xp, kept) * 20.0
    n = n + phase
    zero = 0.0 * p[0]
    # below 0 the whole part is cut to 0, and the fraction counts from the next lower number, as in Cycles
    octaves = clip(xp, xp.where((detail > -1.0) & (detail < 0.0), detail + 1.0, detail + zero), 0.0, 15.0)
    turbulence = fbm(xp, multiply(p, detail_scale), octaves, rough + zero, zero + 2.0, zero, zero, True)
    n = n + distortion * (turbulence * 2.0 - 1.0)
    if profile == "SIN":
        return 0.5 + 0.5 * xp.sin(n - pi / 2)
    n = n / (2 * pi)
    return n - xp.floor(n) if profile == "SAW" else xp.absolute(n - xp.floor(n + 0.5)) * 2.0


@operation("3 1 1", 3)
def magic(xp: Any, vector: Any, scale: Any, distortion: Any, depth: int, has_seams: bool) -> Any:
    """Magic Texture; ``has_seams``: coordinates repeat after 2π before its scale counts, as in Cycles before 5.2."""
    p = each(lambda c: c - 2 * pi * xp.trunc(c / (2 * pi)), vector if has_seams else multiply(vector, scale))
    p = multiply(p, scale) if has_seams else p
    d = distortion
    x = xp.sin((p[0] + p[1] + p[2]) * 5.0)
    y = xp.cos((-p[0] + p[1] - p[2]) * 5.0)
    z = -xp.cos((-p[0] - p[1] + p[2]) * 5.0)
    steps = [
        lambda x, y, z: (x * d, -xp.cos(x * d - y * d + z * d) * d, z * d),
        lambda x, y, z: (xp.cos(x - y - z) * d, y, z),
        lambda x, y, z: (x, y, xp.sin(-x - y - z) * d),
        lambda x, y, z: (-xp.cos(-x + y - z) * d, y, z),
        lambda x, y, z: (x, -xp.sin(-x + y + z) * d, z),
        lambda x, y, z: (x, -xp.cos(-x + y + z) * d, z),
        lambda x, y, z: (xp.cos(x + y + z) * d, y, z),
        lambda x, y, z: (x, y, xp.sin(x + y - z) * d),
        lambda x, y, z: (-xp.cos(-x - y + z) * d, y, z),
        lambda x, y, z: (x, -xp.sin(x - y + z) * d, z),
    ]
    for step in steps[:depth]:
        x, y, z = step(x, y, z)
    double = xp.where(d != 0.0, d * 2.0, 1.0)
    return 0.5 - x / double, 0.5 - y / double, 0.5 - z / double


@operation("3", 1)
def gradient(xp: Any, p: Any, kind: str) -> Any:
    """Gradient Texture."""
    x, y, _ = p
    if kind == "LINEAR":
        value = x
    elif kind == "QUADRATIC":
        value = xp.maximum(x, 0.0) * xp.maximum(x, 0.0)
    elif kind == "EASING":
        r = clip(xp, x)
        value = r * r * (3.0 - 2.0 * r)
    elif kind == "DIAGONAL":
        value = (x + y) * 0.5
    elif kind == "RADIAL":
        value = xp.atan2(y, x) / (2 * pi) + 0.5
    else:
        r = xp.maximum(0.999999 - length(xp, p), 0.0)
        value = r * r if kind == "QUADRATIC_SPHERE" else r
    return clip(xp, value)


@operation("3 1", 1)
def checker(xp: Any, vector: Any, scale: Any) -> Any:
    """Checker Texture: 1 for its first color, where the sum of the cell numbers is odd."""
    total = sum(xp.floor(c) for c in _inside(multiply(vector, scale)))
    return xp.where(xp.absolute(total - 2.0 * xp.floor(total * 0.5)) < 0.5, 0.0, 1.0)


@operation("3 1 1 1 1 1 1", 1)
def brick(xp: Any, *inputs: Any) -> Any:
    """Brick Texture's mortar: vector, scale, mortar size, its smoothness, bias, brick width, row height."""
    return _brick(xp, *inputs)[1]


@operation("3 1 1 1 1 1 1", 1)
def brick_tint(xp: Any, *inputs: Any) -> Any:
    """Brick Texture's share of the second color in a brick."""
    return _brick(xp, *inputs)[0]


def _brick(
    xp: Any, vector: Any, scale: Any, mortar: Any, smooth: Any, bias: Any, width: Any, height: Any,
    offset: float, offset_rows: int, squash: float, squash_rows: int,
) -> tuple[Any, Any]:  # fmt: skip
    p = multiply(vector, scale)
    row = xp.floor(safe_divide(xp, p[1], height))
    shift = 0.0 * p[0]
    width = width + shift
    if offset_rows and squash_rows:
        every = lambda n: xp.absolute(row - n * xp.floor(row / n)) < 0.5  # noqa: E731
        width = xp.where(every(float(squash_rows)), width * squash, width)
        shift = xp.where(every(float(offset_rows)), width * offset, 0.0)
    column = xp.floor(safe_divide(xp, p[0] + shift, width))
    x, y = p[0] + shift - width * column, p[1] - height * row
    key = (xp.integer(row) << 16) + (xp.integer(column) & 0xFFFF)
    tint = clip(xp, _brick_noise(xp, key) + bias)
    edge = xp.minimum(xp.minimum(x, y), xp.minimum(width - x, height - y))
    depth = 1.0 - safe_divide(xp, edge, mortar + 0.0 * edge)
    t = clip(xp, safe_divide(xp, depth, smooth + 0.0 * depth))
    soft = xp.where(smooth == 0.0, 1.0, t * t * (3.0 - 2.0 * t))
    return tint, xp.where(edge >= mortar, 0.0, soft)


def _brick_noise(xp: Any, n: Any) -> Any:
    n = (n + 1013) & 0x7FFFFFFF
    n = (n >> 13) ^ n
    n = (n * (n * n * 60493 + 19990303) + 1376312589) & 0x7FFFFFFF
    return 0.5 * (xp.real(n) / 1073741824.0)


@operation("1 1 3 3 3", 3)
def brick_color(xp: Any, tint: Any, mortar: Any, first: Any, second: Any, joint: Any) -> Any:
    """Brick Texture's color."""
    return mix(mix(first, second, tint), joint, mortar)


@operation("3 1 1", 3)
def radial_tiling(xp: Any, vector: Any, sides: Any, roundness: Any, normalize: bool) -> Any:
    """Segment Coordinates of the Radial Tiling node."""
    across, along = _segment(xp, vector, sides, roundness, normalize)[:2]
    return across, along, 0.0 * along


@operation("3 1 1", 3)
def radial_segment(xp: Any, vector: Any, sides: Any, roundness: Any) -> Any:
    """ID, width and rotation of the Radial Tiling node's segment."""
    return _segment(xp, vector, sides, roundness, False)[2:]


def _segment(xp: Any, vector: Any, sides: Any, roundness: Any, normalize: bool) -> tuple[Any, ...]:
    """Coordinates across and along a segment of a rounded polygon, and the segment's number, width and direction.

    Angles are from the segment's bisector (``offset``) or from the nearest divider (``before``). A corner bends where
    the divider is nearer than ``bevel``. Sides that are not whole end with a narrower segment, whose corners are bent
    by a circle that touches both neighbors.
    """
    x, y = vector[0], vector[1]
    sides, rounding = xp.maximum(sides + 0.0 * x, 2.0), clip(xp, roundness + 0.0 * x)
    radius, turn = xp.sqrt(x * x + y * y), xp.atan2(y, x)
    angle = turn + xp.where(y < 0.0, 2 * pi, 0.0)
    half = xp.minimum(pi / sides, MOST_HALF)
    rest = pi - xp.floor(sides) * half
    is_last = (sides > xp.floor(sides)) & (angle >= 2.0 * (pi - rest))
    number = xp.where(is_last, xp.floor(sides), xp.floor(angle * sides / (2 * pi)))
    own = xp.where(is_last, rest, half)
    offset = angle - 2.0 * half * number - own
    before = own - xp.absolute(offset)

    regular, narrow = (angle_ - xp.atan((1.0 - rounding) * xp.tan(angle_)) for angle_ in (half, rest))
    circle, center_x, center_y, uneven = _last_corner(xp, half, rest, rounding, narrow)
    mirrored = xp.where(angle < pi, turn, 2.0 * (pi - rest) - angle)  # from the nearer divider of the last segment
    wide = (sides > xp.floor(sides)) & (mirrored >= 0.0) & (mirrored < half) & ~is_last
    bevel = xp.where(is_last, narrow, xp.where(wide, uneven, regular))
    soft = xp.where(wide, 1.0 - xp.tan(half - uneven) / xp.tan(half), rounding)
    straight = before >= bevel

    middle = (1.0 - rounding) / xp.cos(half)
    reach = xp.cos(before) * middle
    bent = reach + xp.sqrt(reach * reach + rounding * rounding - middle * middle)
    reach = xp.sin(xp.where(is_last, -before, before)) * center_y + xp.cos(before) * center_x
    bent_last = reach + xp.sqrt(reach * reach + circle * circle - center_x * center_x - center_y * center_y)
    narrower = is_last | wide & ~straight
    level = xp.where(straight, radius * xp.cos(offset), radius / xp.where(narrower, bent_last, bent))
    ratio = xp.cos(half) / xp.cos(rest)
    along, stretch = xp.where(narrower, ratio, 1.0) * level, xp.where(is_last, ratio, 1.0)

    flat, start = own - bevel, (1.0 - soft) * bevel
    past = bevel - before
    spline = xp.where(
        past < start,
        radius * xp.cos(flat) * past + 0.5 * (1.0 - radius * xp.cos(flat)) * safe_divide(xp, past * past, start),
        start * 0.5 * (radius * xp.cos(flat) - 1.0) + past,
    )
    across = xp.where(straight, level * xp.tan(xp.absolute(offset)), radius * xp.sin(flat) + spline) * stretch
    across = xp.where(offset < 0.0, -across, across)
    across = xp.where(radius > 0.0, across, 0.0)
    plain = xp.where(wide, regular, bevel)
    width = xp.tan(own - plain) + (1.0 - rounding) * plain * 0.5 * (1.0 + stretch) + stretch * rounding * plain
    halved = (sides <= 2.0) & (rounding <= 0.0)  # two half planes, of no finite width
    if normalize:
        base, end = xp.where(is_last, level, along), soft * bevel
        by_level = base * xp.tan(flat) + start * 0.5 * (base + 1.0) + end
        by_radius = radius * xp.sin(flat) + start * 0.5 * (radius * xp.cos(flat) + 1.0) + end
        share = xp.where(straight, 0.0, safe_divide(xp, past, bevel))
        most = stretch * (by_level + (by_radius - by_level) * share)
        across = 0.5 * xp.where(halved, across, safe_divide(xp, across, most)) + 0.5
    else:
        along = along - 1.0
    return across, along, number, xp.where(halved, 0.0, width), 2.0 * half * number + own


MOST_HALF = 1.5707
"""Most of half a segment's angle: less than a right angle, whose tangent has no bounds."""


def _last_corner(xp: Any, half: Any, rest: Any, rounding: Any, narrow: Any) -> tuple[Any, Any, Any, Any]:
    """Radius and center of the circle in the corner beside the last segment, and the angle at which it begins."""
    circle = rounding * xp.tan(rest) / xp.tan(0.5 * (half + rest))
    distance = 1.0 / xp.cos(rest - narrow)
    center_x = distance * xp.cos(narrow) - circle * xp.cos(rest)
    center_y = circle * xp.sin(rest) - distance * xp.sin(narrow)
    return circle, center_x, center_y, xp.atan((center_y + circle * xp.sin(half)) / (center_x + circle * xp.cos(half)))
