# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured luminaires: photometric tables in the format of the IES (ANSI/IESNA LM-63)."""

from __future__ import annotations

import math
import re

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError

WATTS_PER_CANDELA = 4 * np.pi / 177.83
"""Power of an even point light of 1 cd: 4π sr at the luminous efficacy of D65, 177.83 lm/W, as Cycles counts."""
MOST_ANGLES = 1 << 16

Array = NDArray[np.float64]


def read_ies(text: str) -> tuple[Array, Array, Array]:
    """Vertical angles (v,), horizontal angles (h,) in radians, and the power of an even light as bright there (h, v).

    Negative candelas stay negative; ``every_degree`` counts them as 0. Raises FileFormatError if the file holds no
    photometric table.
    """
    match = re.search(r"^TILT=(.*)", text, re.MULTILINE)
    if match is None:
        raise FileFormatError("an IES file holds a line that starts with TILT=; this text has none")
    rest = text[match.end() :]
    numbers, stop = _numbers(rest)
    if match.group(1).strip() == "INCLUDE":  # how light changes when the lamp is tilted: a count, two rows of numbers
        numbers = numbers[2 + 2 * (_count("angles of tilt", numbers[1]) if len(numbers) > 1 else 0) :]
    if len(numbers) < 13:
        raise FileFormatError(
            f"an IES file holds at least 13 numbers after its TILT line; this one {len(numbers)}{stop}"
        )
    _, _, multiplier, verticals, horizontals, kind = numbers[:6]
    ballast, ballast_lamp = numbers[10], numbers[11]
    v, h = _count("vertical angles", verticals), _count("horizontal angles", horizontals)
    needed = 13 + v + h + v * h
    if not v or not h or len(numbers) < needed:
        raise FileFormatError(f"an IES table of {v} by {h} angles needs {needed} numbers; it has {len(numbers)}{stop}")
    if len(numbers) > needed and re.search(r"\d,\d", rest):
        raise FileFormatError(
            f"an IES table of {v} by {h} angles has {needed} numbers; this one {len(numbers)}, since commas separate "
            "numbers: write 0.5 for 0,5"
        )
    if kind not in TYPES:
        raise FileFormatError(f"an IES table has type 1 (C), 2 (B) or 3 (A); this one has {kind:g}")
    body = np.asarray(numbers[13:needed])
    with np.errstate(over="ignore"):  # infinite numbers are refused by the luminaire
        factor = np.prod([multiplier, ballast, ballast_lamp, WATTS_PER_CANDELA])
        strength = body[v + h :].reshape(h, v) * factor
    down, around, strength = TYPES[int(kind)](body[:v], body[v : v + h], strength)
    return np.radians(down), np.radians(around), strength


def _numbers(text: str) -> tuple[list[float], str]:
    """The finite numbers up to the first other word, and that word in words for a message."""
    numbers: list[float] = []
    for word in filter(None, re.split(r"[\s,]+", text)):
        try:
            number = float(word)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            return numbers, f", and then {word[:40]!r}"
        numbers.append(number)
    return numbers, ""


def _count(what: str, number: float) -> int:
    if not (number == int(number) and 0 <= number <= MOST_ANGLES):
        raise FileFormatError(f"an IES file states a whole number of {what} up to {MOST_ANGLES}; this one {number:g}")
    return int(number)


def _type_c(down: Array, around: Array, strength: Array) -> tuple[Array, Array, Array]:
    """The usual type: angles from straight down, and about the vertical axis, of which a half or a quarter is mirrored
    all around.
    """
    around = around - around[0] if _close(around[0], 90.0) else around
    return down, *(_all_around(around, strength) if len(around) > 1 else (around, strength))


def _type_b(down: Array, around: Array, strength: Array) -> tuple[Array, Array, Array]:
    """The polar axis is horizontal: as in Cycles, the two angles change places, and each becomes 0 to 180 degrees. The
    other half of the sphere is dark.
    """
    down, around, strength = around, down, strength.T
    around, strength = _shifted(around, strength)
    down, turned = _shifted(down, strength.T)
    return down, around, turned.T


