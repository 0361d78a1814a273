# SPDX-License-Identifier: GPL-3.0-or-later
"""Remainders of Dr.Jit numbers without rounding."""

from __future__ import annotations

from typing import Any

WHOLE = 2.0**24
"""Quotients from here on are integers in single precision."""
MOST = 2.0**120
"""Quotients beyond it might overflow: the divisor is enlarged first."""


def exact_remainder(mi: Any, dr: Any, a: Any, b: Any) -> Any:
    """Remainder of a / b with the sign of ``a``; ``b`` is not 0.

    The difference of ``a`` and a rounded quotient times ``b`` is a number of single precision, so that a fused
    multiplication gives it without an error. One such step leaves less than ``b`` unless the quotient exceeds 2^24.
    """
    size, divisor = mi.Float(dr.abs(a)), mi.Float(dr.abs(b))

    def step(rest: Any) -> tuple[Any]:
        by = dr.select(dr.abs(rest) > divisor * MOST, divisor * 2.0**100, divisor)
        quotient = rest / by
        return (dr.fma(-dr.select(dr.abs(quotient) < WHOLE, dr.trunc(quotient), quotient), by, rest),)

    (rest,) = dr.while_loop((size,), lambda rest: dr.abs(rest) >= divisor, step, label="remainder")
    rest = dr.select(rest < 0.0, rest + divisor, rest)
    return dr.mulsign(rest, mi.Float(a))
