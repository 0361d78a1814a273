# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors: the blend modes, hue and saturation, curves and ramps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from spectral_core.scene.shading.registry import operation
from spectral_core.scene.shading.tuples import clip, each, mix, safe_divide


def _overlay(xp: Any, f: Any, a: Any, b: Any) -> Any:
    low = a * (1.0 - f + 2.0 * f * b)
    return xp.where(a < 0.5, low, 1.0 - (1.0 - f + 2.0 * f * (1.0 - b)) * (1.0 - a))


def _dodge(xp: Any, f: Any, a: Any, b: Any) -> Any:
    rest = 1.0 - f * b
    bright = xp.where(rest <= 0.0, 1.0, xp.minimum(safe_divide(xp, a, rest), 1.0))
    return xp.where(a != 0.0, bright, 0.0)


def _burn(xp: Any, f: Any, a: Any, b: Any) -> Any:
    rest = 1.0 - f + f * b
    return xp.where(rest <= 0.0, 0.0, clip(xp, 1.0 - safe_divide(xp, 1.0 - a, rest)))


def _soft_light(xp: Any, f: Any, a: Any, b: Any) -> Any:
    screen = 1.0 - (1.0 - b) * (1.0 - a)
    return (1.0 - f) * a + f * ((1.0 - a) * b * a + a * screen)


CHANNELS: dict[str, Callable[..., Any]] = {
    "MIX": lambda xp, f, a, b: mix(a, b, f),
    "DARKEN": lambda xp, f, a, b: mix(a, xp.minimum(a, b), f),
    "MULTIPLY": lambda xp, f, a, b: a * (1.0 - f + f * b),
    "BURN": _burn,
    "LIGHTEN": lambda xp, f, a, b: mix(a, xp.maximum(a, b), f),
    "SCREEN": lambda xp, f, a, b: 1.0 - (1.0 - f + f * (1.0 - b)) * (1.0 - a),
    "DODGE": _dodge,
    "ADD": lambda xp, f, a, b: a + f * b,
    "OVERLAY": _overlay,
    "SOFT_LIGHT": _soft_light,
    "LINEAR_LIGHT": lambda xp, f, a, b: a + f * 2.0 * (b - 0.5),
    "DIFFERENCE": lambda xp, f, a, b: mix(a, xp.absolute(a - b), f),
    "EXCLUSION": lambda xp, f, a, b: xp.maximum(mix(a, a + b - 2.0 * a * b, f), 0.0),
    "SUBTRACT": lambda xp, f, a, b: a - f * b,
    "DIVIDE": lambda xp, f, a, b: xp.where(b != 0.0, (1.0 - f) * a + f * safe_divide(xp, a, b), a),
}
"""Blend modes that work channel by channel (Blender's ``svm_mix_*``)."""


def _hue(xp: Any, f: Any, a: Any, b: Any) -> Any:
    hsv, other = to_hsv(xp, a), to_hsv(xp, b)
    mixed = mix(a, to_rgb(xp, (other[0], hsv[1], hsv[2])), f)
    return each(lambda m, c: xp.where(other[1] != 0.0, m, c), mixed, a)


def _saturation(xp: Any, f: Any, a: Any, b: Any) -> Any:
    hsv, other = to_hsv(xp, a), to_hsv(xp, b)
    turned = to_rgb(xp, (hsv[0], mix(hsv[1], other[1], f), hsv[2]))
    return each(lambda t, c: xp.where(hsv[1] != 0.0, t, c), turned, a)


def _value(xp: Any, f: Any, a: Any, b: Any) -> Any:
    hsv, other = to_hsv(xp, a), to_hsv(xp, b)
    return to_rgb(xp, (hsv[0], hsv[1], mix(hsv[2], other[2], f)))


def _color(xp: Any, f: Any, a: Any, b: Any) -> Any:
    hsv, other = to_hsv(xp, a), to_hsv(xp, b)
    mixed = mix(a, to_rgb(xp, (other[0], other[1], hsv[2])), f)
    return each(lambda m, c: xp.where(other[1] != 0.0, m, c), mixed, a)


WHOLE: dict[str, Callable[..., Any]] = {"HUE": _hue, "SATURATION": _saturation, "VALUE": _value, "COLOR": _color}
"""Blend modes that need hue, saturation and value."""


@operation("1 3 3", 3)
def blend(xp: Any, factor: Any, a: Any, b: Any, mode: str) -> Any:
    """Mix node of colors."""
    if mode in WHOLE:
        return WHOLE[mode](xp, factor, a, b)
    return each(lambda x, y: CHANNELS[mode](xp, factor, x, y), a, b)


@operation("3", 3)
def to_hsv(xp: Any, color: Any) -> Any:
    """Hue (in turns), saturation and value."""
    red, green, blue = color
    high, low = xp.maximum(red, xp.maximum(green, blue)), xp.minimum(red, xp.minimum(green, blue))
    span = high - low
    hue = xp.where(
        high == red,
        safe_divide(xp, green - blue, span),
        xp.where(high == green, 2.0 + safe_divide(xp, blue - red, span), 4.0 + safe_divide(xp, red - green, span)),
    )
    hue = xp.where(span == 0.0, 0.0, hue / 6.0)
    hue = xp.where(hue < 0.0, hue + 1.0, hue)
    return hue, safe_divide(xp, span, high), high


