# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that a command writes must not be files that it reads."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from spectral_core.errors import InvalidInputError


def require_apart(outputs: Iterable[Path], inputs: Iterable[str | Path]) -> None:
    """Raise InvalidInputError if a file that will be written is one that is read; inputs may name no file."""
    read = {Path(each).resolve() for each in inputs if Path(each).is_file()}
    for path in outputs:
        if path.resolve() in read:
            raise InvalidInputError(f"{path} is read by this command and would be lost; write to another file")
