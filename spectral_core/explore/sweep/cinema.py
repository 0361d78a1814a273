# SPDX-License-Identifier: GPL-3.0-or-later
"""data.csv of a Cinema Spec D folder: written, read back and checked against the specification.

Cinema Database Specification D (cinemascience, version 1.2): RFC 4180 text in UTF-8; a header of unique names, then at
least one row; columns whose names start with FILE hold paths relative to the folder and come last; all values of a
column are of one type, integer, float or string, or empty; NaN is a float. A text that a spreadsheet would run as a
formula, or that a reader would take for a number, gets a leading apostrophe.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.explore.sweep.files import inside

FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r", "\n", "'")
"""Includes the apostrophe, so that an added one can be distinguished from an original one."""
MAX_CSV_BYTES = 1_000_000_000


def csv_text(columns: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> str:
    """The text of data.csv, each column of one type; FILE columns are moved to the end, the main picture last.

    Viewers such as pycinema show the last FILE column, so linear pictures precede those for a screen.
    A missing float is NaN, anything else that is missing is empty. Whole numbers in a column of floats are written as
    floats; numbers in a column of texts as texts.
    """
    files = [name for name in columns if is_file_column(name)]
    ordered = [name for name in columns if not is_file_column(name)]
    ordered += sorted(files, key=lambda name: (not name.endswith("_linear"), name == "FILE"))
    table = list(rows)
    written = [_cells(name, [row.get(name) for row in table]) for name in ordered]
    lines = [[_text_cell(name) for name in ordered], *map(list, zip(*written, strict=True))]
    return "".join(",".join(map(_quoted, line)) + "\n" for line in lines)


def _cells(name: str, values: list[Any]) -> list[str]:
    """The cells of a column, all of the type that holds each of its values."""
    if is_file_column(name) or any(isinstance(value, str) for value in values):
        return ["" if value is None else _text_cell(str(value)) for value in values]
    if any(isinstance(value, float) for value in values):
        return ["NaN" if value is None else _float_cell(float(value)) for value in values]
    return ["" if value is None else str(int(value)) for value in values]


def _float_cell(value: float) -> str:
    """A float with all its digits, in a form that is never read as a whole number."""
    if math.isnan(value):
        return "NaN"
    text = repr(value)
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


def _text_cell(text: str) -> str:
    """A text that no spreadsheet executes and no reader interprets as a number."""
    harmless = text.replace("\0", "")
    return f"'{harmless}" if _needs_apostrophe(harmless) else harmless


def _needs_apostrophe(text: str) -> bool:
    if text.startswith(FORMULA_STARTS):
        return True
    try:
        float(text)
    except ValueError:
        return False
    return True


def _quoted(cell: str) -> str:
    """RFC 4180; the csv module of Python 3.11 leaves a lone carriage return open, which would end the row."""
    return f'"{cell.replace(chr(34), chr(34) * 2)}"' if any(letter in cell for letter in ',"\r\n') else cell


def is_file_column(name: str) -> bool:
    """True if a column holds paths of files."""
    return name.upper().startswith("FILE")


def read_csv(path: Path) -> tuple[list[str], list[dict[str, float | str | None]]]:
    """Columns and rows of a data.csv; cells with numbers as numbers.

    Raises FileFormatError for a file that is no Cinema table, and for FILE paths that lead out of the folder.
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
        plain = text[1:] if text.startswith("'") and _needs_apostrophe(text[1:]) else text
        return plain or None
    return None if math.isnan(number) else number


def check_folder(folder: Path, *, read_files: bool = True) -> list[str]:
    """Violations of Cinema Spec D in a folder, in words; empty if it conforms."""
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
    problems = [f"the column {name!r} occurs twice" for name in sorted({n for n in header if header.count(n) > 1})]
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
