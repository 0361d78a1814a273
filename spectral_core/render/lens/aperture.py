# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of a lens aperture: a disk or a regular polygon, narrowed in one direction."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from spectral_core.scene import Aperture, Camera

FEWEST_BLADES = 3
"""Fewer blades leave a circle open."""


def width_of_lens(camera: Camera) -> float:
    """Largest diameter of the open lens, which a ratio below 1 widens to the sides."""
    return 2 * camera.aperture_radius * max(1.0, 1 / camera.aperture.ratio)


def in_polygon(aperture: Aperture, draw: Any, m: Any, number: Callable[[float], Any]) -> tuple[Any, Any]:
    """Evenly distributed points of a polygon in the unit circle; before it is rotated, its first corner is at the
    right.

    ``draw``: two arrays in [0, 1); ``m``: as for ``panorama.direction_of``.
    """
    return polygon_point(number(aperture.blades), number(aperture.rotation_rad), draw, m)


def polygon_point(blades: Any, turned: Any, draw: Any, m: Any) -> tuple[Any, Any]:
    """``in_polygon`` with numbers of any type, the rotation in rad."""
    sector = m.floor(draw[0] * blades)
    # a triangle from the middle to one edge: the root spreads evenly over it
    out = m.sqrt(draw[0] * blades - sector)
    along = draw[1] * out
    half = np.pi / blades
    x, y = out * m.cos(half), (out - 2.0 * along) * m.sin(half)
    turn = turned + 2.0 * half * sector
    return m.cos(turn) * x - m.sin(turn) * y, m.sin(turn) * x + m.cos(turn) * y


def lens_point(mi: Any, aperture: Aperture, draw: Any, m: Any, number: Callable[[float], Any]) -> Any:
    """A point of the aperture of a lens of radius 1; ``draw``: an ``mi.Point2f`` in [0, 1)."""
    if aperture.blades < FEWEST_BLADES:
        point = mi.warp.square_to_uniform_disk_concentric(draw)
    else:
        point = mi.Point2f(*in_polygon(aperture, (draw.x, draw.y), m, number))
    return point if aperture.ratio == 1 else mi.Point2f(point.x / number(aperture.ratio), point.y)
