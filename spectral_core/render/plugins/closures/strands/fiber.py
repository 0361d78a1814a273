# SPDX-License-Identifier: GPL-3.0-or-later
"""A strand at a hit, and the distributions of light around it."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, factorial, log, pi
from typing import Any

from spectral_core.render.plugins.closures.facets.upright import toward_viewer
from spectral_core.scene.hair import FUR, STRAND_SIDES

FIBER = 0x1000
"""Mitsuba's flag ``Anisotropic``, which marks strands: no direction is on the wrong side of them."""
LEAST, MOST = 1e-3, 1.0
"""Range of roughnesses."""


@dataclass
class Fiber:
    """Axes of a strand at a hit, in the world: ``along`` it, ``across`` it and the view, ``away`` from the viewer.

    ``height``: place of the ray across the strand, -1 to 1. ``toward``: direction to the viewer. ``is_strand``: False
    on meshes.
    """

    along: Any
    across: Any
    away: Any
    height: Any
    toward: Any
    is_strand: Any


def fiber_at(mi: Any, dr: Any, si: Any, tangent: Any, edge: Any) -> Fiber:
    """The strand at a hit; a mesh has them along an edge of the triangle, as in Cycles."""
    toward = toward_viewer(mi, dr, si)
    is_strand = dr.squared_norm(tangent) > 1e-12
    along = dr.select(is_strand, tangent, dr.mulsign(edge, dr.dot(si.n, toward)))
    size = dr.norm(along)
    along = dr.select(size > 1e-12, along / dr.maximum(size, 1e-12), mi.coordinate_system(si.n)[0])
    across = dr.cross(along, toward)
    size = dr.norm(across)
    across = dr.select(size > 1e-6, across / dr.maximum(size, 1e-6), mi.coordinate_system(along)[0])
    away = dr.cross(along, across)

    def angle(normal: Any) -> Any:
        return dr.atan2(dr.dot(normal, across), -dr.dot(normal, away))

    outer = mi.Vector3f(dr.mulsign(si.n, dr.dot(si.n, toward)))
    smooth, flat = angle(mi.Vector3f(si.sh_frame.n)), angle(mi.Vector3f(si.n))
    place = _place_on_tube(dr, smooth, flat)
    height = -dr.clip(dr.select(is_strand, place, dr.dot(outer, across)), -1.0, 1.0)
    return Fiber(along, across, away, height, toward, is_strand)


def _place_on_tube(dr: Any, smooth: Any, flat: Any) -> Any:
    """Place of a hit across a tube of flat walls, -1 to 1 over its width from here, by the angles of both normals."""
    sector = 2 * pi / STRAND_SIDES

    def reach(direction: float) -> Any:
        """How far the vertices reach toward an angle; they lie half a sector from the middle of each wall."""
        off = (direction - flat) / sector - 0.5
        return dr.cos(sector * (off - dr.floor(off + 0.5)))

    right, left = reach(0.5 * pi), reach(-0.5 * pi)
    across = dr.sin(smooth) * cos(sector / 2) / dr.maximum(dr.cos(smooth - flat), 0.1)
    return (2.0 * across - right + left) / (right + left)


def log_bessel(dr: Any, x: Any) -> Any:
    """Logarithm of the modified Bessel function I₀ of a positive number."""
    small, quarter = dr.minimum(x, 12.0), 0.25 * dr.square(dr.minimum(x, 12.0))
    series = 0.0 * small
    for k in range(18, -1, -1):  # Horner's rule; the coefficients are 1 / (k!)²
        series = series * quarter + 1.0 / float(factorial(k)) ** 2
    large = x + 0.5 * (1.0 / (8.0 * dr.maximum(x, 1.0)) - log(2 * pi) - dr.log(dr.maximum(x, 1.0)))
    return dr.select(x > 12.0, large, dr.log(series))


def longitudinal(dr: Any, light: tuple[Any, Any], view: tuple[Any, Any], v: Any) -> Any:
    """Density over inclinations, given by their sine and cosine, of variance ``v`` (d'Eon et al. 2011)."""
    inverse = dr.rcp(v)
    exponent = log_bessel(dr, light[1] * view[1] * inverse) - light[0] * view[0] * inverse
    # over 2 v sinh(1 / v), without overflow
    return dr.exp(exponent - inverse) / ((1.0 - dr.exp(-2.0 * inverse)) * v)


def logistic_scale(dr: Any, roughness: Any) -> Any:
    """Scale of the logistic distribution around a fiber of a radial roughness (Chiang et al. 2016, equation 8)."""
    return (0.265 * roughness + 1.194 * dr.square(roughness) + 5.372 * roughness**22) * (pi / 8) ** 0.5


def absorption_of_fur(dr: Any, depth: Any, roughness: Any) -> Any:
    """Absorption coefficient that gives a coat of fibers a color, whose negative logarithm is ``depth``."""
    fit = FUR[0]
    for coefficient in FUR[1:]:
        fit = fit * roughness + coefficient
    return dr.square(depth / fit)


def shares_of_lobes(dr: Any, reflected: Any, passed: Any) -> tuple[Any, Any, Any]:
    """Shares of light that passes through a fiber, leaves it after one reflection inside, and after more of them.

    ``reflected``: Fresnel reflectance of the surface; ``passed``: transmittance of one way through the inside. The sum
    of all reflections is a geometric series.
    """
    once = dr.square(1.0 - reflected) * passed
    twice = once * passed * reflected
    return once, twice, twice * passed * reflected / dr.maximum(1.0 - passed * reflected, 1e-6)


def wrapped(dr: Any, angle: Any) -> Any:
    """An angle in -π to π."""
    return angle - 2 * pi * dr.floor(angle / (2 * pi) + 0.5)


def cumulative(dr: Any, x: Any, s: Any) -> Any:
    """Share of the logistic distribution of scale ``s`` below ``x``."""
    return dr.rcp(1.0 + dr.exp(dr.minimum(-x / s, 80.0)))


def trimmed_logistic(dr: Any, x: Any, s: Any) -> Any:
    """Logistic density of scale ``s``, limited to -π to π."""
    tail = dr.exp(-dr.abs(x) / s)
    return tail / (s * dr.square(1.0 + tail)) / (1.0 - 2.0 * cumulative(dr, -pi, s))


def as_sample(mi: Any, dr: Any, si: Any, outward: Any, reflects: Any, found: tuple[Any, Any], active: Any) -> Any:
    """A drawn world direction as Mitsuba's sample, and its value over the density; ``found``: value and density."""
    value, density = found
    valid = active & (density > 1e-12) & dr.isfinite(density)
    bs = dr.zeros(mi.BSDFSample3f)
    bs.wo, bs.eta, bs.pdf = si.to_local(outward), mi.Float(1.0), dr.select(valid, density, 0.0)
    kinds = (int(kind) | FIBER for kind in (mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.GlossyTransmission))
    bs.sampled_type = dr.select(reflects, *(mi.UInt32(kind) for kind in kinds))
    return bs, dr.select(valid, value / dr.maximum(density, 1e-12), 0.0)
