# SPDX-License-Identifier: GPL-3.0-or-later
"""Facets of Ashikhmin and Shirley 2000, "An anisotropic Phong BRDF model": without a Fresnel factor, as in Cycles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from spectral_core.render.plugins.closures.facets.microfacet import SMALLEST_ALPHA


@dataclass
class Phong:
    """Facets of ``roughness``, with the methods of ``Microfacets``. ``stretch``: factors on alpha along and across.

    ``least``: alpha that Filter Glossy gives to narrower lobes.
    """

    mi: Any
    dr: Any
    roughness: Any
    stretch: tuple[Any, Any] | None = None
    least: Any = 0.0

    def __post_init__(self) -> None:
        alpha = self.dr.square(self.roughness)
        both = (alpha, alpha) if self.stretch is None else (alpha * factor for factor in self.stretch)
        least = self.dr.maximum(self.least, SMALLEST_ALPHA)
        self.along, self.across = (self._exponent(self.dr.clip(value, least, 1.0)) for value in both)

    def _exponent(self, alpha: Any) -> Any:
        return 2.0 / self.dr.square(alpha) - 2.0

    def mirrored(self, wi: Any, sample: Any) -> tuple[Any, Any]:
        """Sampled direction, whose length may exceed 1, and the cosine to its facet."""
        mi, dr = self.mi, self.dr
        # the azimuth, by quadrants (Eq. 9), and the cosine along it (Eq. 10)
        quarter = 4.0 * sample.x
        number = dr.floor(quarter)
        within = quarter - number
        # back and forth, so that neighboring samples give neighboring directions
        odd = (number == 1.0) | (number == 3.0)
        place = dr.select(odd, 1.0 - within, within)
        ratio = dr.sqrt((self.along + 1.0) / (self.across + 1.0))
        angle = dr.atan(ratio * dr.tan(0.5 * dr.pi * dr.clip(place, 0.0, 1.0 - 1e-6)))
        sine, cosine = dr.sincos(angle)
        x = dr.select((number == 1.0) | (number == 2.0), -cosine, cosine)
        y = dr.select(number >= 2.0, -sine, sine)
        exponent = self.along * dr.square(cosine) + self.across * dr.square(sine)
        z = dr.maximum(1.0 - sample.y, 1e-9) ** dr.rcp(exponent + 1.0)
        flat = dr.safe_sqrt(1.0 - z * z)
        normal = mi.Vector3f(x * flat, y * flat, z)
        facing = dr.dot(wi, normal)
        # As in Cycles, a facet that turns away from the viewer mirrors, too, by the size of its cosine. The direction
        # is then longer than 1, and no density counts it, so that it shows more of an even world than of a lamp.
        return 2.0 * dr.abs(facing) * normal - wi, facing

    def reflection(self, wi: Any, wo: Any) -> tuple[Any, Any, Any]:
        """Value · cosine and density of a white surface, 0 below it, and the cosine to the facet."""
        dr = self.dr
        half = dr.normalize(wi + wo)
        facing = dr.maximum(dr.abs(dr.dot(wi, half)), 1e-6)
        height = dr.clip(half.z, 1e-6, 1.0)
        flat = 1.0 - dr.square(height)
        exponent = (self.along * dr.square(half.x) + self.across * dr.square(half.y)) / dr.maximum(flat, 1e-9)
        lobe = dr.select(flat > 1e-9, height**exponent, 1.0)
        lobe *= dr.sqrt((self.along + 1.0) * (self.across + 1.0)) / (8.0 * dr.pi)
        above = (wi.z > 0.0) & (wo.z > 0.0)
        density = dr.select(above, lobe / facing, 0.0)
        return density * wo.z / dr.maximum(dr.maximum(wi.z, wo.z), 1e-6), density, facing
