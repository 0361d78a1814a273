# SPDX-License-Identifier: GPL-3.0-or-later
"""Vectors: Mapping, Vector Math, Vector Rotate, transforms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from spectral_core.scene.shading.arithmetic import MATH, remainder
from spectral_core.scene.shading.registry import operation
from spectral_core.scene.shading.tuples import (
    add,
    choose,
    cross,
    dot,
    each,
    length,
    multiply,
    normalized,
    safe_divide,
    subtract,
)


def _rotation(xp: Any, angles: Any) -> tuple[Any, Any, Any]:
    """Rows of Blender's Euler XYZ matrix: about x, then y, then z."""
    (sx, sy, sz), (cx, cy, cz) = each(xp.sin, angles), each(xp.cos, angles)
    return (
        (cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz),
        (cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz),
        (-sy, sx * cy, cx * cy),
    )


def _apply(rows: Any, vector: Any) -> Any:
    return tuple(dot(row, vector) for row in rows)


def _apply_transposed(rows: Any, vector: Any) -> Any:
    return tuple(dot(column, vector) for column in zip(*rows, strict=True))


@operation("3 3 3 3", 3)
def mapping(xp: Any, vector: Any, location: Any, rotation: Any, scale: Any, kind: str) -> Any:
    """Mapping node."""
    rows = _rotation(xp, rotation)
    if kind == "TEXTURE":
        return _divided(xp, _apply_transposed(rows, subtract(vector, location)), scale)
    if kind == "NORMAL":
        return normalized(xp, _apply(rows, _divided(xp, vector, scale)))
    turned = _apply(rows, multiply(vector, scale))
    return add(turned, location) if kind == "POINT" else turned


def _divided(xp: Any, a: Any, b: Any) -> Any:
    return each(lambda x, y: safe_divide(xp, x, y), a, b)


@operation("3 3 3 3", 3)
def affine(xp: Any, vector: Any, x_row: Any, y_row: Any, z_row: Any) -> Any:
    """A linear map by its rows."""
    return dot(x_row, vector), dot(y_row, vector), dot(z_row, vector)


def _project(xp: Any, a: Any, b: Any, c: Any, s: Any) -> Any:
    return multiply(b, safe_divide(xp, dot(a, b), dot(b, b)))


def _cross(xp: Any, a: Any, b: Any, c: Any, s: Any) -> Any:
    """With one rounding of each difference, as Cycles' vector units compute it: it matters where products cancel."""
    return tuple(xp.fused(a[i], b[j], -(a[j] * b[i])) for i, j in ((1, 2), (2, 0), (0, 1)))


def _reflect(xp: Any, a: Any, b: Any, c: Any, s: Any) -> Any:
    normal = normalized(xp, b)
    return subtract(a, multiply(normal, 2.0 * dot(a, normal)))


def _refract(xp: Any, a: Any, b: Any, c: Any, s: Any) -> Any:
    normal = normalized(xp, b)
    facing = dot(normal, a)
    k = 1.0 - s * s * (1.0 - facing * facing)
    bent = subtract(multiply(a, s), multiply(normal, s * facing + xp.sqrt(xp.maximum(k, 0.0))))
    return choose(xp, k < 0.0, multiply(a, 0.0), bent)


def _faceforward(xp: Any, a: Any, b: Any, c: Any, s: Any) -> Any:
    return choose(xp, dot(c, b) < 0.0, a, multiply(a, -1.0))


def _channelwise(mode: str) -> Callable[..., Any]:
    return lambda xp, a, b, c, s: each(lambda x, y, z: MATH[mode](xp, x, y, z), a, b, c)


VECTOR_MATH: dict[str, Callable[..., Any]] = {
    **{
        mode: _channelwise(mode)
        for mode in (
            "ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MULTIPLY_ADD", "SNAP", "FLOOR", "CEIL", "WRAP", "ABSOLUTE",
            "MINIMUM", "MAXIMUM", "SINE", "COSINE", "TANGENT", "POWER", "SIGN", "ROUND",
        )
    },
    "FRACTION": _channelwise("FRACT"),
    "MODULO": lambda xp, a, b, c, s: each(lambda x, y: remainder(xp, x, y, xp.trunc), a, b),
    "CROSS_PRODUCT": _cross,
    "PROJECT": _project,
    "REFLECT": _reflect,
    "REFRACT": _refract,
    "FACEFORWARD": _faceforward,
    "SCALE": lambda xp, a, b, c, s: multiply(a, s),
    "NORMALIZE": lambda xp, a, b, c, s: normalized(xp, a),
}  # fmt: skip
VECTOR_NUMBERS: dict[str, Callable[..., Any]] = {
    "DOT_PRODUCT": lambda xp, a, b: dot(a, b),
    "DISTANCE": lambda xp, a, b: length(xp, subtract(a, b)),
    "LENGTH": lambda xp, a, b: length(xp, a),
}


@operation("3 3 3 1", 3)
def vector_math(xp: Any, a: Any, b: Any, c: Any, scale: Any, mode: str) -> Any:
    """Vector Math node whose result is a vector."""
    return VECTOR_MATH[mode](xp, a, b, c, scale)


@operation("3 3", 1)
def vector_number(xp: Any, a: Any, b: Any, mode: str) -> Any:
    """Vector Math node whose result is a number."""
    return VECTOR_NUMBERS[mode](xp, a, b)


@operation("3 3 3 1", 3)
def rotate(xp: Any, vector: Any, center: Any, axis: Any, angle: Any) -> Any:
    """Vector Rotate about an axis; the identity if the axis is zero."""
    k = normalized(xp, axis)
    r = subtract(vector, center)
    cosine, sine = xp.cos(angle), xp.sin(angle)
    turned = add(add(multiply(r, cosine), multiply(cross(k, r), sine)), multiply(k, dot(k, r) * (1.0 - cosine)))
    return choose(xp, dot(axis, axis) > 0.0, add(turned, center), vector)


@operation("3 3 3", 3)
def rotate_euler(xp: Any, vector: Any, center: Any, angles: Any, inverted: bool) -> Any:
    """Vector Rotate by Euler angles."""
    rows = _rotation(xp, angles)
    r = subtract(vector, center)
    return add(_apply_transposed(rows, r) if inverted else _apply(rows, r), center)


@operation("3 3", 1)
def normal_dot(xp: Any, direction: Any, normal: Any) -> Any:
    """Dot output of the Normal node."""
    return dot(direction, normalized(xp, normal))


@operation("3", 3)
def normalize(xp: Any, vector: Any) -> Any:
    """Unit vector."""
    return normalized(xp, vector)
