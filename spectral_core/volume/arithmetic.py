# SPDX-License-Identifier: GPL-3.0-or-later
"""Minimum, maximum and bounds as the march wants them: one comparison each.

Dr.Jit's own hold to IEEE's rules for NaN, for which x86 has no instruction: there each takes the time of nine of
these, and a turn of the march has thirty. Where either argument is NaN the second is returned.
"""

from __future__ import annotations

from typing import Any


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
