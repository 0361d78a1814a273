# SPDX-License-Identifier: GPL-3.0-or-later
"""Segments of rays in media, and points on them by equiangular sampling: density inverse to the squared distance.

Kulla and Fajardo 2012, "Importance sampling techniques for path tracing in participating media". The angle of a segment
is computed as one difference, which keeps its precision for lamps far from the segment.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass
class Stretch:
    """A segment in a medium: from ``origin`` along ``direction`` (unit) for ``length``."""

    origin: Any
    direction: Any
    length: Any

    def seen_from(self, center: Any, radius: Any) -> View:
        """The segment relative to a lamp of a radius around ``center``."""
        import drjit as dr

        away = center - self.origin
        foot = dr.dot(away, self.direction)
        # a segment through the lamp's body counts as one at its radius
        least = dr.maximum(radius, 1e-6 * dr.max(dr.abs(away)))
        distance = dr.maximum(dr.maximum(dr.norm(away - self.direction * foot), least), 1e-15)
        span = dr.atan2(self.length * distance, distance * distance + foot * (foot - self.length))
        return View(foot, distance, span, self.length)


@dataclass
class View:
    """``foot``: distance along the segment to the point nearest to the lamp, ``distance`` of that point;
    ``span``: angle of the segment at the lamp; ``length`` of the segment.
    """

    foot: Any
    distance: Any
    span: Any
    length: Any

    @property
    def fluence(self) -> Any:
        """Integral of the inverse squared distance along the segment."""
        return self.span / self.distance

    def draw(self, sample: Any) -> Any:
        """Distance along the segment, uniform in angle."""
        import drjit as dr

        sine, cosine = dr.sincos(sample * self.span)
        below = self.distance * cosine + self.foot * sine
        drawn = sine * (dr.square(self.distance) + dr.square(self.foot)) / dr.maximum(below, 1e-30)
        return dr.clip(drawn, 0.0, self.length)

    def density(self, along: Any) -> Any:
        """Density of ``draw`` per length, 0 beyond the segment."""
        import drjit as dr

        per = self.span * (dr.square(self.distance) + dr.square(along - self.foot))
        return dr.select(along <= self.length, self.distance / dr.maximum(per, 1e-30), 0.0)
