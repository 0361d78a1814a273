# SPDX-License-Identifier: GPL-3.0-or-later
"""How strands of hair scatter light, seen from so far that each is a line: closures about a strand's tangent."""

from __future__ import annotations

from dataclasses import dataclass, field

from spectral_core.scene.paint import Numbers, Paint, Scalar, gray
from spectral_core.scene.shading.program import Computed

STRAND_SIDES = 7
"""Sides of the tubes that strands are made of, with normals that point away from the strand's axis. An odd number: seen
from any direction, the width of seven sides differs by at most 1.7 % from its mean, that of six by 9 %.
"""
STRAND_TANGENT = "attribute_strand_tangent"
"""Attribute of strands: their direction, in object space."""
STRAND_RANDOM = "attribute_strand_random"
"""Attribute of strands: a random number in [0, 1] for each, three times."""
STRAND_AXIS = "attribute_strand_axis"
"""Attribute of strands: direction of the larger axis of an elliptical cross-section, in object space."""
STRAND_PLACE = "attribute_strand_place"
"""Attribute of strands: the share of the strand before a point, the strand's length, its thickness at the point."""

FUR = (0.245, 5.574, -10.73, 2.532, -0.215, 5.969)
"""Coefficients, highest power first, of the polynomial in the radial roughness by which the color of a coat of fibers
determines their absorption (Chiang et al. 2016, equation 9).
"""
SCALES_RAD = 0.0349
"""Tilt of the cuticle's scales unless one is given: the default of Blender, about 2°."""


@dataclass(frozen=True, slots=True, eq=False)
class Hair(Numbers):
    """A fiber that reflects, transmits, and reflects inside (Chiang et al. 2016, "A practical and controllable hair and
    fur model for production path tracing").

    ``color``: with ``is_fur``, that of a coat of many fibers; else the transmittance of a depth of one radius, for an
    absorption coefficient of -ln(color) · ``depth``. ``roughness`` along the strand, ``radial_roughness`` around it;
    ``coat``: share by which the first reflection is less rough; ``offset_rad``: tilt of the cuticle's scales.
    ``tangent``: direction of the strand in the world; where it is 0, as on meshes, ``edge`` is it.
    """

    color: Paint = field(default_factory=lambda: gray(0.5))
    is_fur: bool = True
    depth: Scalar = 1.0
    roughness: Scalar = 0.3
    radial_roughness: Scalar = 0.3
    coat: Scalar = 0.0
    ior: Scalar = 1.55
    offset_rad: Scalar = SCALES_RAD
    tangent: Computed | None = None
    edge: Computed | None = None


@dataclass(frozen=True, slots=True, eq=False)
class EllipseHair(Numbers):
    """A fiber with an elliptical cross-section and facets of GGX (Huang, Hullin and Hanika 2022, "A microfacet-based
    hair scattering model"), averaged over its width.

    ``roughness``: alpha of the facets, by which ``color`` gives the absorption as well if ``is_fur``;
    ``aspect_ratio``: of the smaller to the larger half axis, or its inverse; ``major_axis``: direction of the larger
    one in the world; ``reflection``, ``transmission``, ``secondary_reflection``: factors on the light that is
    reflected, passes, and is reflected inside once. Other fields as in ``Hair``.
    """

    color: Paint = field(default_factory=lambda: gray(0.5))
    is_fur: bool = True
    depth: Scalar = 1.0
    roughness: Scalar = 0.3
    ior: Scalar = 1.55
    offset_rad: Scalar = SCALES_RAD
    aspect_ratio: Scalar = 0.85
    reflection: Scalar = 1.0
    transmission: Scalar = 1.0
    secondary_reflection: Scalar = 1.0
    tangent: Computed | None = None
    edge: Computed | None = None
    major_axis: Computed | None = None


@dataclass(frozen=True, slots=True, eq=False)
class HairLobe(Numbers):
    """One lobe of a strand, around its mirrored direction or, ``transmits``, its continued one.

    ``roughness_along`` and ``roughness_around`` the strand, ``offset_rad``, ``tangent`` and ``edge`` as in ``Hair``;
    along an edge there is no offset.
    """

    color: Paint = field(default_factory=lambda: gray(0.8))
    transmits: bool = False
    roughness_along: Scalar = 0.1
    roughness_around: Scalar = 1.0
    offset_rad: Scalar = 0.0
    tangent: Computed | None = None
    edge: Computed | None = None
