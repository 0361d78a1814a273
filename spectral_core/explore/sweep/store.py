# SPDX-License-Identifier: GPL-3.0-or-later
"""The store of a sweep: a Cinema Spec D folder with a project file and a ledger, which owns the data.

``NAME.cdb/``: ``data.csv`` and ``image/`` are for other programs; ``project.json`` holds parameters and design;
``ledger.sqlite`` holds every point and attempt. ``outcome/`` and ``lease/`` pass outcomes from workers to the ledger.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from spectral_core.errors import FileFormatError, InvalidInputError, counted
from spectral_core.explore.features.expression import evaluate
from spectral_core.explore.sweep.cinema import csv_text
from spectral_core.explore.sweep.designs import Point
from spectral_core.explore.sweep.files import (
    DRIVER_LOCK,
    STORE_FOLDERS,
    file_lock,
    read_json,
    remove_begun,
    require_free,
    write_whole,
)
from spectral_core.explore.sweep.ledger import Ledger, Row, require_ledger, require_points
from spectral_core.explore.sweep.outcome import point_key
from spectral_core.explore.sweep.parameters import is_finite, require_column_name
from spectral_core.explore.sweep.project import Project, present_environment
from spectral_core.explore.sweep.task import Receipt, StoreAddress, commit_files, spooled_record
from spectral_core.files.whole import make_folder

TIMING_COLUMN = "seconds"
"""The column whose values depend on the machine."""


class Store:
    """An open store. Only one process drives a sweep at a time (``only_holder`` on ``driver.lock``)."""

    def __init__(self, folder: Path, project: Project) -> None:
        self.folder = folder
        self.project = project
        self.not_computed: dict[str, str] = {}
        """Computed columns that the last table lacks, and why."""
        for name in STORE_FOLDERS:
            make_folder(folder / name)
        self.ledger = Ledger(folder / "ledger.sqlite")

    @classmethod
    def create(cls, folder: Path, project: Project) -> Store:
        """A new store, also in a folder where an earlier process was ended while it made one.

        Raises InvalidInputError if the folder holds something else, FileWriteError if the disk is full.
        """
        folder = cdb_folder(folder)
        require_free(folder)
        project.region.checked(project.space)
        project.design = project.design.placed(project.space)
        project.environment = present_environment()
        is_new_folder = not folder.exists()
        make_folder(folder)
        try:
            with file_lock(folder / DRIVER_LOCK):  # two processes may begin at once
                return cls._begun(folder, project)
        except (InvalidInputError, FileFormatError):  # it has the data of others
            raise
        except BaseException:  # a full disk
            remove_begun(folder, with_folder=is_new_folder)
            raise

    @classmethod
    def _begun(cls, folder: Path, project: Project) -> Store:
        """A new store in a folder of ``require_free`` whose lock is held."""
        if (folder / "project.json").is_file():
            raise InvalidInputError(f"another process has just begun a sweep in {folder}; run it again")
        store = cls(folder, project)
        try:
            if store.ledger.has_points():
                raise InvalidInputError(
                    f"{folder} has a ledger with points and no project.json; restore that file from a backup, or name "
                    "another folder"
                )
            store.save_project()
        except BaseException:
            store.close()
            raise
        return store

    @classmethod
    def open(cls, folder: Path) -> Store:
        """An existing store. Raises FileFormatError if there is none, or if its ledger is gone."""
        folder = cdb_folder(folder)
        if not (folder / "project.json").is_file():
            raise FileFormatError(f"{folder} holds no sweep (no project.json)")
        project = cls.project_of(folder)
        require_ledger(folder / "ledger.sqlite")
        store = cls(folder, project)
        try:
            require_points(store.ledger.path, store.ledger.has_points())
        except BaseException:
            store.close()
            raise
        return store

    @staticmethod
    def project_of(folder: Path) -> Project:
        """The project of a store's folder. Raises FileFormatError."""
        return Project.from_dict(read_json(folder / "project.json"), str(folder / "project.json"))

    def close(self) -> None:
        """Close the ledger."""
        self.ledger.close()

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def address(self, *, linear: bool = True) -> StoreAddress:
        """Data that workers need to commit."""
        return StoreAddress(str(self.folder.resolve()), self.project.store_id, linear)

    def refresh(self) -> None:
        """Read project.json again: another process may have changed it, and the next change must not undo that."""
        self.project = Store.project_of(self.folder)

    def save_project(self) -> None:
        """Write project.json."""
        write_whole(self.folder / "project.json", json.dumps(self.project.to_dict(), indent=1, allow_nan=False) + "\n")

    def key(self, point: Mapping[str, Any]) -> str:
        """Row key of a point of this project."""
        return point_key(self.project.fingerprint, point, self.project.seed)

    def enter(self, points: Iterable[Point]) -> int:
        """Add points to the ledger; existing ones are unchanged. Returns the number of new points."""
        return self.ledger.add((self.key(point), point) for point in points)

    def known_points(self) -> list[Point]:
        """Points of the ledger, except failed ones."""
        return [row.parameters for row in self.ledger.rows() if row.state != "failed"]

    def take_in(self, receipt: Receipt) -> None:
        """Store a worker's outcome in the ledger, with its files if the worker could not write them."""
        if receipt.contents:
            with file_lock(self.folder / "lease" / receipt.key):
                commit_files(self.folder, receipt.key, receipt.record, receipt.contents)
        record = receipt.record
        self.ledger.commit(receipt.key, record["values"], record["files"], record["seconds"])
        self._drop_spool(receipt.key)

    def _drop_spool(self, key: str) -> None:
        (self.folder / "outcome" / f"{key}.json").unlink(missing_ok=True)
        (self.folder / "lease" / key).unlink(missing_ok=True)

    def recover(self) -> int:
        """Store outcomes that workers committed but no driver stored; returns their number, 0 if it is read-only."""
        found = 0
        known = {} if self.ledger.is_read_only else self.ledger.states()
        for path in sorted((self.folder / "outcome").glob("*.json")):
            record = spooled_record(path) if path.stem in known else None
            if record is not None:
                self.take_in(Receipt(path.stem, record))
                found += 1
        return found

    def columns(self) -> dict[str, list[Any]]:
        """The finished rows by column: parameters, values, seconds, manual columns, expressions, key, files.

        An expression that cannot be computed gives an empty column, or none if its name is taken, and is in
        ``not_computed``: the column that it reads may come later, as those of a comparison do, or be gone.
        """
        table, self.not_computed = self._table(self.ledger.rows("done"), self.project.expressions)
        return table

    def _table(self, rows: list[Row], expressions: Mapping[str, str]) -> tuple[dict[str, list[Any]], dict[str, str]]:
        """The columns of rows, and why some expressions gave none."""
        table: dict[str, list[Any]] = {
            name: [row.parameters.get(name) for row in rows] for name in self.project.space.names
        }
        for name in dict.fromkeys(name for row in rows for name in row.outcome):
            if name not in table:
                table[name] = [row.outcome.get(name) for row in rows]
        table[TIMING_COLUMN] = [row.seconds for row in rows]
        for name, by_key in sorted(self.ledger.manual().items()):
            if name not in table:
                table[name] = [by_key.get(row.key) for row in rows]
        wrong: dict[str, str] = {}
        for name, text in expressions.items() if rows else ():
            if name in table:
                wrong[name] = f"a column is computed as {name!r}, which the outcome has already; rename it in [columns]"
                continue
            try:
                table[name] = evaluate(text, table)
            except InvalidInputError as error:
                table[name], wrong[name] = [None] * len(rows), str(error)
        table["key"] = [row.key for row in rows]
        for name in dict.fromkeys(name for row in rows for name in row.files):
            table[name] = [row.files.get(name) for row in rows]
        return table, wrong

    def not_finite(self, keys: Collection[str]) -> dict[str, int]:
        """At how many of the rows ``keys`` a column has no finite value, by its name."""
        chosen = set(keys)
        rows = [row for row in self.ledger.rows("done") if row.key in chosen]
        found = Counter(name for row in rows for name, value in row.outcome.items() if value is None)
        table, wrong = self._table(rows, self.project.expressions)
        for name in self.project.expressions:
            if name not in wrong and None in table.get(name, ()):
                found[name] = table[name].count(None)
        return dict(found)

    def write_table(self) -> Path:
        """Write data.csv of all finished rows, in the order of the design."""
        table = self.columns()
        rows = ({name: column[i] for name, column in table.items()} for i in range(len(table["key"])))
        path = self.folder / "data.csv"
        write_whole(path, csv_text(list(table), rows))
        return path

    def derive(self, name: str, expression: str) -> list[Any]:
        """Add a column computed from others, and return its values, None where they are not finite.

        Raises InvalidInputError if the expression is not safe or does not fit.
        """
        require_column_name(name)
        table = self.columns()
        if name in table and name not in self.project.expressions:
            raise InvalidInputError(f"there is a column {name!r} already; take another name")
        further, wrong = self._table(self.ledger.rows("done"), {**self.project.expressions, name: expression})
        for column, reason in wrong.items():
            if column == name or column not in self.not_computed:
                raise InvalidInputError(reason if column == name else f"{column!r}, which reads {name!r}: {reason}")
        self.project.expressions[name] = expression
        self.save_project()
        return further.get(name, [])

    def label(self, name: str, values: Mapping[str, float | int | str | None]) -> None:
        """Set a manual column at some rows by key; None erases."""
        require_column_name(name)
        states = self.ledger.states()
        unknown = [key for key in values if key not in states]
        if unknown:
            raise InvalidInputError(f"the sweep has no row {unknown[0][:64]!r}")
        for value in values.values():
            if value is not None and (isinstance(value, bool) or not isinstance(value, float | int | str)):
                raise InvalidInputError(f"a manual value is {value!r}; expected a number or a text")
            if isinstance(value, int) and not is_finite(value):
                raise InvalidInputError("a manual value is a whole number beyond 1e308; expected a smaller number")
            if isinstance(value, str) and len(value) > 1000:
                raise InvalidInputError("a label is at most 1000 characters long")
        self.add_columns({name: values})

    def add_columns(self, columns: Mapping[str, Mapping[str, float | int | str | None]]) -> None:
        """Set columns beside those of the outcomes, by name and key. Raises InvalidInputError for a name that the
        table has from elsewhere: its values would be replaced.
        """
        taken = {*self.project.space.names, *self.project.expressions, TIMING_COLUMN, "key"}
        taken |= {column for row in self.ledger.rows("done") for column in row.outcome}
        for name in columns:
            if name in taken:
                raise InvalidInputError(
                    f"{name!r} is not a manual column: a parameter, a value of the outcome or a computed column has "
                    "this name; take another name, or rename that one"
                )
        for name, values in columns.items():
            self.ledger.set_manual(name, values)


def not_finite_note(name: str, count: int, rows: int) -> str:
    """What to say about a column without a finite value at ``count`` of ``rows`` points."""
    return f"{name!r} has no finite value at {count} of {counted(rows, 'point')}; the table has no number there"


def cdb_folder(folder: Path) -> Path:
    """The folder with the extension .cdb, by which Cinema's viewers recognize it. Raises InvalidInputError."""
    path = Path(folder).expanduser()
    if not path.name:  # the present folder, or the root
        path = path.resolve()
        if not path.name:
            raise InvalidInputError(f"{path} is no folder of a sweep; name a folder in it")
    return path if path.suffix == ".cdb" else path.with_name(path.name + ".cdb")