def _type_a(down: Array, around: Array, strength: Array) -> tuple[Array, Array, Array]:
    """Angles from the horizon, and about the vertical axis from -90 to 90 degrees, or to one side alone."""
    turned, mirrored = (180.0 - around)[::-1], strength[::-1]
    if _close(around[0], 0.0):
        turned, mirrored = np.append(turned, 180.0 + around[1:]), np.concatenate([mirrored, strength[1:]])
    return down + 90.0, turned, mirrored


TYPES = {1: _type_c, 2: _type_b, 3: _type_a}
"""Photometric types of the standard."""


def _shifted(angles: Array, rows: Array) -> tuple[Array, Array]:
    """Angles of -90 to 90 degrees, or of the half from 0 that is mirrored, as 0 to 180."""
    if _close(angles[0], 0.0):
        return np.append(90.0 - angles[:0:-1], 90.0 + angles), np.concatenate([rows[:0:-1], rows])
    return angles + 90.0, rows


def _close(first: float, second: float) -> bool:
    return abs(float(first) - second) < 1e-4


def every_degree(vertical_rad: Array, horizontal_rad: Array, strength: Array) -> Array:
    """The table at every degree, (1 or 361, 181): cubic pieces through the angles, as in Cycles; 0 beyond them."""
    vertical = np.degrees(vertical_rad)
    rows = np.stack([_cubic(vertical, row, np.arange(181.0), *_open_ends(vertical)) for row in strength])
    if len(rows) == 1:
        return np.maximum(rows, 0.0)
    around = np.degrees(horizontal_rad)
    turned = np.stack([_cubic(around, column, np.arange(361.0), "flat", "mirror") for column in rows.T], axis=1)
    return np.maximum(turned, 0.0)


def _open_ends(vertical: Array) -> tuple[str, str]:
    """What follows the ends of the vertical angles: the pole below mirrors.

    Cycles compares 180° and 360° with its own constants in single precision and misses them, so that it neither
    mirrors at the pole above nor goes on around the circle.
    """
    return "mirror" if _close(vertical[0], 0.0) else "flat", "flat"


def _all_around(around: Array, rows: Array) -> tuple[Array, Array]:
    """A quarter, a half, or a circle without its last entry as a whole circle."""
    if _close(around[0], 0.0):
        for end in (90.0, 180.0):
            if _close(around[-1], end):
                around, rows = np.append(around, 2 * end - around[-2::-1]), np.concatenate([rows, rows[-2::-1]])
        gap = 360.0 - around[-1]
        if gap > 1e-4 and (_close(gap, around[1] - around[0]) or _close(gap, around[-1] - around[-2])):
            around, rows = np.append(around, 360.0), np.concatenate([rows, rows[:1]])
    return around, rows


def _cubic(knots: Array, values: Array, at: Array, low: str, high: str) -> Array:
    """Cubic interpolation through knots, in each piece as if they were even; 0 outside."""
    if len(knots) == 1:
        return np.where(np.abs(at - knots[0]) < 0.5, values[0], 0.0)
    before = {"flat": values[0], "mirror": values[1]}[low]
    after = {"flat": values[-1], "mirror": values[-2]}[high]
    padded = np.concatenate([[before], values, [after]])
    piece = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, len(knots) - 2)
    x = (at - knots[piece]) / (knots[piece + 1] - knots[piece])
    a, b, c, d = (padded[piece + k] for k in range(4))
    found = b + 0.5 * x * ((c - a) + x * (2 * a - 5 * b + 4 * c - d + x * (3 * (b - c) + d - a)))
    inside = (at >= knots[0] - 1e-6) & (at <= knots[-1] + 1e-6)
    return np.where(inside, found, 0.0)
