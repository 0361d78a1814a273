# SPDX-License-Identifier: GPL-3.0-or-later
"""Turns of a walk below the surface toward the side that it entered by, or toward the opposite side if that is near.

Where light diffuses, the directions and steps that lead out are known in advance. Křivánek and d'Eon 2014, "A
zero-variance-based sampling scheme for Monte Carlo subsurface scattering"; Meng, Hanika and Dachsbacher 2016,
"Improving the Dwivedi sampling scheme"; d'Eon and Křivánek 2020, "Zero-variance theory for efficient subsurface
scattering". Some turns stay those of the phase function, so that no weight becomes large.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any

GUIDED = 0.75
"""Share of guided turns in a walk that scatters evenly; less while it scatters forward."""
LENGTHS = (1.001, 1e3)
"""Range of the diffusion length, in mean free paths."""
REACH = 10.0
"""Mean free paths within which an opposite side counts as near."""


def diffusion_length(dr: Any, albedo: Any) -> Any:
    """Diffusion length in mean free paths (d'Eon and Křivánek 2020, Eq. 67)."""
    kept = albedo ** (2.44294 - 0.0215813 * albedo + 0.578637 / albedo)
    return dr.clip(dr.rsqrt(dr.maximum(1.0 - kept, 1e-12)), *LENGTHS)


def drawn_cosine(dr: Any, length: Any, spread: Any, sample: Any) -> Any:
    """Cosine of a guided direction to the shortest way out (Meng et al. 2016, Eq. 10); ``spread``: of ``Guide``."""
    return dr.clip(length - (length + 1.0) * dr.exp(-sample * spread), -1.0, 1.0)


def cosine_density(length: Any, spread: Any, cosine: Any) -> Any:
    """Density of ``drawn_cosine`` (Meng et al. 2016, Eq. 9)."""
    return 1.0 / ((length - cosine) * spread)


def scattering(mi: Any, dr: Any, g: Any, sample: Any) -> Any:
    """Direction about +z by Henyey and Greenstein."""
    square = dr.square((1.0 - g * g) / (1.0 - g + 2.0 * g * sample.x))
    cosine = dr.select(
        dr.abs(g) < 1e-3, 1.0 - 2.0 * sample.x, (1.0 + g * g - square) / (2.0 * dr.select(g == 0.0, 1.0, g))
    )
    return around(mi, dr, cosine, sample.y)


def around(mi: Any, dr: Any, cosine: Any, sample: Any) -> Any:
    """Direction of a cosine to +z, at an even angle about it."""
    sine = dr.safe_sqrt(1.0 - cosine * cosine)
    y, x = dr.sincos(2.0 * pi * sample)
    return mi.Vector3f(sine * x, sine * y, cosine)


def phase(dr: Any, g: Any, cosine: Any) -> Any:
    """Density of ``scattering`` over directions."""
    bent = dr.maximum(1.0 + g * g - 2.0 * g * cosine, 1e-6)
    return (1.0 - g * g) / (4.0 * pi * bent * dr.sqrt(bent))


@dataclass
class Turn:
    """A drawn direction, the factor on the extinction by which the distance is drawn, and what the density needs.

    ``guided``: share of guided turns; ``ways``: for both sides the share among them, the density of the direction over
    that of the phase function, and the factor on the extinction.
    """

    dr: Any
    direction: Any
    stretch: Any
    guided: Any
    ways: tuple[tuple[Any, Any, Any], ...]

    def density(self, medium: tuple[Any, Any], length: Any, met: Any, straight: Any) -> Any:
        """Density of a distance for each channel over that of the phase function; ``met``: of passing it.

        ``medium``: extinction and transmittance over the distance; ``straight``: True where no turn was drawn.
        """
        dr, (thick, clear) = self.dr, medium
        plain = dr.select(met, 1.0, thick) * clear
        guided = 0.0
        for share, turned, stretch in self.ways:
            steep = thick * stretch
            guided += share * turned * dr.select(met, 1.0, steep) * dr.exp(-steep * length)
        return dr.select(straight, plain, dr.lerp(plain, guided, self.guided))


@dataclass
class Guide:
    """Of one walk: where it began, the way out there, and the diffusion ``length`` per channel (in mean free paths)."""

    mi: Any
    dr: Any
    start: Any
    out: Any
    length: Any
    spread: Any
    """Logarithm of (length + 1) / (length - 1)."""
    free_path: Any
    """The longest mean free path of the channels."""
    guided: Any
    followed: Any = None
    """Length and spread of the channel by which turns are drawn."""

    def follow(self, drawn: Any) -> None:
        """Draw turns by one channel, which ``drawn`` selects."""
        self.followed = drawn(self.length), drawn(self.spread)

    @classmethod
    def of(cls, mi: Any, dr: Any, at: tuple[Any, Any], medium: tuple[Any, Any], anisotropy: Any) -> Guide:
        """``at``: start and outward normal; ``medium``: extinction and albedo per channel."""
        length = diffusion_length(dr, medium[1])
        spread = dr.log((length + 1.0) / (length - 1.0))
        guided = dr.minimum(GUIDED, 1.0 - dr.abs(anisotropy) ** 0.125)
        return cls(mi, dr, *at, length, spread, dr.rcp(dr.min(medium[0])), guided)

    @property
    def reach(self) -> Any:
        """Distance within which an opposite side counts as near."""
        return REACH * self.free_path

    def depth(self, point: Any) -> Any:
        """Depth below the plane through the start; infinite above it."""
        depth = self.dr.dot(self.start - point, self.out)
        return self.dr.select(depth > 0.0, depth, self.dr.inf)

    def turned(self, at: tuple[Any, Any], g: Any, late: Any, samples: list[Any]) -> Turn:
        """A turn of a ray; ``at``: the ray, and the depth of the opposite side, infinite if there is none near."""
        mi, dr = self.mi, self.dr
        ray, behind = at
        pick, first, second = samples
        guided = dr.select(late, GUIDED, self.guided)
        # how far the walk is on its way to the opposite side (d'Eon and Křivánek 2020), the same for all channels
        depth = dr.clip(dr.dot(self.start - ray.o, self.out), 0.0, behind)
        ahead = (behind - 2.0 * depth) / (self.free_path * dr.max(self.length))
        through = dr.select(dr.isfinite(behind), dr.rcp(1.0 + dr.exp(dr.clip(ahead, -60.0, 60.0))), 0.0)
        own, spread = self.followed
        cosine = drawn_cosine(dr, own, spread, first)
        cosine = dr.select(pick < guided * through, -cosine, cosine)
        wanted = mi.Frame3f(self.out).to_world(around(mi, dr, cosine, second))
        plain = mi.Frame3f(ray.d).to_world(scattering(mi, dr, g, mi.Point2f(first, second)))
        direction = dr.select(pick < guided, wanted, plain)
        cosine = dr.dot(direction, self.out)
        likely = 2.0 * pi * phase(dr, g, dr.dot(direction, ray.d))
        ways = []
        for share, sign in ((1.0 - through, 1.0), (through, -1.0)):
            turned = cosine_density(self.length, self.spread, sign * cosine) / likely
            ways.append((share, turned, 1.0 - sign * cosine / self.length))
        stretch = 1.0 - dr.select(pick < guided * through, -cosine, cosine) / own
        return Turn(dr, direction, dr.select(pick < guided, stretch, 1.0), guided, tuple(ways))
