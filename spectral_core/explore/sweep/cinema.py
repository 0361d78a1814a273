# SPDX-License-Identifier: GPL-3.0-or-later
"""data.csv of a Cinema Spec D folder: written, read back and checked against the specification.

Cinema Database Specification D (cinemascience, version 1.0): RFC 4180 text; a header of unique names, then at least
one row; columns whose names start with FILE hold paths relative to the folder and come last; the type of a column is
that of its first value. A text that a spreadsheet would run as a formula gets a leading apostrophe.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.explore.sweep.files import inside

FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r", "\n")
MAX_CSV_BYTES = 1_000_000_000


def csv_text(columns: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> str:
    """The text of data.csv; FILE columns are moved to the end, a missing number is NaN, a missing text is empty."""
    ordered = [name for name in columns if not is_file_column(name)] + [
        name for name in columns if is_file_column(name)
    ]
    table = list(rows)
    text_columns = {name for name in ordered if any(isinstance(row.get(name), str) for row in table)}
    out = io.StringIO(newline="")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([cell(name) for name in ordered])
    for row in table:
        writer.writerow(
            [_missing(name, text_columns) if row.get(name) is None else cell(row[name]) for name in ordered]
        )
    return out.getvalue()


def cell(value: Any) -> str:
    """A value as a cell: numbers to the last bit, formulas made harmless."""
    if isinstance(value, str):
        harmless = value.replace("\0", "")
        return f"'{harmless}" if harmless.startswith(FORMULA_STARTS) else harmless
    if isinstance(value, float):
        return "NaN" if math.isnan(value) else repr(value)
    return str(value)


def _missing(name: str, text_columns: set[str]) -> str:
    return "" if name in text_columns or is_file_column(name) else "NaN"


def is_file_column(name: str) -> bool:
    """Whether a column holds paths of files."""
    return name.upper().startswith("FILE")


def read_csv(path: Path) -> tuple[list[str], list[dict[str, float | str | None]]]:
    """Columns and rows of a data.csv, numbers where a cell is one.

    Raises FileFormatError for what is no Cinema table, and for FILE paths that lead out of the folder.
    """
    problems = check_folder(path.parent, read_files=False)
    if problems:
        raise FileFormatError(f"{path}: {problems[0]}")
    with path.open(encoding="utf-8-sig", newline="") as file:
        reader = csv.reader(file)
        columns = next(reader)
        rows = [{name: _value(name, text) for name, text in zip(columns, row, strict=True)} for row in reader if row]
    return columns, rows


def _value(name: str, text: str) -> float | str | None:
    if is_file_column(name):
        return text or None
    try:
        number = float(text)
    except ValueError:
        plain = text[1:] if text.startswith("'") and text[1:].startswith(FORMULA_STARTS) else text
        return plain or None
    return None if math.isnan(number) else number


def check_folder(folder: Path, *, read_files: bool = True) -> list[str]:
    """What a folder violates of Cinema Spec D, in words; empty where it conforms."""
    path = folder / "data.csv"
    if not path.is_file():
        return ["there is no data.csv"]
    if path.stat().st_size > MAX_CSV_BYTES:
        return [f"data.csv has {path.stat().st_size:,} bytes; at most {MAX_CSV_BYTES:,} are read"]
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = [row for row in csv.reader(file) if row]
    except (UnicodeDecodeError, csv.Error) as error:
        return [f"data.csv is no table: {error}"]
    if len(rows) < 2:
        return ["data.csv needs a header and at least one row"]
    header = rows[0]
    problems = [f"the column {name!r} stands twice" for name in sorted({n for n in header if header.count(n) > 1})]
    problems += ["a column has no name" for name in header if not name.strip()]
    first_file = next((k for k, name in enumerate(header) if is_file_column(name)), len(header))
    problems += [f"{name!r} comes after a FILE column" for name in header[first_file:] if not is_file_column(name)]
    for number, row in enumerate(rows[1:], 2):
        if len(row) != len(header):
            return [*problems, f"line {number} has {len(row)} cells; the header has {len(header)}"]
        for text in row[first_file:]:
            try:
                found = not text or inside(folder, text)
                if read_files and text and not Path(str(found)).is_file():
                    problems.append(f"line {number} names {text!r}, which does not exist")
            except InvalidInputError as error:
                problems.append(f"line {number}: {error}")
    return problems
