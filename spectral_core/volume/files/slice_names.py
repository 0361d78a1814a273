# SPDX-License-Identifier: GPL-3.0-or-later
"""The order of files that are the slices of one stack, by the numbers of their names."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path

from spectral_core.errors import FileFormatError


def in_order(files: Iterable[Path], folder: Path) -> list[Path]:
    """The files by their numbers, ``slice2`` before ``slice10``.

    A stack has one voxel size, so its slices are equally far apart. Raises FileFormatError if the names belong to more
    than one series, or if their numbers have a gap: either would make a wrong volume.
    """
    ordered = sorted(files, key=lambda file: [int(word) if word.isdecimal() else word for word in _words(file)])
    if len(ordered) < 2:
        return ordered
    for file in ordered:
        if _words(file)[::2] != _words(ordered[0])[::2]:
            raise _several(folder, ordered[0], file)
    columns = [[int(number) for number in numbers] for numbers in zip(*(_words(f)[1::2] for f in ordered), strict=True)]
    counters = [column for column in columns if len(set(column)) == len(column)]
    if not counters:
        changes = [column for column in columns if len(set(column)) > 1]
        other = next(k for k, number in enumerate(changes[0]) if number != changes[0][0]) if changes else 1
        raise _several(folder, ordered[0], ordered[other])
    # A name may also hold the time of its slice, which is irregular: one regular number is enough.
    counter = min(counters, key=lambda numbers: (_gap(numbers) is not None, max(numbers) - min(numbers)))
    gap = _gap(counter)
    if gap:
        before, after = (ordered[counter.index(number)].name for number in gap)
        raise FileFormatError(
            f"{folder} has no slice between {before} and {after}, and the others are closer; expected numbers in equal "
            "steps, because all slices of a stack are equally thick: add the missing files, or renumber these if none "
            "is missing"
        )
    return ordered


def _words(file: Path) -> list[str]:
    """The texts and numbers of a name by turns; the first and the last one are texts."""
    return re.split(r"(\d+)", file.name.lower())


def _gap(numbers: list[int]) -> tuple[int, int] | None:
    """The first two successive numbers that are further apart than others are; None if all steps are equal."""
    steps = list(pairwise(sorted(numbers)))
    least = min(after - before for before, after in steps)
    return next(((before, after) for before, after in steps if after - before > least), None)


def _several(folder: Path, one: Path, other: Path) -> FileFormatError:
    return FileFormatError(
        f"{folder} holds several series, such as {one.name} and {other.name}; expected the slices of one stack, whose "
        "names differ in one number: move each series into a folder of its own"
    )
