# SPDX-License-Identifier: GPL-3.0-or-later
"""Patterns without random points or octaves: Wave, Magic, Gradient, Checker, Brick."""

from __future__ import annotations

from math import pi
from typing import Any

from spectral_core.scene.shading.noise import fbm
from spectral_core.scene.shading.registry import operation
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
    octaves, rough = clip(xp, detail + zero, 0.0, 15.0), xp.maximum(rough + zero, 0.0)
    turbulence = fbm(xp, multiply(p, detail_scale), octaves, rough, zero + 2.0, zero, zero, True)
    n = n + distortion * (turbulence * 2.0 - 1.0)
    if profile == "SIN":
        return 0.5 + 0.5 * xp.sin(n - pi / 2)
    n = n / (2 * pi)
    return n - xp.floor(n) if profile == "SAW" else xp.absolute(n - xp.floor(n + 0.5)) * 2.0


@operation("3 1 1", 3)
def magic(xp: Any, vector: Any, scale: Any, distortion: Any, depth: int) -> Any:
    """Magic Texture."""
    p = each(lambda c: c - 2 * pi * xp.trunc(c / (2 * pi)), multiply(vector, scale))
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
    soft = xp.where((smooth > 0.0) & (depth < smooth), t * t * (3.0 - 2.0 * t), 1.0)
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
