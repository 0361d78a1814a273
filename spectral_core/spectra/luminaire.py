# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured luminaires: photometric tables in the format of the IES (ANSI/IESNA LM-63)."""

from __future__ import annotations

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

    Raises FileFormatError if the file holds no photometric table of type C.
    """
    match = re.search(r"^TILT=(\S+)", text, re.MULTILINE)
    if match is None:
        raise FileFormatError("an IES file holds a line that starts with TILT=; this text has none")
    try:
        numbers = [float(word) for word in re.split(r"[\s,]+", text[match.end() :].strip()) if word]
    except ValueError as error:
        raise FileFormatError(f"after its TILT line an IES file holds numbers only; {error}") from error
    if match.group(1) == "INCLUDE":  # how light changes when the lamp is tilted: a count, and two rows of numbers
        count = int(numbers[1]) if len(numbers) > 1 else 0
        numbers = numbers[2 + 2 * count :]
    if len(numbers) < 13:
        raise FileFormatError(f"an IES file holds at least 13 numbers after its TILT line; this one {len(numbers)}")
    _, _, multiplier, verticals, horizontals, kind = numbers[:6]
    ballast, ballast_lamp = numbers[10], numbers[11]
    v, h = int(verticals), int(horizontals)
    if not (0 < v <= MOST_ANGLES and 0 < h <= MOST_ANGLES) or len(numbers) < 13 + v + h + v * h:
        raise FileFormatError(
            f"an IES table of {v} by {h} angles needs {13 + v + h + v * h} numbers; it has {len(numbers)}"
        )
    if int(kind) != 1:
        raise FileFormatError(f"an IES table of type {'?CBA'[min(int(kind), 3)]} is not understood; only type C is")
    body = np.asarray(numbers[13 : 13 + v + h + v * h])
    factor = multiplier * ballast * ballast_lamp * WATTS_PER_CANDELA
    strength = np.maximum(body[v + h :].reshape(h, v) * factor, 0.0)
    return np.radians(body[:v]), np.radians(body[v : v + h]), strength
