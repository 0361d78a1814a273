# SPDX-License-Identifier: GPL-3.0-or-later
"""The number of finished points of a sweep that another process runs, for a display that asks often."""

from __future__ import annotations

import contextlib
import sqlite3
from pathlib import Path


class DoneCount:
    """Counts the finished points of a ledger, without reading a row and without waiting for the process that writes it.

    A count that is asked for again reads nothing if the ledger has not changed, else the index of the states alone.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._connection: sqlite3.Connection | None = None
        self._version = -1
        self._done = 0
        self._is_closed = False

    def read(self) -> int:
        """The present number; the last known one if the ledger is not there yet, locked, damaged or closed here."""
        with contextlib.suppress(sqlite3.DatabaseError):
            if self._connection is None:
                if self._is_closed or not self._path.is_file() or not self._path.stat().st_size:
                    return self._done
                address = f"{self._path.absolute().as_uri()}?mode=rw"  # does not make a file
                self._connection = sqlite3.connect(address, uri=True, timeout=0.05, isolation_level=None)
            version = self._connection.execute("PRAGMA data_version").fetchone()[0]
            if version != self._version:
                query = "SELECT COUNT(*) FROM points WHERE state = 'done'"
                self._done = int(self._connection.execute(query).fetchone()[0])
                self._version = version
        return self._done

    def close(self) -> None:
        """Close the ledger; ``read`` returns the number of this moment from now on."""
        self.read()
        self._is_closed = True
        if self._connection is not None:
            self._connection.close()
            self._connection = None
