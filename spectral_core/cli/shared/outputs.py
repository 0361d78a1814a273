# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that a command writes: the names of frames, and that none is a file that it reads."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from spectral_core.errors import InvalidInputError
from spectral_core.files.whole import require_writable


def require_apart(outputs: Iterable[Path], inputs: Iterable[str | Path]) -> None:
    """Raise InvalidInputError if a file that will be written is one that is read; inputs may name no file."""
    read = {Path(each).resolve() for each in inputs if Path(each).is_file()}
    for path in outputs:
        if path.resolve() in read:
            raise InvalidInputError(f"{path} is read by this command and would be lost; write to another file")


def require_outputs(outputs: Iterable[Path], inputs: Iterable[str | Path] = ()) -> None:
    """Require before the work that all files can be written: their folders are made, and none is a file that is read.

    Raises InvalidInputError and FileWriteError, as ``require_apart`` and ``require_writable``.
    """
    paths = list(outputs)
    require_apart(paths, inputs)
    for path in paths:
        require_writable(path)


def require_format(option: str, path: Path, contents: str, *endings: str) -> None:
    """Raise InvalidInputError for a file whose name announces other contents than those that are written."""
    if path.suffix.lower() not in endings:
        raise InvalidInputError(f"{option} is {str(path)!r}; it is written as {contents}, so end it with {endings[0]}")


def numbered(path: Path, number: int) -> Path:
    """The file of a frame: ``####`` in the name is the number, as in Blender; without it ``_0001`` ends the stem.

    The sign of a number below 0 is no digit: the names of a range are equally long up to it.
    """
    holes = list(re.finditer("#+", path.stem))
    stem = path.stem if holes else f"{path.stem}_####"
    start, end = holes[-1].span() if holes else (len(stem) - 4, len(stem))
    digits = f"{'-' if number < 0 else ''}{abs(number):0{end - start}d}"
    return path.with_name(f"{stem[:start]}{digits}{stem[end:]}{path.suffix}")


def files_of_document(path: Path) -> list[Path]:
    """A document, and the files that its entries ``file`` name, at any depth."""
    from spectral_core.documents import read_document

    return [path, *read_document(path, lambda document, folder: [folder / name for name in _named(document)], "files")]


def _named(part: Any) -> Iterator[str]:
    if isinstance(part, dict):
        if isinstance(part.get("file"), str):
            yield part["file"]
        part = list(part.values())
    if isinstance(part, list):
        for each in part:
            yield from _named(each)
