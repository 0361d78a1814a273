# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that belong together: all of them replace those of an earlier run, or none does."""

from __future__ import annotations

import contextlib
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from spectral_core.errors import FileWriteError
from spectral_core.files.of_process import left_in, named_after_process
from spectral_core.files.whole import make_folder, require_replaceable

_PREFIX = ".spectral-set-"


@contextmanager
def whole_files(folder: str | Path) -> Iterator[Path]:
    """Yield an empty folder to write to; its files move to ``folder`` when the block ends without an error.

    A process that is ended while it writes leaves the earlier files as they were; the next one deletes what it left.

    Raises
    ------
    FileWriteError
        The disk is full, or the folder is closed to this user; the files in ``folder`` are as they were.
    InvalidInputError
        A folder, a device or another entry that no file can replace has the name of one of the files.
    """
    target = make_folder(folder)
    try:
        made = Path(tempfile.mkdtemp(prefix=named_after_process(_PREFIX), dir=target))
    except OSError as error:
        raise FileWriteError(f"{target} cannot be written to: {error.strerror or error}") from error
    try:
        yield made
        _move(made, target)
    except FileWriteError as error:
        raise FileWriteError(str(error).replace(str(made), str(target))) from error
    finally:
        # Windows does not tell whether a process has ended, and would delete the files of one that still writes
        left = () if sys.platform == "win32" else left_in(target, _PREFIX)
        for each in (made, *left):
            shutil.rmtree(each, ignore_errors=True)


def _move(made: Path, target: Path) -> None:
    files = sorted(made.iterdir())
    for each in files:
        require_replaceable(target / each.name)
    for each in files:
        with contextlib.suppress(FileNotFoundError):  # a new file gets the permissions of the one that it replaces
            each.chmod((target / each.name).stat().st_mode & 0o777)
        try:
            each.replace(target / each.name)
        except OSError as error:
            raise FileWriteError(f"{target / each.name} could not be written: {error.strerror or error}") from error
