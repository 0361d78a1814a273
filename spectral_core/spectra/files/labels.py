# SPDX-License-Identifier: GPL-3.0-or-later
"""Wavelengths with a word or a unit in one cell, as instruments write them: ``400 nm``, ``R400``."""

from __future__ import annotations

import re
from collections.abc import Sequence

WORDS = ("", "r", "refl", "reflectance", "nm", "wl", "lambda", "λ", "spec", "spectral", "spectral_nm")
"""Words before the number; another one is part of a name, such as LED400."""
LEAST = 3
"""Cells with a label that make a row or column one of wavelengths; fewer may be names."""
RANGE_NM = (200.0, 3000.0)
"""Numbers outside of it count something else: R1 to R15 are test colors."""
_LABELED = re.compile(r"(?P<word>[^\W\d]*)[ [(]*(?P<number>\d+(?:[.,]\d+)?) ?(?:nm)?[])]?", re.IGNORECASE)


def labeled_wavelengths(cells: Sequence[str]) -> list[str | None]:
    """For each cell the number of the wavelength in nm that it states with a word or a unit, or None.

    All are None if these cells are fewer than LEAST, have different words, or do not rise or fall.
    """
    found = [_label(cell) for cell in cells]
    known = [each for each in found if each is not None]
    numbers = [float(number) for _, number in known]
    is_sorted = numbers in (sorted(set(numbers)), sorted(set(numbers), reverse=True))
    if len(known) < LEAST or len({word for word, _ in known}) > 1 or not is_sorted:
        return [None] * len(found)
    return [None if each is None else each[1] for each in found]


def _label(cell: str) -> tuple[str, str] | None:
    """The word and the number of a cell; None for a number alone, and for other texts."""
    found = _LABELED.fullmatch(cell)
    if found is None or found["number"] == cell:
        return None
    word, number = found["word"].strip("_").lower(), found["number"].replace(",", ".")
    is_wavelength = word in WORDS and RANGE_NM[0] <= float(number) <= RANGE_NM[1]
    return (word, number) if is_wavelength else None
