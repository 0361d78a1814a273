# SPDX-License-Identifier: GPL-3.0-or-later
"""Distribution of a lamp's light: cones, measured luminaires, falloff with distance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.plugins.lamps.patterns import lamp_place
from spectral_core.render.plugins.numbers import opaque_number, table
from spectral_core.scene import Photometry
from spectral_core.spectra.luminaire import every_degree


def _number(value: float) -> Any:
    import drjit
    import mitsuba

    return opaque_number(mitsuba, drjit, value)


class _Axes:
    """Transforms a direction in world space to the light's scaled axes, the third along its beam."""

    def __init__(self, own_from_world: NDArray[np.float64]) -> None:
        self.rows = [[_number(float(value)) for value in row] for row in own_from_world]

    def __call__(self, direction: Any) -> Any:
        import drjit as dr
        import mitsuba as mi

        return dr.normalize(mi.Vector3f(*(dr.dot(direction, mi.Vector3f(*row)) for row in self.rows)))


class Cone:
    """The cone of a spot: Cycles' spot_light_attenuation, a smooth step in the cosine from the edge inward."""

    def __init__(self, own_from_world: NDArray[np.float64], cosine: float, blend: float) -> None:
        self.axes, self.cosine = _Axes(own_from_world), _number(cosine)
        self.softness = _number(max(1e-6, (1.0 - cosine) * blend))

    def __call__(self, toward_receiver: Any) -> Any:
        import drjit as dr

        step = dr.clip((self.axes(toward_receiver).z - self.cosine) / self.softness, 0.0, 1.0)
        return step * step * (3.0 - 2.0 * step)


class Luminaire:
    """Strength by direction: a (horizontal, vertical) table at every degree, linear in between."""

    def __init__(self, own_from_world: NDArray[np.float64], measured: Photometry) -> None:
        import mitsuba as mi

        self.axes = _Axes(own_from_world)
        strengths = degrees_of(measured)
        self.wraps = len(strengths) > 1
        self.table = table(mi.Float, strengths)

    def __call__(self, toward_receiver: Any) -> Any:
        import drjit as dr
        import mitsuba as mi

        local = self.axes(toward_receiver)
        vertical = dr.safe_acos(local.z) * (180.0 / dr.pi)
        if not self.wraps:
            return self._along(mi.UInt32(0), vertical)
        # Cycles counts the angle about the light from its -Y; the beam's axes here are turned about X
        horizontal = (dr.atan2(local.x, -local.y) + dr.pi) * (180.0 / dr.pi)
        low = dr.minimum(mi.UInt32(horizontal), 359)
        first, second = self._along(low, vertical), self._along(low + 1, vertical)
        return dr.lerp(first, second, horizontal - mi.Float(low))

    def _along(self, row: Any, vertical: Any) -> Any:
        """One row's value at a vertical angle in degrees."""
        import drjit as dr
        import mitsuba as mi

        low = dr.minimum(mi.UInt32(vertical), 179)
        start = row * 181 + low
        first, second = dr.gather(mi.Float, self.table, start), dr.gather(mi.Float, self.table, start + 1)
        return dr.lerp(first, second, vertical - mi.Float(low))


def degrees_of(measured: Photometry) -> NDArray[np.float64]:
    """The table of a luminaire at every degree: (1 or 361, 181)."""
    return every_degree(measured.vertical_rad, measured.horizontal_rad, measured.strength)


class Shaping:
    """A product of factors of the direction, and the falloff with distance: dᵖ · d² / (s + d²).

    ``pattern``: texture of a factor that varies (``lamps.patterns``), None for none; ``is_far``: True for a sun.
    """

    def __init__(
        self, factors: Sequence[Callable[[Any], Any]] = (), power: int = 0, smooth: float = 0.0, *,
        pattern: Any = None, is_far: bool = False,
    ) -> None:  # fmt: skip
        self.factors, self.power = tuple(factors), power
        self.smooth = _number(smooth) if smooth > 0 else None
        self.pattern, self.is_far = pattern, is_far

    def tint(self, spot: tuple[Any, Any], toward_receiver: Any, distance: Any, it: Any, active: Any) -> Any:
        """The factor that varies, at a point of the lamp and its normal (``spot``)."""
        import drjit as dr
        import mitsuba as mi

        if self.pattern is None:
            return mi.Float(1.0)
        point, normal = spot
        if self.is_far:  # Cycles puts the points of a sun at the direction that its light travels in
            point, normal, distance = mi.Point3f(toward_receiver), toward_receiver, mi.Float(dr.inf)
        place = lamp_place(point, normal, (toward_receiver, distance), it)
        return self.pattern.eval(place, active)

    def __call__(self, toward_receiver: Any, distance: Any) -> Any:
        import mitsuba as mi

        amount = mi.Float(1.0)
        for factor in self.factors:
            amount *= factor(toward_receiver)
        for _ in range(self.power):
            amount *= distance
        if self.smooth is not None:
            squared = distance * distance
            amount *= squared / (self.smooth + squared)
        return amount
