# SPDX-License-Identifier: GPL-3.0-or-later
"""A consistent private copy of a ledger that this user may not write, also while another user's sweep writes it."""

from __future__ import annotations

import shutil
import sqlite3
import time
from contextlib import closing
from pathlib import Path

from spectral_core.errors import FileFormatError

TRIES = 40
SETTLE_S = 0.03
"""Longer than the step of the times of files: a later change has another time."""
Stamp = tuple[tuple[int, int, int] | None, ...]
"""Size, time and number of the ledger and of its log; None for a file that is not there."""


def stamp_of(path: Path) -> Stamp:
    """Values that change when the ledger does."""
    found: list[tuple[int, int, int] | None] = []
    for each in (path, _beside(path, "wal")):
        try:
            facts = each.stat()
            found.append((facts.st_size, facts.st_mtime_ns, facts.st_ino))
        except OSError:
            found.append(None)
    return tuple(found)


def copied(path: Path, folder: Path) -> Path:
    """A copy of a ledger in a folder, with the changes in SQLite's log. Raises FileFormatError."""
    target = folder / path.name
    for _ in range(TRIES):
        for each in (target, _beside(target, "wal"), _beside(target, "shm")):
            each.unlink(missing_ok=True)
        if _copied_by_sqlite(path, target) or _copied_files(path, target):
            return target
    raise FileFormatError(f"{path} changes faster than it can be copied; try again when fewer points are computed")


def _beside(path: Path, ending: str) -> Path:
    return path.with_name(f"{path.name}-{ending}")


def _copied_by_sqlite(path: Path, target: Path) -> bool:
    """Copy a ledger that a program has open, by the locks in the file ``-shm``; False if there is none."""
    if not _beside(path, "shm").is_file():
        return False
    address = f"{path.absolute().as_uri()}?mode=ro&readonly_shm=1"  # SQLite writes nothing beside the file
    try:
        with closing(sqlite3.connect(address, uri=True)) as source, closing(sqlite3.connect(target)) as copy:
            source.backup(copy)
    except sqlite3.DatabaseError:  # locked, or damaged, which the copy of the files shows
        return False
    return True


def _copied_files(path: Path, target: Path) -> bool:
    """Copy the files; False if they changed meanwhile: a part of them would be older than the other."""
    before = stamp_of(path)
    time.sleep(SETTLE_S)
    try:
        shutil.copyfile(path, target)
        log = _beside(path, "wal")
        if log.is_file():
            shutil.copyfile(log, _beside(target, "wal"))
    except FileNotFoundError:  # SQLite removes its log when the last program closes the ledger
        return False
    except OSError as error:
        raise FileFormatError(f"{path} cannot be read: {error.strerror or error}") from error
    return stamp_of(path) == before
