# SPDX-License-Identifier: GPL-3.0-or-later
"""Coefficients of volume shaders: scattering, absorption and emission per unit of length."""

from __future__ import annotations

from typing import Any

from spectral_core.scene.shading.registry import operation
from spectral_core.scene.shading.tuples import each, multiply

BLACKBODY_SCALE = 5.670373e-8 * 1e-6 / 3.141592653589793
"""Emission of Principled Volume's blackbody over the fourth power of its temperature, as in Cycles."""


@operation("1 3", 3)
def amount_of_color(xp: Any, amount: Any, color: Any) -> Any:
    """An amount times a color, none of it below 0: what a density scatters, or a strength emits."""
    return multiply(each(lambda c: xp.maximum(c, 0.0), color), xp.maximum(amount, 0.0))


@operation("1 3", 3)
def absorbed_by_color(xp: Any, density: Any, color: Any) -> Any:
    """Volume Absorption: density times 1 - color."""
    return multiply(each(lambda c: xp.maximum(1.0 - xp.maximum(c, 0.0), 0.0), color), xp.maximum(density, 0.0))


@operation("1 3 3", 3)
def absorbed_by_principled(xp: Any, density: Any, color: Any, absorption: Any) -> Any:
    """Principled Volume: density times 1 - color and 1 - the root of its absorption color."""
    kept = each(lambda c: xp.maximum(1.0 - xp.sqrt(xp.maximum(c, 0.0)), 0.0), absorption)
    return absorbed_by_color(xp, density, multiply_complement(xp, color, kept))


def multiply_complement(xp: Any, color: Any, kept: Any) -> Any:
    """The color whose complement is the product of the complement of ``color`` and ``kept``."""
    return each(lambda c, k: 1.0 - xp.maximum(1.0 - xp.maximum(c, 0.0), 0.0) * k, color, kept)


@operation("1 1 3 3", 3)
def blackbody_emission(xp: Any, temperature: Any, intensity: Any, tint: Any, planckian: Any) -> Any:
    """Principled Volume's blackbody: at the intensity 1 it has its physical brightness."""
    kelvin = xp.maximum(temperature, 0.0)
    amount = xp.maximum(intensity, 0.0)
    brightness = BLACKBODY_SCALE * ((kelvin * kelvin * kelvin * kelvin - 1.0) * amount + 1.0)
    brightness = xp.where((amount > 0.0) & (kelvin > 0.0), brightness, 0.0)
    return each(lambda t, p: brightness * xp.maximum(t, 0.0) * p, tint, planckian)
