# SPDX-License-Identifier: GPL-3.0-or-later
"""What the march does many times per turn, as cheaply as it may be done.

Dr.Jit's own minimum and maximum hold to IEEE's rules for NaN, for which x86 has no instruction: there each takes the
time of nine of these, and a turn of the march has thirty. Where either argument is NaN the second is returned.
"""

from __future__ import annotations

from typing import Any

_POWER = 5 / 16
_BITS_OF_ONE = int(
    (1.0 + _POWER) * (127.0 - 0.045) * 2**23
)  # 0.045: how far the bits are from the logarithm, on average


def larger(a: Any, b: Any) -> Any:
    """The larger of two numbers, lane by lane."""
    import drjit as dr

    return dr.select(a > b, a, b)


def smaller(a: Any, b: Any) -> Any:
    """The smaller of two numbers, lane by lane."""
    import drjit as dr

    return dr.select(a < b, a, b)


def bounded(value: Any, low: Any, high: Any) -> Any:
    """``value`` taken into [low, high]."""
    return smaller(larger(value, low), high)


def inverse_third_root(types: Any, value: Any) -> Any:
    """About value^(-1/3) of positive numbers (the power is -5/16), to 5 %, as choosing a step wants it.

    A float32's bits are nearly its logarithm, so the power is two shifts of them.
    """
    import drjit as dr

    if not dr.is_jit_v(value):
        return float(value) ** -_POWER
    bits = dr.reinterpret_array(types.UInt32, value)
    return dr.reinterpret_array(types.Float, _BITS_OF_ONE - ((bits >> 2) + (bits >> 4)))
