# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers: Math, Map Range, Clamp, Mix, conversions. Formulas and edge cases are those of Blender's shader sources."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from spectral_core.scene.shading.registry import operation
from spectral_core.scene.shading.tuples import clip, each, mix, safe_divide

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Luminance of linear sRGB (IEC 61966-2-1), which Blender computes when a color is linked to a number socket."""


@operation("3", 1)
def luminance(xp: Any, color: Any) -> Any:
    """A color as a number."""
    return LUMINANCE[0] * color[0] + LUMINANCE[1] * color[1] + LUMINANCE[2] * color[2]


@operation("3", 1)
def mean(xp: Any, vector: Any) -> Any:
    """A vector as a number."""
    return (vector[0] + vector[1] + vector[2]) / 3.0


@operation("1", 3)
def spread(xp: Any, value: Any) -> Any:
    """A number as a color or vector."""
    return value, value, value


@operation("3", 1)
def component(xp: Any, vector: Any, index: int) -> Any:
    """One component."""
    return vector[index]


@operation("1 1 1", 3)
def joined(xp: Any, x: Any, y: Any, z: Any) -> Any:
    """Three numbers as a vector."""
    return x, y, z


LEAST_PAST_INTEGERS = 2.0**31
"""Exponents of at least this size are no integers to Cycles."""


def _power(xp: Any, a: Any, b: Any) -> Any:
    """Blender's power: negative bases have only integer exponents; else 0."""
    size = xp.maximum(xp.absolute(a), 1e-38)
    whole = (xp.floor(b) == b) & (b >= -LEAST_PAST_INTEGERS) & (b < LEAST_PAST_INTEGERS)
    odd = xp.absolute(b - 2.0 * xp.floor(b * 0.5)) > 0.5
    sign = xp.where((a < 0.0) & odd, -1.0, 1.0)
    value = xp.where((a < 0.0) & ~whole, 0.0, sign * xp.power(size, b))
    at_zero = xp.where(b == 0.0, 1.0, 0.0)
    result = xp.where(a == 0.0, at_zero, value)
    return xp.where(xp.isfinite(result), result, 0.0)


def _logarithm(xp: Any, a: Any, base: Any) -> Any:
    good = (a > 0.0) & (base > 0.0)
    top, bottom = xp.log(xp.where(good, a, 1.0)), xp.log(xp.where(good, base, 2.0))
    return xp.where(good, safe_divide(xp, top, bottom), 0.0)


def _wrap(xp: Any, value: Any, high: Any, low: Any) -> Any:
    span = high - low
    return xp.where(span != 0.0, value - span * xp.floor(safe_divide(xp, value - low, span)), low)


def _ping_pong(xp: Any, value: Any, scale: Any) -> Any:
    fraction = safe_divide(xp, value - scale, scale * 2.0)
    return xp.where(scale != 0.0, xp.absolute((fraction - xp.floor(fraction)) * scale * 2.0 - scale), 0.0)


def _smooth_minimum(xp: Any, a: Any, b: Any, distance: Any) -> Any:
    size = xp.where(distance != 0.0, distance, 1.0)
    h = xp.maximum(size - xp.absolute(a - b), 0.0) / size
    return xp.minimum(a, b) - xp.where(distance != 0.0, h * h * h * size * (1.0 / 6.0), 0.0)


def _fmod(xp: Any, a: Any, b: Any) -> Any:
    """Remainder with the sign of ``a``, without rounding; 0 where ``b`` is 0."""
    return xp.where(b != 0.0, xp.fmod(a, xp.where(b != 0.0, b, 1.0)), 0.0)


def remainder(xp: Any, a: Any, b: Any, whole: Callable[[Any], Any]) -> Any:
    """a - ``whole``(a / b) · b with one rounding of the difference, as Cycles compiles it; 0 where ``b`` is 0."""
    return xp.where(b != 0.0, xp.fused(-whole(safe_divide(xp, a, b)), b, a), 0.0)


def _arctan2(xp: Any, a: Any, b: Any) -> Any:
    return xp.where((a == 0.0) & (b == 0.0), 0.0, xp.atan2(a, b))


def _flag(xp: Any, condition: Any) -> Any:
    return xp.where(condition, 1.0, 0.0)


