# SPDX-License-Identifier: GPL-3.0-or-later
"""Panoramic cameras: from a position in the picture to a direction, over NumPy or Dr.Jit arrays.

Directions are in the camera's own space: it looks along -Z, +Y up.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from spectral_core.scene import Panorama

Direction = tuple[Any, Any, Any]
Numbers = list[Any]


def direction_of(panorama: Panorama, picture: Any, m: Any, number: Callable[[float], Any]) -> tuple[Direction, Any]:
    """Unit direction of a position in the picture (two arrays, 0 to 1, right and up), and True if there is one.

    ``m``: the module whose ``sin``, ``where`` and the like the arrays understand, see ``NUMPY``.
    """
    return direction_by(panorama.kind, [number(value) for value in panorama.numbers], picture, m)


def direction_by(kind: str, numbers: Numbers, picture: Any, m: Any) -> tuple[Direction, Any]:
    """``direction_of`` with numbers of any type."""
    direction, is_seen = _KINDS[kind](numbers, picture[0], picture[1], m)
    size = m.sqrt(sum(part * part for part in direction))
    return tuple(part / size for part in direction), is_seen


def _sphere(longitude: Any, latitude: Any, m: Any) -> Direction:
    """A direction by its angles to the right of the view and above the horizon."""
    return m.sin(longitude) * m.cos(latitude), m.sin(latitude), -m.cos(longitude) * m.cos(latitude)


def _around(angle: Any, x: Any, y: Any, m: Any) -> Direction:
    """A direction at an angle to the view axis, toward a position in the picture."""
    distance = m.maximum(m.sqrt(x * x + y * y), 1e-20)
    return m.sin(angle) * x / distance, m.sin(angle) * y / distance, -m.cos(angle)


def _equirectangular(numbers: Numbers, x: Any, y: Any, m: Any) -> tuple[Direction, Any]:
    left, right, low, high = numbers
    return _sphere(left + (right - left) * x, low + (high - low) * y, m), x > -np.inf


def _equidistant(numbers: Numbers, x: Any, y: Any, m: Any) -> tuple[Direction, Any]:
    x, y = 2.0 * x - 1.0, 2.0 * y - 1.0
    distance = m.sqrt(x * x + y * y)
    return _around(distance * numbers[0] * 0.5, x, y, m), distance <= 1.0


def _equisolid(numbers: Numbers, x: Any, y: Any, m: Any) -> tuple[Direction, Any]:
    lens, view, width, height = numbers
    x, y = (x - 0.5) * width, (y - 0.5) * height
    distance = m.sqrt(x * x + y * y)
    inside = distance <= 2.0 * lens * m.sin(view * 0.25)
    return _around(2.0 * m.asin(m.minimum(distance / (2.0 * lens), 1.0)), x, y, m), inside


def _polynomial(numbers: Numbers, x: Any, y: Any, m: Any) -> tuple[Direction, Any]:
    *coefficients, view, width, height = numbers
    x, y = (x - 0.5) * width, (y - 0.5) * height
    distance = m.sqrt(x * x + y * y)
    angle = 0.0 * distance
    for coefficient in reversed(coefficients):
        angle = angle * distance + coefficient
    return _around(-angle, x, y, m), m.absolute(angle) <= 0.5 * view


def _mirror_ball(numbers: Numbers, x: Any, y: Any, m: Any) -> tuple[Direction, Any]:
    """Direction that a mirror ball reflects toward a distant camera in front of it."""
    x, y = 2.0 * x - 1.0, 2.0 * y - 1.0
    squared = x * x + y * y
    toward = m.sqrt(m.maximum(1.0 - squared, 0.0))
    return (2.0 * toward * x, 2.0 * toward * y, 1.0 - 2.0 * toward * toward), squared <= 1.0


def _cube_face(numbers: Numbers, x: Any, y: Any, m: Any) -> tuple[Direction, Any]:
    quarter = 0.5 * np.pi
    return (m.tan((x - 0.5) * quarter), m.tan((y - 0.5) * quarter), 0.0 * x - 1.0), x > -np.inf


def _cylinder(numbers: Numbers, x: Any, y: Any, m: Any) -> tuple[Direction, Any]:
    left, right, low, high = numbers
    longitude = left + (right - left) * x
    return (m.sin(longitude), low + (high - low) * y, -m.cos(longitude)), x > -np.inf


_KINDS: dict[str, Callable[[Numbers, Any, Any, Any], tuple[Direction, Any]]] = {
    "equirectangular": _equirectangular,
    "fisheye_equidistant": _equidistant,
    "fisheye_equisolid": _equisolid,
    "fisheye_polynomial": _polynomial,
    "mirror_ball": _mirror_ball,
    "cube_face": _cube_face,
    "cylinder": _cylinder,
}


class NumPyMath:
    """Functions that the projections use, on NumPy arrays."""

    sin, cos, tan, asin, sqrt = np.sin, np.cos, np.tan, np.arcsin, np.sqrt
    minimum, maximum, absolute, where, floor = np.minimum, np.maximum, np.abs, np.where, np.floor


class DrJitMath:
    """The same on Dr.Jit arrays."""

    def __init__(self, dr: Any) -> None:
        self.sin, self.cos, self.tan, self.asin, self.sqrt = dr.sin, dr.cos, dr.tan, dr.safe_asin, dr.safe_sqrt
        self.minimum, self.maximum, self.absolute, self.where = dr.minimum, dr.maximum, dr.abs, dr.select
        self.floor = dr.floor
