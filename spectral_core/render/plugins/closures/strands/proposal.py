# SPDX-License-Identifier: GPL-3.0-or-later
"""Directions drawn for a strand of Huang's model: Chiang's lobes at a few places across it, and a share of any."""

from __future__ import annotations

from math import pi
from typing import Any

from spectral_core.render.plugins.closures.strands.chiang import turned, variance
from spectral_core.render.plugins.closures.strands.fiber import (
    Fiber,
    cumulative,
    logistic_scale,
    longitudinal,
    shares_of_lobes,
    trimmed_logistic,
    wrapped,
)
from spectral_core.render.plugins.numbers import channel_mean

HEIGHTS = (-0.85, -0.5, -0.17, 0.17, 0.5, 0.85)
"""Places across the strand."""
EVEN = 0.1
"""Share of directions that are drawn evenly."""


class Proposal:
    """``numbers``: roughness, index of refraction, absorption coefficient, tilt of the scales."""

    def __init__(self, mi: Any, dr: Any, fiber: Fiber, numbers: tuple[Any, Any, Any, Any]) -> None:
        self.mi, self.dr, self.fiber = mi, dr, fiber
        rough, ior, absorption, tilt = numbers
        spread = variance(dr, rough)
        self.variances = [spread, 0.25 * spread, 4.0 * spread, 4.0 * spread]
        self.scale = dr.maximum(logistic_scale(dr, rough), 0.02)
        sine = dr.clip(dr.dot(fiber.toward, fiber.along), -1.0, 1.0)
        self.view = sine, dr.safe_sqrt(1.0 - sine * sine)
        self.tilted = [turned(dr, self.view, angle) for angle in (2.0 * tilt, -tilt, -4.0 * tilt)] + [self.view]
        self.azimuths, self.chances = [], []
        inner_cosine = dr.maximum(dr.safe_sqrt(1.0 - dr.square(sine / ior)), 1e-6)
        for h in HEIGHTS:
            h_inside = dr.clip(h * self.view[1] / dr.safe_sqrt(dr.square(ior) - sine * sine), -1.0, 1.0)
            depth = 2.0 * dr.safe_sqrt(1.0 - h_inside * h_inside) / inner_cosine
            passed = channel_mean(dr, dr.exp(-absorption * depth))
            reflected = mi.fresnel(self.view[1] * (1.0 - h * h) ** 0.5, ior)[0]
            shares = (reflected, *shares_of_lobes(dr, reflected, passed))
            total = sum(shares)
            self.chances.append([share / total for share in shares])
            bend, met = 2.0 * dr.asin(h_inside), 2.0 * dr.asin(self.mi.Float(h))
            self.azimuths.append([p * bend - met + p * pi for p in range(3)])

    def inclined(self, sine: Any, spread: Any) -> Any:
        """Density over inclinations of one variance about the viewer's mirror image."""
        return longitudinal(self.dr, (sine, self.dr.safe_sqrt(1.0 - sine * sine)), self.view, spread)

    def density(self, outward: Any) -> Any:
        """Density of a world direction."""
        dr, fiber = self.dr, self.fiber
        sine = dr.clip(dr.dot(outward, fiber.along), -1.0, 1.0)
        light = sine, dr.safe_sqrt(1.0 - sine * sine)
        phi = dr.atan2(dr.dot(outward, fiber.away), dr.dot(outward, fiber.across)) + 0.5 * pi
        along = [longitudinal(dr, light, self.tilted[p], self.variances[p]) for p in range(4)]
        total = self.mi.Float(0.0)
        for chances, azimuths in zip(self.chances, self.azimuths, strict=True):
            for p in range(3):
                total += chances[p] * along[p] * trimmed_logistic(dr, wrapped(dr, phi - azimuths[p]), self.scale)
            total += chances[3] * along[3] * (0.5 / pi)
        return total * ((1.0 - EVEN) / len(HEIGHTS)) + EVEN / (4.0 * pi)

    def drawn(self, sample1: Any, sample2: Any) -> Any:
        """A world direction."""
        mi, dr, fiber = self.mi, self.dr, self.fiber
        u = mi.Float(sample1)
        is_even = u < EVEN
        u = dr.clip((u - EVEN) / (1.0 - EVEN), 0.0, 1.0 - 1e-6) * len(HEIGHTS)
        place = dr.minimum(mi.UInt32(u), len(HEIGHTS) - 1)
        u = u - mi.Float(place)
        chances, azimuths = self.chances[0], self.azimuths[0]
        for number in range(1, len(HEIGHTS)):
            here = place == number
            chances = [dr.select(here, new, old) for new, old in zip(self.chances[number], chances, strict=True)]
            azimuths = [dr.select(here, new, old) for new, old in zip(self.azimuths[number], azimuths, strict=True)]
        below, chosen = mi.Float(0.0), mi.UInt32(3)
        (sine, cosine), spread, azimuth = self.tilted[3], self.variances[3], mi.Float(0.0)
        start, width = chances[0] + chances[1] + chances[2], mi.Float(chances[3])
        for p in range(3):
            mine = (chosen == 3) & (u < below + chances[p])
            chosen = dr.select(mine, p, chosen)
            start, width = dr.select(mine, below, start), dr.select(mine, chances[p], width)
            sine, cosine = (dr.select(mine, self.tilted[p][k], old) for k, old in enumerate((sine, cosine)))
            spread, azimuth = dr.select(mine, self.variances[p], spread), dr.select(mine, azimuths[p], azimuth)
            below = below + chances[p]
        u = dr.clip((u - start) / dr.maximum(width, 1e-12), 1e-5, 1.0 - 1e-6)
        away = dr.clip(1.0 + spread * dr.log(u + (1.0 - u) * dr.exp(-2.0 / spread)), -1.0, 1.0)
        sine = -away * sine + dr.safe_sqrt(1.0 - away * away) * dr.cos(2 * pi * sample2.y) * cosine
        sine = dr.clip(sine, -1.0, 1.0)
        cosine = dr.safe_sqrt(1.0 - sine * sine)
        low = cumulative(dr, -pi, self.scale)
        turn = -self.scale * dr.log(dr.maximum(dr.rcp(sample2.x * (1.0 - 2.0 * low) + low) - 1.0, 1e-30))
        phi = dr.select(chosen < 3, azimuth + dr.clip(turn, -pi, pi), 2 * pi * sample2.x)
        outward = fiber.along * sine + cosine * (fiber.across * dr.sin(phi) - fiber.away * dr.cos(phi))
        return dr.select(is_even, mi.warp.square_to_uniform_sphere(sample2), outward)
