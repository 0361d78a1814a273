# SPDX-License-Identifier: GPL-3.0-or-later
"""Ways through media as a light sees them: where along a ray a lamp is asked for, by the square of its distance.

Kulla and Fajardo 2012, "Importance sampling techniques for path tracing in participating media": places at equal
angles about the lamp. Angles are told by their difference, which keeps its digits for lamps far from the way.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass
class Stretch:
    """A way through a medium: from ``origin`` along ``direction`` (unit) for ``length``."""

    origin: Any
    direction: Any
    length: Any

    def seen_from(self, center: Any, radius: Any) -> View:
        """The way as a lamp of a radius around ``center`` sees it."""
        import drjit as dr

        away = center - self.origin
        foot = dr.dot(away, self.direction)
        # a way through the lamp's middle or its body is as close as its rim
        least = dr.maximum(radius, 1e-6 * dr.max(dr.abs(away)))
        distance = dr.maximum(dr.maximum(dr.norm(away - self.direction * foot), least), 1e-15)
        span = dr.atan2(self.length * distance, distance * distance + foot * (foot - self.length))
        return View(foot, distance, span, self.length)


@dataclass
class View:
    """``foot``: distance along the way to the point nearest to the lamp, ``distance`` from there; ``span``: angle that
    the way of a ``length`` takes up.
    """

    foot: Any
    distance: Any
    span: Any
    length: Any

    @property
    def fluence(self) -> Any:
        """The integral of one over the squared distance along the way."""
        return self.span / self.distance

    def draw(self, sample: Any) -> Any:
        """Distance along the way at an even angle."""
        import drjit as dr

        sine, cosine = dr.sincos(sample * self.span)
        below = self.distance * cosine + self.foot * sine
        drawn = sine * (dr.square(self.distance) + dr.square(self.foot)) / dr.maximum(below, 1e-30)
        return dr.clip(drawn, 0.0, self.length)

    def density(self, along: Any) -> Any:
        """Density of ``draw`` per length, 0 beyond the way."""
        import drjit as dr

        per = self.span * (dr.square(self.distance) + dr.square(along - self.foot))
        return dr.select(along <= self.length, self.distance / dr.maximum(per, 1e-30), 0.0)