@operation("3", 3)
def to_rgb(xp: Any, hsv: Any) -> Any:
    """Inverse of to_hsv; a hue outside [0, 1] belongs to the last sixth, as in Cycles."""
    hue, saturation, value = hsv
    hue = xp.where(hue == 1.0, 0.0, hue)
    place = hue * 6.0
    fraction = place - xp.floor(place)
    low, falling = value * (1.0 - saturation), value * (1.0 - saturation * fraction)
    inside = (hue >= 0.0) & (hue < 1.0)
    usual = each(lambda w: value * (1.0 - saturation * (1.0 - w)), _wheel(xp, hue))
    return each(lambda u, o: xp.where(inside, u, o), usual, (value, low, falling))


def _wheel(xp: Any, hue: Any) -> Any:
    """Pure color of a hue in [0, 1]; red beyond both ends."""
    place = hue * 6.0
    red = clip(xp, xp.absolute(place - 3.0) - 1.0)
    return red, clip(xp, 2.0 - xp.absolute(place - 2.0)), clip(xp, 2.0 - xp.absolute(place - 4.0))


@operation("3", 3)
def to_hsl(xp: Any, color: Any) -> Any:
    """Hue (in turns), saturation and lightness."""
    high = xp.maximum(color[0], xp.maximum(color[1], color[2]))
    low = xp.minimum(xp.minimum(color[0], xp.minimum(color[1], color[2])), 1.0)
    lightness = xp.minimum(1.0, (high + low) / 2.0)
    below = safe_divide(xp, high - low, high + low)
    above = safe_divide(xp, high - low, 2.0 - high - low)
    saturation = xp.where(high == low, 0.0, xp.where(lightness > 0.5, above, below))
    return to_hsv(xp, color)[0], saturation, lightness


@operation("3", 3)
def from_hsl(xp: Any, hsl: Any) -> Any:
    """Inverse of to_hsl."""
    hue, saturation, lightness = hsl
    chroma = (1.0 - xp.absolute(2.0 * lightness - 1.0)) * saturation
    return each(lambda w: (w - 0.5) * chroma + lightness, _wheel(xp, hue))


@operation("1 1 1 1 3", 3)
def hue_saturation(xp: Any, hue: Any, saturation: Any, value: Any, factor: Any, color: Any) -> Any:
    """Hue/Saturation/Value node."""
    hsv = to_hsv(xp, color)
    turned = hsv[0] + hue + 0.5
    turned = turned - xp.floor(turned)
    changed = to_rgb(xp, (turned, clip(xp, hsv[1] * saturation), hsv[2] * value))
    return each(lambda c: xp.maximum(c, 0.0), mix(color, changed, factor))


@operation("1 3", 3)
def invert(xp: Any, factor: Any, color: Any) -> Any:
    """Invert Color node."""
    return each(lambda c: mix(c, 1.0 - c, factor), color)


@operation("3 1", 3)
def gamma(xp: Any, color: Any, power: Any) -> Any:
    """Gamma node: channels at 0 or below stay, but a power of 0 gives 1."""
    is_one = power == 0.0
    return each(lambda c: xp.where(is_one, 1.0, xp.where(c > 0.0, xp.power(xp.maximum(c, 1e-30), power), c)), color)


@operation("3 1 1", 3)
def bright_contrast(xp: Any, color: Any, bright: Any, contrast: Any) -> Any:
    """Brightness/Contrast node."""
    return each(lambda c: xp.maximum((1.0 + contrast) * c + (bright - contrast * 0.5), 0.0), color)


def look_up(xp: Any, table: Any, place: Any, column: int) -> Any:
    """Entry of a table over [0, 1], linear in between, the ends repeated."""
    position = clip(xp, place) * xp.last_row(table)
    low = xp.floor(position)
    first, second = xp.entry(table, low, column), xp.entry(table, low + 1.0, column)
    return mix(first, second, position - low)


@operation("1", 3)
def ramp_color(xp: Any, factor: Any, table: Any) -> Any:
    """Color of a Color Ramp, from a table (rows, 3 or more)."""
    return tuple(look_up(xp, table, factor, column) for column in range(3))


@operation("1", 1)
def ramp_number(xp: Any, factor: Any, table: Any) -> Any:
    """A tabulated number, such as a Color Ramp's alpha, from a table (rows, 1)."""
    return look_up(xp, table, factor, 0)


@operation("1 3", 3)
def curves(xp: Any, factor: Any, color: Any, table: Any, low: float, high: float, continues: bool = True) -> Any:
    """RGB or Vector Curves: a table (rows, 3) over ``low`` to ``high``; beyond it the slopes of the ends continue, or
    the ends stay.
    """
    parts = [_beyond(xp, table, part, column, low, high, continues) for column, part in enumerate(color)]
    return mix(color, tuple(parts), factor)


@operation("1 1", 1)
def curve(xp: Any, factor: Any, value: Any, table: Any, low: float, high: float, continues: bool = True) -> Any:
    """Float Curve."""
    return mix(value, _beyond(xp, table, value, 0, low, high, continues), factor)


def _beyond(xp: Any, table: Any, value: Any, column: int, low: float, high: float, continues: bool) -> Any:
    """Entry of a table over a range; outside its last slope, if it ``continues``, as Cycles extrapolates curves."""
    place = (value - low) / (high - low)
    if not continues:
        return look_up(xp, table, place, column)
    last = xp.last_row(table)
    inside = look_up(xp, table, place, column)
    first, second = xp.entry(table, 0.0 * place, column), xp.entry(table, 0.0 * place + 1.0, column)
    end, before = xp.entry(table, 0.0 * place + last, column), xp.entry(table, 0.0 * place + (last - 1.0), column)
    under = first + (first - second) * -place * last
    over = end + (end - before) * (place - 1.0) * last
    return xp.where(place < 0.0, under, xp.where(place > 1.0, over, inside))
