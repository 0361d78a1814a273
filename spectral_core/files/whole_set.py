# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that belong together: all of them replace those of an earlier run, or none does."""

from __future__ import annotations

import contextlib
import os
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
    """Move the files, all of them or none: one that cannot be replaced brings back those that were replaced before."""
    files = sorted(made.iterdir())
    for each in files:
        require_replaceable(target / each.name)
    place, moved = target, list[str]()
    try:
        earlier = Path(tempfile.mkdtemp(dir=made))
        for each in files:
            place = target / each.name
            if os.path.lexists(place):
                _keep(place, earlier / each.name)
                with contextlib.suppress(FileNotFoundError):  # of a link that leads nowhere
                    each.chmod(place.stat().st_mode & 0o777)  # of the file that it replaces
            each.replace(place)
            moved.append(each.name)
    except OSError as error:
        for name in moved:
            _bring_back(target / name, earlier / name)
        raise FileWriteError(f"{place} could not be written: {error.strerror or error}") from error


def _keep(place: Path, kept: Path) -> None:
    """Give a file a second name; copy it where the disk has no such links."""
    try:
        os.link(place, kept, follow_symlinks=False)
    except (OSError, NotImplementedError):
        shutil.copy2(place, kept, follow_symlinks=False)


def _bring_back(place: Path, kept: Path) -> None:
    with contextlib.suppress(OSError):
        if os.path.lexists(kept):
            kept.replace(place)
        else:
            place.unlink()
