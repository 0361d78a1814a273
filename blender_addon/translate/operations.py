# SPDX-License-Identifier: GPL-3.0-or-later
"""Arithmetic of Blender's color and math nodes, on arrays: formulas as in its shader sources, names as in its menus."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


def _divide(a: Array, b: Array) -> Array:
    """Division that is 0 where Blender's is: at a divisor of 0."""
    shape = np.broadcast_shapes(np.shape(a), np.shape(b))
    return np.divide(a, b, out=np.zeros(shape), where=np.broadcast_to(b, shape) != 0)


def _power(a: Array, b: Array) -> Array:
    """Blender's power: 0 where the real power does not exist."""
    with np.errstate(all="ignore"):
        result = np.power(np.asarray(a, dtype=np.float64), b)
    return np.where(np.isfinite(result), result, 0.0)


def _logarithm(a: Array, base: Array) -> Array:
    good = (a > 0) & (base > 0)
    return np.where(good, _divide(np.log(np.where(good, a, 1)), np.log(np.where(good, base, 2))), 0.0)


def _wrap(value: Array, high: Array, low: Array) -> Array:
    span = high - low
    return np.where(span != 0, value - span * np.floor(_divide(value - low, span)), low)


def _ping_pong(value: Array, scale: Array) -> Array:
    fraction = _divide(value - scale, scale * 2)
    return np.where(scale != 0, np.abs((fraction - np.floor(fraction)) * scale * 2 - scale), 0.0)


MATH: dict[str, Callable[[Array, Array, Array], Array]] = {
    "ADD": lambda a, b, c: a + b,
    "SUBTRACT": lambda a, b, c: a - b,
    "MULTIPLY": lambda a, b, c: a * b,
    "DIVIDE": lambda a, b, c: _divide(a, b),
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b, c: _power(a, b),
    "LOGARITHM": lambda a, b, c: _logarithm(a, b),
    "SQRT": lambda a, b, c: np.sqrt(np.maximum(a, 0)),
    "INVERSE_SQRT": lambda a, b, c: _power(np.maximum(a, 0), np.array(-0.5)),
    "ABSOLUTE": lambda a, b, c: np.abs(a),
    "EXPONENT": lambda a, b, c: np.exp(np.minimum(a, 80)),
    "MINIMUM": lambda a, b, c: np.minimum(a, b),
    "MAXIMUM": lambda a, b, c: np.maximum(a, b),
    "LESS_THAN": lambda a, b, c: (a < b).astype(float),
    "GREATER_THAN": lambda a, b, c: (a > b).astype(float),
    "SIGN": lambda a, b, c: np.sign(a),
    "COMPARE": lambda a, b, c: (np.abs(a - b) <= np.maximum(c, 1e-5)).astype(float),
    "ROUND": lambda a, b, c: np.floor(a + 0.5),
    "FLOOR": lambda a, b, c: np.floor(a),
    "CEIL": lambda a, b, c: np.ceil(a),
    "TRUNC": lambda a, b, c: np.trunc(a),
    "FRACT": lambda a, b, c: a - np.floor(a),
    "MODULO": lambda a, b, c: np.where(b != 0, np.fmod(a, np.where(b != 0, b, 1)), 0.0),
    "FLOORED_MODULO": lambda a, b, c: np.where(b != 0, a - b * np.floor(_divide(a, b)), 0.0),
    "WRAP": _wrap,
    "SNAP": lambda a, b, c: np.floor(_divide(a, b)) * b,
    "PINGPONG": lambda a, b, c: _ping_pong(a, b),
    "SINE": lambda a, b, c: np.sin(a),
    "COSINE": lambda a, b, c: np.cos(a),
    "TANGENT": lambda a, b, c: np.tan(a),
    "ARCSINE": lambda a, b, c: np.where(np.abs(a) <= 1, np.arcsin(np.clip(a, -1, 1)), 0.0),
    "ARCCOSINE": lambda a, b, c: np.where(np.abs(a) <= 1, np.arccos(np.clip(a, -1, 1)), 0.0),
    "ARCTANGENT": lambda a, b, c: np.arctan(a),
    "ARCTAN2": lambda a, b, c: np.arctan2(a, b),
    "SINH": lambda a, b, c: np.sinh(np.clip(a, -80, 80)),
    "COSH": lambda a, b, c: np.cosh(np.clip(a, -80, 80)),
    "TANH": lambda a, b, c: np.tanh(a),
    "RADIANS": lambda a, b, c: np.radians(a),
    "DEGREES": lambda a, b, c: np.degrees(a),
}


