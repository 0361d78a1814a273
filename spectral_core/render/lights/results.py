# SPDX-License-Identifier: GPL-3.0-or-later
"""Results of sampling lights, and of rays that hit them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from spectral_core.render.lights.balls import Drawn

Rule = Callable[[Any, Any, Any], Any]
"""``rule(number, pdf, active)``: weight of a light, given the density with which it would be drawn."""


@dataclass
class LightSample:
    """A direction to a light: ``point`` up to which nothing may occlude it, light over its density (``value``), the
    density per solid angle, ``delta`` if no other method could have drawn it, and the light's number for rules.
    """

    direction: Any
    point: Any
    value: Any
    pdf: Any
    delta: Any
    number: Any


@dataclass
class Met:
    """Emission along a ray, by its origin: lamps, surfaces, environment.

    ``behind_glass``: the environment that a transparent film omits behind smooth glass, None if it omits none there.
    """

    lamps: Any
    emissive: Any
    world: Any
    behind_glass: Any = None


def either(which: Any, drawn: Drawn, other: Drawn) -> Drawn:
    """Value of each lane from one of two samples."""
    import drjit as dr

    return Drawn(*(dr.select(which, getattr(drawn, n), getattr(other, n)) for n in Drawn.__dataclass_fields__))
