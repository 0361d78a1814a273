# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that a command writes must not be files that it reads."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from spectral_core.errors import InvalidInputError


def require_apart(outputs: Iterable[Path], inputs: Iterable[str | Path]) -> None:
    """Raise InvalidInputError if a file that will be written is one that is read; inputs may name no file."""
    read = {Path(each).resolve() for each in inputs if Path(each).is_file()}
    for path in outputs:
        if path.resolve() in read:
            raise InvalidInputError(f"{path} is read by this command and would be lost; write to another file")


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