def _overlay(a: Array, b: Array) -> Array:
    return np.where(a < 0.5, 2 * a * b, 1 - 2 * (1 - a) * (1 - b))


BLEND: dict[str, Callable[[Array, Array], Array]] = {
    "MIX": lambda a, b: b,
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "SCREEN": lambda a, b: 1 - (1 - a) * (1 - b),
    "DIFFERENCE": lambda a, b: np.abs(a - b),
    "EXCLUSION": lambda a, b: np.maximum(a + b - 2 * a * b, 0),
    "DARKEN": np.minimum,
    "LIGHTEN": np.maximum,
    "OVERLAY": _overlay,
    "DIVIDE": lambda a, b: np.where(b != 0, _divide(a, b), a),
    "DODGE": lambda a, b: np.where(a == 0, 0.0, np.where(b < 1, np.minimum(_divide(a, 1 - b), 1), 1.0)),
    "BURN": lambda a, b: np.where(b > 0, np.clip(1 - _divide(1 - a, b), 0, 1), 0.0),
    "SOFT_LIGHT": lambda a, b: (1 - a) * b * a + a * (1 - (1 - a) * (1 - b)),
    "LINEAR_LIGHT": lambda a, b: a + 2 * (b - 0.5),
}
"""Result at factor 1 of each blend mode; between, Blender goes there in a straight line."""


def blend(mode: str, factor: Array, a: Array, b: Array) -> Array:
    """Blender's Mix node of colors or numbers."""
    return (1 - factor) * a + factor * BLEND[mode](a, b)


def bright_contrast(color: Array, bright: Array, contrast: Array) -> Array:
    """Brightness/Contrast node."""
    return np.maximum((1 + contrast) * color + (bright - contrast * 0.5), 0)


def hue_saturation(color: Array, hue: Array, saturation: Array, value: Array, factor: Array) -> Array:
    """Hue/Saturation/Value node."""
    hsv = hsv_from_rgb(np.broadcast_to(color, (*color.shape[:-1], 3)))
    parts = (hsv[..., :1] + hue + 0.5) % 1.0, np.clip(hsv[..., 1:2] * saturation, 0, 1), hsv[..., 2:] * value
    turned = np.concatenate(np.broadcast_arrays(*parts), axis=-1)
    return np.maximum((1 - factor) * color + factor * rgb_from_hsv(turned), 0)


def hsv_from_rgb(rgb: Array) -> Array:
    """Hue, saturation and value, each (..., 3), hue in turns."""
    high, low = rgb.max(axis=-1), rgb.min(axis=-1)
    span = high - low
    red, green, blue = np.moveaxis(rgb, -1, 0)
    sector = np.where(
        high == red,
        _divide(green - blue, span),
        np.where(high == green, 2 + _divide(blue - red, span), 4 + _divide(red - green, span)),
    )
    return np.stack([(sector / 6) % 1.0, _divide(span, high), high], axis=-1)


def rgb_from_hsv(hsv: Array) -> Array:
    """Inverse of hsv_from_rgb."""
    hue, saturation, value = (hsv[..., i : i + 1] for i in range(3))
    wheel = np.clip(np.abs((hue * 6 + np.array([0, 4, 2])) % 6 - 3) - 1, 0, 1)
    return value * (1 - saturation * (1 - wheel))


def map_range(value: Array, limits: tuple[Array, Array, Array, Array], *, clamp: bool, steps: str) -> Array:
    """Map Range node, linear or smooth; ``limits``: from low, from high, to low, to high."""
    low, high, to_low, to_high = limits
    factor = _divide(value - low, high - low)
    if steps == "SMOOTHSTEP":
        factor = np.clip(factor, 0, 1)
        factor = factor * factor * (3 - 2 * factor)
    elif steps == "SMOOTHERSTEP":
        factor = np.clip(factor, 0, 1)
        factor = factor**3 * (factor * (factor * 6 - 15) + 10)
    elif clamp:
        factor = np.clip(factor, 0, 1)
    return to_low + factor * (to_high - to_low)


def fresnel_mean(ior: float) -> float:
    """Hemispherical (cosine-weighted) mean of the unpolarized Fresnel reflectance of a dielectric."""
    cosines = (np.arange(256) + 0.5) / 256
    eta = max(ior, 1e-3)
    inside = 1 - (1 - cosines**2) / eta**2
    refracted = np.sqrt(np.maximum(inside, 0))
    across = (cosines - eta * refracted) / (cosines + eta * refracted)
    along = (refracted - eta * cosines) / (refracted + eta * cosines)
    reflectance = np.where(inside <= 0, 1.0, (across**2 + along**2) / 2)
    return float((reflectance * 2 * cosines).mean())
