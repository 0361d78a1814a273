# SPDX-License-Identifier: GPL-3.0-or-later
"""The ledger of a sweep: SQLite tables of points, attempts and manual columns. Every change is one transaction."""

from __future__ import annotations

import contextlib
import os
import sqlite3
import tempfile
import threading
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from spectral_core.errors import FileFormatError, FileWriteError
from spectral_core.explore.sweep.files import json_text
from spectral_core.explore.sweep.ledger.copied import copied, stamp_of
from spectral_core.explore.sweep.ledger.rows import COLUMNS, Row, State, manual_value, row_of

VERSION = 1
_TABLES = """
CREATE TABLE IF NOT EXISTS points (
    key TEXT PRIMARY KEY, ordinal INTEGER NOT NULL, parameters TEXT NOT NULL,
    state TEXT NOT NULL DEFAULT 'pending' CHECK (state IN ('pending', 'done', 'failed')),
    outcome TEXT, files TEXT, seconds REAL, reason TEXT);
CREATE INDEX IF NOT EXISTS by_ordinal ON points (ordinal);
CREATE INDEX IF NOT EXISTS by_state ON points (state);
CREATE TABLE IF NOT EXISTS attempts (
    key TEXT NOT NULL, number INTEGER NOT NULL, worker TEXT NOT NULL, started REAL NOT NULL, ended REAL,
    how TEXT, message TEXT, PRIMARY KEY (key, number));
CREATE TABLE IF NOT EXISTS manual (
    key TEXT NOT NULL, name TEXT NOT NULL, value TEXT NOT NULL, PRIMARY KEY (key, name));
"""

_OWN_FAULT = "SELECT key FROM attempts WHERE how = 'failed'"


