# SPDX-License-Identifier: GPL-3.0-or-later
"""Fast arithmetic for the inner loop of the march.

Dr.Jit's minimum and maximum follow the IEEE rules for NaN, for which x86 has no instruction. Each takes several times
as long as these, and an iteration has thirty. If either argument is NaN, the second is returned.
"""

from __future__ import annotations

from typing import Any

_OFFSET = int((1.0 + 5 / 16) * (127.0 - 0.045) * 2**23)  # 0.045: mean difference of the bits from the logarithm


def larger(a: Any, b: Any) -> Any:
    """The larger of two numbers, lane by lane."""
    import drjit as dr

    return dr.select(a > b, a, b)


def smaller(a: Any, b: Any) -> Any:
    """The smaller of two numbers, lane by lane."""
    import drjit as dr

    return dr.select(a < b, a, b)


def bounded(value: Any, low: Any, high: Any) -> Any:
    """``value`` clamped to [low, high]."""
    return smaller(larger(value, low), high)


def step_growth(types: Any, transmittance: Any) -> Any:
    """Factor by which steps may grow at a positive transmittance T: T^(-5/16), with an error of up to 5 %.

    A float32's bits are nearly its logarithm, so the power is two shifts of them.
    """
    import drjit as dr

    bits = dr.reinterpret_array(types.UInt32, transmittance)
    return dr.reinterpret_array(types.Float, _OFFSET - ((bits >> 2) + (bits >> 4)))


def mean_attenuation(depth: Any, transmittance: Any) -> Any:
    """(1 - e^-τ)/τ of an optical depth τ and its transmittance e^-τ; by a series if τ is small or zero."""
    import drjit as dr

    series = 1.0 - depth * (0.5 - depth / 6.0)
    return dr.select(depth > 1e-2, (1.0 - transmittance) / larger(depth, 1e-2), series)


def mean_place(depth: Any, transmittance: Any) -> Any:
    """∫s·e^(-τs) ds / ∫e^(-τs) ds over [0, 1]: the mean place of the light that leaves an even step of optical depth τ,
    with its transmittance e^-τ; 1/2 if it is thin, 0 if it is opaque.
    """
    import drjit as dr

    thick = dr.rcp(larger(depth, 0.1)) - transmittance / larger(1.0 - transmittance, 1e-2)
    return dr.select(depth > 0.1, thick, 0.5 - depth / 12.0)
