# SPDX-License-Identifier: GPL-3.0-or-later
"""Vectors as tuples of three values of any backend."""

from __future__ import annotations

from typing import Any

Vector = tuple[Any, Any, Any]


def each(function: Any, *vectors: Any) -> Any:
    """Apply ``function`` component by component; plain values take part in every component."""
    parts = [vector if isinstance(vector, tuple) else (vector,) * 3 for vector in vectors]
    return tuple(function(*components) for components in zip(*parts, strict=True))


def add(a: Any, b: Any) -> Vector:
    """a + b."""
    return each(lambda x, y: x + y, a, b)


def subtract(a: Any, b: Any) -> Vector:
    """a - b."""
    return each(lambda x, y: x - y, a, b)


def multiply(a: Any, b: Any) -> Vector:
    """a · b, component by component."""
    return each(lambda x, y: x * y, a, b)


def dot(a: Vector, b: Vector) -> Any:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def length(xp: Any, a: Vector) -> Any:
    """Euclidean length."""
    return xp.sqrt(dot(a, a))


def normalized(xp: Any, a: Vector) -> Vector:
    """Unit vector; zero where the vector is zero, as in Blender."""
    size = length(xp, a)
    return multiply(a, safe_divide(xp, 1.0, size))


def choose(xp: Any, condition: Any, a: Vector, b: Vector) -> Vector:
    """``a`` where the condition holds, else ``b``."""
    return each(lambda x, y: xp.where(condition, x, y), a, b)


def mix(a: Any, b: Any, factor: Any) -> Any:
    """Linear interpolation of values or vectors."""
    if isinstance(a, tuple) or isinstance(b, tuple):
        return each(lambda x, y, f: x + (y - x) * f, a, b, factor)
    return a + (b - a) * factor


def safe_divide(xp: Any, a: Any, b: Any) -> Any:
    """a / b, 0 where b is 0, as in Blender."""
    zero = b == 0.0
    return xp.where(zero, 0.0, a / xp.where(zero, 1.0, b))


def clip(xp: Any, value: Any, low: Any = 0.0, high: Any = 1.0) -> Any:
    """Value clipped to two bounds."""
    return xp.minimum(xp.maximum(value, low), high)
