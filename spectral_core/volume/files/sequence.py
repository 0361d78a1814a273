# SPDX-License-Identifier: GPL-3.0-or-later
"""Time sequences: files whose names differ in one number, one frame each."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, islice, pairwise
from pathlib import Path

import numpy as np

from spectral_core.checks import path_of
from spectral_core.errors import InvalidInputError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files.payload import EmptyGridError
from spectral_core.volume.files.read import read_volume
from spectral_core.volume.files.request import RawLayout

_PLAIN = r"(0|[1-9]\d*)"
"""Regular expression of a number without leading zeros."""
_HOLE = re.compile(r"#+|%0?(\d*)d|\{(?::0?(\d*)d?)?\}|\*")
MOST_MISSING, MOST_NAMED = 1000, 8
"""Most missing frames that are listed, and that a note names: the numbers of file names may be dates."""


@dataclass(frozen=True)
class VolumeSequence:
    """Frames in ascending order; files are read on demand."""

    pattern: str
    frames: tuple[tuple[int, Path], ...]
    """(number, file) of every frame."""
    field: str | None = None
    component: int | None = None
    raw: RawLayout | None = None

    def __len__(self) -> int:
        return len(self.frames)

    def __iter__(self) -> Iterator[ScalarVolume]:
        return (self.read(number) for number in self.numbers)

    @property
    def numbers(self) -> tuple[int, ...]:
        """Frame numbers in the file names."""
        return tuple(number for number, _ in self.frames)

    @property
    def step(self) -> int:
        """Step of the numbers: simulations often write every hundredth state. 1 for two frames, which show no step."""
        steps = [after - before for before, after in pairwise(self.numbers)]
        return math.gcd(*steps) if len(steps) > 1 else 1

    @property
    def missing(self) -> tuple[int, ...]:
        """Numbers between the first and the last frame without a file, in steps of ``step``: MOST_MISSING at most."""
        gaps = (range(before + self.step, after, self.step) for before, after in pairwise(self.numbers))
        return tuple(islice(chain.from_iterable(gaps), MOST_MISSING))

    @property
    def missing_note(self) -> str:
        """What to say about missing frames; "" if there are none."""
        missing = self.missing
        named = ", ".join(map(str, missing[:MOST_NAMED])) + (" and others" if len(missing) > MOST_NAMED else "")
        return f"frames without a file are left out: {named}" if missing else ""

    def path(self, number: int) -> Path:
        """The file of one frame."""
        for held, path in self.frames:
            if held == number:
                return path
        raise InvalidInputError(
            f"sequence {self.pattern} has no frame {number}; "
            f"it has {len(self)} from {self.numbers[0]} to {self.numbers[-1]}"
        )

    def read(self, number: int) -> ScalarVolume:
        """The volume of one frame; errors as ``read_volume``. An empty grid is one voxel of 0, as smoke begins."""
        try:
            return self._read(number)
        except EmptyGridError:
            return ScalarVolume(self.path(number).stem, np.zeros((1, 1, 1), np.float32))

    def first(self) -> ScalarVolume:
        """The first frame that is not empty; errors as ``read_volume``, also if all are empty."""
        for number in self.numbers[:-1]:
            with suppress(EmptyGridError):
                return self._read(number)
        return self._read(self.numbers[-1])

    def _read(self, number: int) -> ScalarVolume:
        return read_volume(self.path(number), field=self.field, component=self.component, raw=self.raw)


def find_sequence(
    pattern: str | Path, *, field: str | None = None, component: int | None = None, raw: RawLayout | None = None
) -> VolumeSequence:
    """The frames of a numbered pattern: ``flow_####.vti``, ``flow_%04d.vti``, ``flow_{:04d}.vti`` or ``flow_*.vti``.

    The number occurs in the file name once. Digits of another width than that of a pattern with leading zeros do not
    match, as in ``printf``. Raises InvalidInputError if no file matches or two files have the same number.
    """
    path = path_of(pattern, "the pattern")
    holes = list(_HOLE.finditer(path.name))
    if len(holes) != 1:
        raise InvalidInputError(
            f"pattern {path.name!r} has {len(holes)} places for a number; "
            "expected one, as in name_####.nrrd or name_%04d.nrrd"
        )
    hole = holes[0]
    found = _frames(path, hole.span(), _digits(hole))
    if not found:
        raise InvalidInputError(f"no file in {path.parent} matches {path.name!r}; check folder, digits and ending")
    return VolumeSequence(str(pattern), found, field, component, raw)


def sequence_of(
    path: str | Path, *, field: str | None = None, component: int | None = None, raw: RawLayout | None = None
) -> VolumeSequence | None:
    """The sequence of a file, by the last number in its name; None if there is no other frame.

    Other characters of the name have no meaning here, those of patterns included. A number without a leading zero may
    belong to numbers of one width (0999, 1000) or to plain ones (9, 10): the one with more frames is taken.
    """
    path = path_of(path)
    numbers = list(re.finditer(r"\d+", path.name.removesuffix(".gz").rsplit(".", 1)[0]))
    if not numbers:
        return None
    digits = numbers[-1]
    length = len(digits[0])
    padded = [("#" * width, _padded(width)) for width in range(2, length + 1)]
    # A leading zero tells the width; another number has it, or is wider.
    kinds = padded[-1:] if digits[0].startswith("0") and length > 1 else [("{}", _PLAIN), *padded]
    mark, frames = max(
        ((mark, _frames(path, digits.span(), expression)) for mark, expression in kinds), key=lambda kind: len(kind[1])
    )
    pattern = path.with_name(path.name[: digits.start()] + mark + path.name[digits.end() :])
    return VolumeSequence(str(pattern), frames, field, component, raw) if len(frames) > 1 else None


def _frames(path: Path, place: tuple[int, int], digits: str) -> tuple[tuple[int, Path], ...]:
    """(number, file) of the files that differ from ``path`` in the characters of its name at ``place`` only.

    ``digits``: regular expression of a number. Raises InvalidInputError for two files of one number.
    """
    start, end = place
    matcher = re.compile(re.escape(path.name[:start]) + digits + re.escape(path.name[end:]))
    found: dict[int, Path] = {}
    for file in sorted(path.parent.iterdir()) if path.parent.is_dir() else []:
        match = matcher.fullmatch(file.name)
        if match:
            number = int(match[1])
            if number in found:
                raise InvalidInputError(f"frame {number} of {path.name} is both {found[number].name} and {file.name}")
            found[number] = file
    return tuple(sorted(found.items()))


def _digits(hole: re.Match[str]) -> str:
    """Regular expression of the number: zero-padded to a width, and longer if the number needs it; or any digits."""
    text = hole[0]
    if text == "*":
        return r"(\d+)"
    width = len(text) if text.startswith("#") else int(hole[1] or hole[2] or 1)
    padded = text.startswith(("#", "%0", "{:0"))
    return _padded(width) if padded else _PLAIN


def _padded(width: int) -> str:
    return rf"(\d{{{width}}}|[1-9]\d{{{width},}})" if width > 1 else _PLAIN
