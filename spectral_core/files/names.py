# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of things as parts of file names."""

from __future__ import annotations

from collections.abc import Sequence
from unicodedata import normalize

LONGEST = 120
"""Most bytes of a part: file systems take 255 bytes for a name, with its other parts."""


def file_words(names: Sequence[str]) -> list[str]:
    """A part of a file name for each name: letters, digits, - and _, and a number where two would be one file.

    Letters of different case are equal, and so are Korean syllables and their parts, as some systems treat them. The
    ends of long names are left out.
    """
    found: list[str] = []
    for name in names:
        plain = "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in name) or "_"
        plain = plain.encode("utf-8", "replace")[:LONGEST].decode("utf-8", "ignore")
        number, tried = 1, plain
        while _compared(tried) in {_compared(each) for each in found}:
            number += 1
            tried = f"{plain}_{number}"
        found.append(tried)
    return found


def _compared(name: str) -> str:
    return normalize("NFC", normalize("NFC", name).casefold())