class Ledger:
    """An open ledger. Use it from any thread; several processes may hold it open.

    Of a ledger that this user may not write, a private copy is read: SQLite itself writes beside the file even to read.
    It is copied again when the ledger has changed: another user's sweep may still write it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.is_read_only = path.is_file() and not all(os.access(each, os.W_OK) for each in (path, path.parent))
        self._lock = threading.RLock()
        self._copy: tempfile.TemporaryDirectory[str] | None = None
        self._stamp = stamp_of(path)
        self._connection = self._opened()

    def _opened(self) -> sqlite3.Connection:
        """A connection to the ledger, or to a new private copy of it."""
        path, place = self.path, self.path
        if self.is_read_only:
            self._copy = tempfile.TemporaryDirectory(prefix="ledger-")
            place = copied(path, Path(self._copy.name))
        connection = None
        try:
            connection = sqlite3.connect(place, timeout=60.0, check_same_thread=False, isolation_level=None)
            self._prepare(connection)
        except BaseException as error:
            if connection is not None:
                connection.close()
            if isinstance(error, sqlite3.OperationalError):
                text = f"{path} cannot be opened: {error}; is the disk full or the folder closed?"
                raise FileWriteError(text) from error
            if isinstance(error, sqlite3.DatabaseError):
                raise self._damaged(error) from error
            raise
        return connection

    def _prepare(self, connection: sqlite3.Connection) -> None:
        connection.execute("PRAGMA journal_mode=WAL")
        connection.execute("PRAGMA synchronous=NORMAL")
        found = connection.execute("PRAGMA user_version").fetchone()[0]
        if found not in (0, VERSION):
            raise FileFormatError(f"{self.path} is a ledger of version {found}; this program writes version {VERSION}")
        connection.executescript(_TABLES)
        connection.execute(f"PRAGMA user_version={VERSION}")

    def _keep_up(self) -> None:
        """Copy a read-only ledger again if it has changed."""
        now = stamp_of(self.path) if self.is_read_only else self._stamp
        if now != self._stamp and now[0] is not None:
            self.close()
            self._stamp, self._connection = now, self._opened()

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._connection.close()
        if self._copy is not None:
            self._copy.cleanup()

    def copy_to(self, path: Path) -> None:
        """Write a consistent copy, also while the ledger is in use. Raises FileFormatError if it is damaged."""
        target = sqlite3.connect(path)
        try:
            with self._lock:
                self._connection.backup(target)
        except sqlite3.DatabaseError as error:
            raise self._damaged(error) from error
        finally:
            target.close()

    def _found(self, query: str, arguments: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
        """Rows of a query. Raises FileFormatError if the file is damaged, FileWriteError if it is locked or gone."""
        with self._lock:
            self._keep_up()
            try:
                return self._connection.execute(query, arguments).fetchall()
            except sqlite3.OperationalError as error:
                raise FileWriteError(f"{self.path} could not be read: {error}; run the sweep again") from error
            except sqlite3.DatabaseError as error:
                raise self._damaged(error) from error

    def _damaged(self, error: Exception) -> FileFormatError:
        return FileFormatError(
            f"{self.path} is damaged: {error}. Restore the folder from a backup, or run the sweep into another folder, "
            "which computes all points anew"
        )

    @contextmanager
    def transaction(self) -> Iterator[sqlite3.Connection]:
        """All changes within, or none. Raises FileWriteError if the disk is full or the file cannot be written."""
        if self.is_read_only:
            raise FileWriteError(
                f"{self.path} is read-only, so the sweep can be shown, but not changed; copy its folder elsewhere"
            )
        with self._lock:
            try:
                self._connection.execute("BEGIN IMMEDIATE")
                yield self._connection
                self._connection.execute("COMMIT")
            except BaseException as error:
                if self._connection.in_transaction:  # SQLite itself takes the changes back when the disk is full
                    with contextlib.suppress(sqlite3.Error):
                        self._connection.execute("ROLLBACK")
                if isinstance(error, sqlite3.DatabaseError) and not isinstance(error, sqlite3.OperationalError):
                    raise self._damaged(error) from error
                if not isinstance(error, sqlite3.OperationalError):
                    raise
                raise FileWriteError(
                    f"{self.path} could not be written: {error}; computed points stay. Run the sweep again when the "
                    "disk has room and no other program locks the file"
                ) from error

    def add(self, points: Iterable[tuple[str, Mapping[str, Any]]]) -> int:
        """Add points that are not yet in the ledger, in this order; returns the number of new ones."""
        with self.transaction() as database:
            start = database.execute("SELECT COALESCE(MAX(ordinal) + 1, 0) FROM points").fetchone()[0]
            new = 0
            for key, parameters in points:
                cursor = database.execute(
                    "INSERT OR IGNORE INTO points (key, ordinal, parameters) VALUES (?, ?, ?)",
                    (key, start + new, json_text(dict(parameters))),
                )
                new += cursor.rowcount
            return new

    def rows(self, state: State | None = None) -> list[Row]:
        """All rows in the order of the design."""
        where, arguments = (" WHERE state = ?", (state,)) if state is not None else ("", ())
        found = self._found(f"SELECT {COLUMNS} FROM points{where} ORDER BY ordinal", arguments)
        try:
            return [row_of(each) for each in found]
        except ValueError as error:
            raise self._damaged(error) from error

    def failed_by_themselves(self) -> set[str]:
        """Keys of the points that were set aside with an error or a crash of their own: a run leaves them out."""
        query = f"SELECT key FROM points WHERE state = 'failed' AND key IN ({_OWN_FAULT})"
        return {key for (key,) in self._found(query)}

    def has_points(self) -> bool:
        """True if a point was ever entered."""
        return bool(self._found("SELECT EXISTS (SELECT 1 FROM points)")[0][0])

    def states(self) -> dict[str, State]:
        """State of every point by key."""
        return dict(self._found("SELECT key, state FROM points"))

    def begin(self, key: str, worker: str) -> int:
        """Record the start of an attempt; returns its number from 1."""
        with self.transaction() as database:
            number = 1 + database.execute("SELECT COUNT(*) FROM attempts WHERE key = ?", (key,)).fetchone()[0]
            database.execute(
                "INSERT INTO attempts (key, number, worker, started) VALUES (?, ?, ?, ?)",
                (key, number, worker, time.time()),
            )
            return int(number)

    def commit(self, key: str, outcome: Mapping[str, Any], files: Mapping[str, str], seconds: float) -> bool:
        """Store an outcome; only the first one of a point is stored. True if this was it."""
        with self.transaction() as database:
            cursor = database.execute(
                "UPDATE points SET state = 'done', outcome = ?, files = ?, seconds = ?, reason = NULL "
                "WHERE key = ? AND state != 'done'",
                (json_text(dict(outcome)), json_text(dict(files)), seconds, key),
            )
            database.execute(
                "UPDATE attempts SET ended = ?, how = 'done' WHERE key = ? AND ended IS NULL", (time.time(), key)
            )
            return cursor.rowcount == 1

    def end_attempt(self, key: str, how: str, message: str) -> None:
        """Record the end of the open attempt of a point: "failed", "killed" or "interrupted"."""
        with self.transaction() as database:
            database.execute(
                "UPDATE attempts SET ended = ?, how = ?, message = ? WHERE key = ? AND ended IS NULL",
                (time.time(), how, message[-4000:], key),
            )

    def interrupt_open(self) -> int:
        """Close attempts whose process no longer exists; returns their number."""
        with self.transaction() as database:
            cursor = database.execute(
                "UPDATE attempts SET ended = ?, how = 'interrupted', message = 'the sweep ended' WHERE ended IS NULL",
                (time.time(),),
            )
            return cursor.rowcount

    def attempts(self, key: str, how: str | None = None) -> int:
        """Number of attempts of a point; with ``how``, of those that ended in this way."""
        query = "SELECT COUNT(*) FROM attempts WHERE key = ?" + ("" if how is None else " AND how = ?")
        return int(self._found(query, (key,) if how is None else (key, how))[0][0])

    def set_aside(self, key: str, reason: str) -> None:
        """Mark a point as failed, with the reason."""
        with self.transaction() as database:
            database.execute("UPDATE points SET state = 'failed', reason = ? WHERE key = ?", (reason[-4000:], key))

    def retry_failed(self) -> int:
        """Reset points that were set aside; returns their number."""
        with self.transaction() as database:
            database.execute("DELETE FROM attempts WHERE key IN (SELECT key FROM points WHERE state = 'failed')")
            return database.execute(
                "UPDATE points SET state = 'pending', reason = NULL WHERE state = 'failed'"
            ).rowcount

    def retry_killed(self) -> int:
        """Reset points that were set aside only because their workers were killed from outside; returns their
        number.
        """
        with self.transaction() as database:
            found = database.execute(
                f"SELECT key FROM points WHERE state = 'failed' AND key NOT IN ({_OWN_FAULT})"
            ).fetchall()
            database.executemany("DELETE FROM attempts WHERE key = ? AND how = 'killed'", found)
            database.executemany("UPDATE points SET state = 'pending', reason = NULL WHERE key = ?", found)
            return len(found)

    def set_manual(self, name: str, values: Mapping[str, float | int | str | None]) -> None:
        """Set a manual column at some points; None erases."""
        with self.transaction() as database:
            for key, value in values.items():
                if value is None:
                    database.execute("DELETE FROM manual WHERE key = ? AND name = ?", (key, name))
                else:
                    database.execute("INSERT OR REPLACE INTO manual VALUES (?, ?, ?)", (key, name, json_text(value)))

    def manual(self) -> dict[str, dict[str, Any]]:
        """Manual values by column and key."""
        found: dict[str, dict[str, Any]] = {}
        for key, name, value in self._found("SELECT key, name, value FROM manual"):
            try:
                found.setdefault(name, {})[key] = manual_value(key, name, value)
            except ValueError as error:
                raise self._damaged(error) from error
        return found
