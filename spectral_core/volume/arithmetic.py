# SPDX-License-Identifier: GPL-3.0-or-later
"""What the march does many times per turn, as cheaply as it may be done.

Dr.Jit's own minimum and maximum hold to IEEE's rules for NaN, for which x86 has no instruction: there each takes the
time of nine of these, and a turn of the march has thirty. Where either argument is NaN the second is returned.
"""

from __future__ import annotations

from typing import Any

_FOURTH_ROOT = int(1.25 * (127.0 - 0.045) * 2**23)  # the mean error of the logarithm that a float's bits are is 0.045


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


def inverse_fourth_root(types: Any, value: Any) -> Any:
    """value^(-1/4) of positive numbers to 4 %, as a step needs it: a float32's bits are nearly its logarithm."""
    import drjit as dr

    if not dr.is_jit_v(value):
        return float(value) ** -0.25
    bits = _FOURTH_ROOT - (dr.reinterpret_array(types.UInt32, value) >> 2)
    return dr.reinterpret_array(types.Float, bits)
