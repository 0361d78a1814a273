# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of things as parts of file names."""

from __future__ import annotations

from collections.abc import Sequence


def file_words(names: Sequence[str]) -> list[str]:
    """A part of a file name for each name: letters, digits, - and _, and a number where two would be one file.

    Letters of different case are equal, as some systems treat them.
    """
    found: list[str] = []
    for name in names:
        plain = "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in name) or "_"
        number, tried = 1, plain
        while tried.casefold() in {each.casefold() for each in found}:
            number += 1
            tried = f"{plain}_{number}"
        found.append(tried)
    return found
