# SPDX-License-Identifier: GPL-3.0-or-later
"""Elliptical cross-section of a strand, with facets of GGX on it."""

from __future__ import annotations

from math import pi
from typing import Any


class Section:
    """An ellipse with half axes 1 along x and ``aspect`` along z, seen from the local direction ``wi``.

    A point is ``(sin γ, aspect · cos γ)``. Heights are across the view, positive to one side.
    """

    def __init__(self, mi: Any, dr: Any, aspect: Any, wi: Any) -> None:
        self.mi, self.dr, self.aspect = mi, dr, aspect
        flat = dr.maximum(dr.safe_sqrt(dr.square(wi.x) + dr.square(wi.z)), 1e-6)
        self.sine, self.cosine = wi.x / flat, wi.z / flat
        self.radius = dr.sqrt(dr.square(self.cosine) + dr.square(aspect * self.sine))

    def heights(self, half_span: Any) -> tuple[Any, Any]:
        """Heights of the ends of the visible range of azimuths."""
        dr, middle = self.dr, self.dr.atan2(self.sine, self.cosine)
        found = []
        for azimuth in (middle + half_span, middle - half_span):
            (sine, cosine) = dr.sincos(azimuth)
            size = dr.rcp(dr.sqrt(dr.square(sine) + dr.square(self.aspect * cosine)))
            found.append((-self.cosine * sine + self.aspect * self.sine * self.aspect * cosine) * size)
        return found[0], found[1]

    def angle_at(self, height: Any) -> Any:
        """γ at a height over the radius."""
        dr = self.dr
        return dr.atan2(self.cosine, -self.aspect * self.sine) - dr.safe_acos(-height)

    def angle_per_height(self, gamma: Any) -> Any:
        """Derivative of γ by the height in half axes."""
        sine, cosine = self.dr.sincos(gamma)
        return self.dr.rcp(self.dr.maximum(self.cosine * cosine + self.aspect * self.sine * sine, 1e-4))

    def turned(self, angle: Any) -> Any:
        """Azimuth by which light that travels at an angle turns γ."""
        sine, cosine = self.dr.sincos(angle)
        return self.dr.atan2(self.aspect * sine, cosine)

    def normal(self, tilt: Any, gamma: Any) -> Any:
        """Direction of the outer normal at γ, tilted along the strand."""
        dr = self.dr
        (sine, cosine), (up, level) = dr.sincos(gamma), dr.sincos(self.mi.Float(tilt))
        size = dr.rsqrt(dr.maximum(dr.square(self.aspect * sine) + dr.square(cosine), 1e-12))
        return self.mi.Vector3f(self.aspect * sine * size * level, up, cosine * size * level)

    def arc(self, gamma: Any) -> Any:
        """Length of the ellipse per γ."""
        dr = self.dr
        return dr.safe_sqrt(1.0 - (1.0 - dr.square(self.aspect)) * dr.square(dr.sin(gamma)))

    def chord(self, first: Any, second: Any) -> Any:
        """Distance of two points of the ellipse."""
        dr = self.dr
        (a, b), (c, d) = dr.sincos(first), dr.sincos(second)
        return dr.sqrt(dr.square(a - c) + dr.square(self.aspect * (b - d)))

    def sees(self, direction: Any, normal: Any, facet: Any) -> Any:
        """True if a facet and the surface that has it face a direction."""
        dr = self.dr
        return (dr.dot(direction, normal) > 0.0) & (dr.dot(direction, facet) > 0.0)

    def _shadow(self, alpha: Any, cosine: Any) -> Any:
        dr = self.dr
        tangent = dr.maximum(dr.rcp(dr.maximum(dr.square(cosine), 1e-9)) - 1.0, 0.0)
        return 0.5 * (dr.sqrt(1.0 + dr.square(alpha) * tangent) - 1.0)

    def masked(self, alpha: Any, first: Any, second: Any) -> Any:
        """Share of facets that both directions see (Heitz 2014)."""
        return self.dr.rcp(1.0 + self._shadow(alpha, first) + self._shadow(alpha, second))

    def masked_after(self, alpha: Any, first: Any, second: Any) -> Any:
        """That share of the facets that the first direction sees."""
        one = self._shadow(alpha, first)
        return (1.0 + one) / (1.0 + one + self._shadow(alpha, second))

    def facets(self, alpha: Any, cosine: Any) -> Any:
        """Density of facets."""
        dr = self.dr
        squared, a = dr.minimum(dr.square(cosine), 1.0), dr.square(alpha)
        return a / (pi * dr.square(1.0 - squared + a * squared))

    def drawn(self, alpha: Any, direction: Any, normal: Any, one: Any, two: Any) -> Any:
        """A facet that a direction sees."""
        mi = self.mi
        frame = mi.Frame3f(normal)
        facets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, True)
        return frame.to_world(facets.sample(frame.to_local(direction), mi.Point2f(one, two))[0])


def inside(mi: Any, dr: Any, wi: Any, facet: Any, eta: Any) -> tuple[Any, Any, Any]:
    """Refracted direction at a facet, the share that passes, and the cosine to the facet."""
    facing = dr.dot(wi, facet)
    reflected, inner, _, _ = mi.fresnel(facing, eta)
    return (facing / eta - dr.abs(inner)) * facet - wi / eta, 1.0 - reflected, facing


def mirrored(dr: Any, direction: Any, facet: Any) -> Any:
    """The reverse of a direction of travel after a facet."""
    return 2.0 * dr.dot(direction, facet) * facet - direction