MATH: dict[str, Callable[..., Any]] = {
    "ADD": lambda xp, a, b, c: a + b,
    "SUBTRACT": lambda xp, a, b, c: a - b,
    "MULTIPLY": lambda xp, a, b, c: a * b,
    "DIVIDE": lambda xp, a, b, c: safe_divide(xp, a, b),
    "MULTIPLY_ADD": lambda xp, a, b, c: a * b + c,
    "POWER": lambda xp, a, b, c: _power(xp, a, b),
    "LOGARITHM": lambda xp, a, b, c: _logarithm(xp, a, b),
    "SQRT": lambda xp, a, b, c: xp.sqrt(xp.maximum(a, 0.0)),
    "INVERSE_SQRT": lambda xp, a, b, c: xp.where(a > 0.0, 1.0 / xp.sqrt(xp.maximum(a, 1e-38)), 0.0),
    "ABSOLUTE": lambda xp, a, b, c: xp.absolute(a),
    "EXPONENT": lambda xp, a, b, c: xp.exp(a),
    "MINIMUM": lambda xp, a, b, c: xp.minimum(a, b),
    "MAXIMUM": lambda xp, a, b, c: xp.maximum(a, b),
    "LESS_THAN": lambda xp, a, b, c: _flag(xp, a < b),
    "GREATER_THAN": lambda xp, a, b, c: _flag(xp, a > b),
    "SIGN": lambda xp, a, b, c: _flag(xp, a > 0.0) - _flag(xp, a < 0.0),
    "COMPARE": lambda xp, a, b, c: _flag(xp, (a == b) | (xp.absolute(a - b) <= xp.maximum(c, 1.1920929e-7))),
    "SMOOTH_MIN": lambda xp, a, b, c: _smooth_minimum(xp, a, b, c),
    "SMOOTH_MAX": lambda xp, a, b, c: -_smooth_minimum(xp, -a, -b, c),
    "ROUND": lambda xp, a, b, c: xp.floor(a + 0.5),
    "FLOOR": lambda xp, a, b, c: xp.floor(a),
    "CEIL": lambda xp, a, b, c: xp.ceil(a),
    "TRUNC": lambda xp, a, b, c: xp.trunc(a),
    "FRACT": lambda xp, a, b, c: a - xp.floor(a),
    "MODULO": lambda xp, a, b, c: _fmod(xp, a, b),
    "FLOORED_MODULO": lambda xp, a, b, c: remainder(xp, a, b, xp.floor),
    "WRAP": _wrap,
    "SNAP": lambda xp, a, b, c: xp.floor(safe_divide(xp, a, b)) * b,
    "PINGPONG": lambda xp, a, b, c: _ping_pong(xp, a, b),
    "SINE": lambda xp, a, b, c: xp.sin(a),
    "COSINE": lambda xp, a, b, c: xp.cos(a),
    "TANGENT": lambda xp, a, b, c: xp.tan(a),
    "ARCSINE": lambda xp, a, b, c: xp.asin(a),
    "ARCCOSINE": lambda xp, a, b, c: xp.acos(a),
    "ARCTANGENT": lambda xp, a, b, c: xp.atan(a),
    "ARCTAN2": lambda xp, a, b, c: _arctan2(xp, a, b),
    "SINH": lambda xp, a, b, c: xp.sinh(a),
    "COSH": lambda xp, a, b, c: xp.cosh(a),
    "TANH": lambda xp, a, b, c: xp.tanh(a),
    "RADIANS": lambda xp, a, b, c: a * 0.017453292519943295,
    "DEGREES": lambda xp, a, b, c: a * 57.29577951308232,
}


@operation("1 1 1", 1)
def math(xp: Any, a: Any, b: Any, c: Any, mode: str) -> Any:
    """Math node."""
    return MATH[mode](xp, a, b, c)


@operation("1 1 1", 1)
def clamp(xp: Any, value: Any, low: Any, high: Any, kind: str) -> Any:
    """Clamp node; ``RANGE`` orders the bounds first."""
    if kind == "RANGE":
        low, high = xp.minimum(low, high), xp.maximum(low, high)
    return clip(xp, value, low, high)


@operation("3", 3)
def clamped_color(xp: Any, color: Any) -> Any:
    """Components clipped to [0, 1]."""
    return each(lambda c: clip(xp, c), color)


@operation("1 1 1", 1)
def mix_number(xp: Any, factor: Any, a: Any, b: Any) -> Any:
    """Linear interpolation."""
    return mix(a, b, factor)


@operation("3 3 3", 3)
def mix_vector(xp: Any, factor: Any, a: Any, b: Any) -> Any:
    """Linear interpolation with a factor per component."""
    return mix(a, b, factor)


@operation("1 1 1 1 1 1", 1)
def map_range(
    xp: Any, value: Any, low: Any, high: Any, to_low: Any, to_high: Any, steps: Any, kind: str, clamps: bool
) -> Any:
    """Map Range node of numbers: 0 where the range is empty, before it is clamped."""
    result = xp.where(high != low, _mapped(xp, value, low, high, to_low, to_high, steps, kind), 0.0)
    return clip(xp, result, xp.minimum(to_low, to_high), xp.maximum(to_low, to_high)) if clamps else result


def _mapped(xp: Any, value: Any, low: Any, high: Any, to_low: Any, to_high: Any, steps: Any, kind: str) -> Any:
    """Map of a range; of an empty one the start of the other."""
    factor = safe_divide(xp, value - low, high - low)
    if kind == "STEPPED":
        factor = xp.where(steps > 0.0, xp.floor(factor * (steps + 1.0)) / xp.where(steps > 0.0, steps, 1.0), 0.0)
    elif kind in ("SMOOTHSTEP", "SMOOTHERSTEP"):
        t = clip(xp, factor)
        factor = t * t * (3.0 - 2.0 * t) if kind == "SMOOTHSTEP" else t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
    return to_low + factor * (to_high - to_low)


@operation("3 3 3 3 3 3", 3)
def map_range_vector(
    xp: Any, value: Any, low: Any, high: Any, to_low: Any, to_high: Any, steps: Any, kind: str, clamps: bool
) -> Any:
    """Map Range node of vectors: where a range is empty, unlike that of numbers, the start of the other."""

    def mapped(value: Any, low: Any, high: Any, to_low: Any, to_high: Any, steps: Any) -> Any:
        result = _mapped(xp, value, low, high, to_low, to_high, steps, kind)
        return clip(xp, result, xp.minimum(to_low, to_high), xp.maximum(to_low, to_high)) if clamps else result

    return each(mapped, value, low, high, to_low, to_high, steps)
