# SPDX-License-Identifier: GPL-3.0-or-later
"""Results of long work whose file cannot be written: they go to the temporary files."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from spectral_core.errors import FileWriteError, InvalidInputError, SpectralError

T = TypeVar("T")


def written_or_kept(path: Path, write: Callable[[Path], T]) -> T:
    """What ``write(path)`` returns. If it cannot write there, the result is written among the temporary files.

    Raises FileWriteError then; its message names the folder that holds the result. If that disk is full, too, the error
    of ``write`` is raised.
    """
    try:
        return write(path)
    except (FileWriteError, InvalidInputError) as error:
        kept = _kept(path, write)
        if kept is None:
            raise
        raise FileWriteError(f"{error}. The result is not lost: it is in {kept}; move it from there") from error


def _kept(path: Path, write: Callable[[Path], object]) -> Path | None:
    """The folder of the files that were written; None if that disk is full, too."""
    try:
        folder = Path(tempfile.mkdtemp(prefix="spectral-kept-"))
    except OSError:
        return None
    try:
        write(folder / path.name)
    except (SpectralError, OSError):
        shutil.rmtree(folder, ignore_errors=True)
        return None
    return folder
