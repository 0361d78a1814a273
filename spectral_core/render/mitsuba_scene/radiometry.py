# SPDX-License-Identifier: GPL-3.0-or-later
"""Conversion of watts to radiance: emission of lamps of a stated power, for every integrator.

Blender states a lamp's power as if it emitted in all directions, so neither a spot's cone nor a luminaire's profile
makes it brighter. Units: power in W, intensity in W/sr, irradiance in W/m², radiance in W/(m²·sr).
"""

from __future__ import annotations

import numpy as np

from spectral_core.spectra.spectrum import Spectrum

SHARPEST_SUN_RAD = 1e-5
"""Half angle of a sun's disk below which its light has one direction; 32-bit numbers hardly separate its directions."""
WIDEST_SUN_RAD = float(np.radians(89.0))
"""Largest half angle of a sun's disk: one at a finite distance never covers a hemisphere."""


def intensity_of_point(power_w: float) -> float:
    """Intensity of a point or spot light: its power over the 4π sr of all directions."""
    return power_w / (4 * np.pi)


def radiance_of_ball(power_w: float, radius: float) -> float:
    """Radiance of a ball with the intensity of a point of that power: it appears as a disk of area π·radius² in every
    direction.
    """
    return intensity_of_point(power_w) / (np.pi * radius**2)


def radiance_of_panel(power_w: float, area: float) -> float:
    """Radiance of one side of a panel that emits evenly: the integral of the cosine over the hemisphere is π."""
    return power_w / (np.pi * area)


def sun_half_angle(angle_rad: float) -> float:
    """Half angle (radian) of a sun's disk by its full angle; 0 for a sun whose light has one direction."""
    half = min(angle_rad / 2, WIDEST_SUN_RAD)
    return half if half >= SHARPEST_SUN_RAD else 0.0


def radiance_of_sun(irradiance: float, half_angle_rad: float) -> float:
    """Radiance of a sun's disk; a surface that faces it receives the irradiance radiance · π · sin²(half angle)."""
    return irradiance / (np.pi * float(np.sin(half_angle_rad)) ** 2)


def at_strength(light: Spectrum, strength: float) -> Spectrum:
    """A light times a strength, below 0 for a lamp that removes light, of which no Illuminant is."""
    return Spectrum(light.name, light.grid, light.values * strength, source=light.source)
