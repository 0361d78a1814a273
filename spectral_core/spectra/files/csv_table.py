# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of spectra: wavelengths in the first column (or row), one spectrum per further column (or row).

Separators are comma, semicolon, tab or blanks, found from the first rows; with semicolons or tabs a decimal comma is
understood. An empty cell means "not measured here": each spectrum keeps the wavelengths that it has. The headings may
be in a comment directly above the numbers, as NumPy writes them. Wavelengths may have a label (``400 nm``, ``R400``).
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from io import StringIO
from pathlib import Path

import numpy as np

from spectral_core.errors import FileFormatError, counted
from spectral_core.files.guarded import read_text
from spectral_core.files.whole import write_text
from spectral_core.spectra.files.columns import (
    FRACTION_PER_UNIT,
    Column,
    ReadOptions,
    built,
    is_number,
    number,
    readable,
)
from spectral_core.spectra.files.directions import Row, runs_across, used
from spectral_core.spectra.files.headings import (
    ALONE,
    AT_START,
    named_column,
    names_wavelengths,
    require_quantity,
    stated_unit,
    wavelength_unit,
)
from spectral_core.spectra.files.labels import labeled_wavelengths
from spectral_core.spectra.files.statements import Statements, require_no_other_format, statements_of
from spectral_core.spectra.spectrum import Spectrum

_ABOVE = "remove other lines above the table, or begin them with '#'"
_GROUPED = re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+")
"""A number that may have separators of thousands."""


def read(path: Path, options: ReadOptions) -> list[Spectrum]:
    """All spectra of a table. Raises FileFormatError."""
    statements = Statements(path)
    rows = _with_plain_wavelengths(path, _rows(path, statements))
    header, body = (rows[0], rows[1:]) if not is_number(rows[0][1][0]) else ((0, []), rows)
    unit = wavelength_unit(path, header, options.wavelength_unit) if header[1] else None
    make = _columns_from_rows if runs_across(path, header, body) else _columns_from_columns
    columns = make(path, header, body, unit)
    statements.apply(columns)
    for column in columns:
        require_quantity(path, header[0], column, options.kind)
    return [built(path, column, options) for column in columns]


def write(path: Path, spectra: Sequence[Spectrum]) -> None:
    """Write spectra on any grids into one table; numbers are the shortest that read back exactly."""
    wavelengths = np.unique(np.concatenate([spectrum.grid.wavelengths_nm for spectrum in spectra]))
    cells = []
    for spectrum in spectra:
        known = dict(zip(spectrum.grid.wavelengths_nm.tolist(), spectrum.values.tolist(), strict=True))
        cells.append([repr(known[wavelength]) if wavelength in known else "" for wavelength in wavelengths.tolist()])
    buffer = StringIO()
    headings = [" ".join(spectrum.name.split()) for spectrum in spectra]
    # A name that ends like a unit would be read as one, and names that are all numbers as wavelengths: names and unit
    # are then also stated in words.
    are_numbers = all(map(is_number, headings))
    names_mislead = are_numbers or any(stated_unit(heading, FRACTION_PER_UNIT) for heading in headings)
    buffer.writelines(line + "\n" for line in statements_of(spectra, names=names_mislead))
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(["wavelength_nm", *([f"no. {heading}" for heading in headings] if are_numbers else headings)])
    writer.writerows(
        [repr(wavelength), *values] for wavelength, *values in zip(wavelengths.tolist(), *cells, strict=True)
    )
    write_text(path, buffer.getvalue())


def _rows(path: Path, statements: Statements) -> list[Row]:
    """Rows that are not empty, split into cells; comments go to ``statements``."""
    numbered = list(enumerate(read_text(path).splitlines(), 1))
    require_no_other_format(path, numbered)
    for line_number, line in numbered:
        if line.lstrip().startswith("#"):
            statements.take(line_number, line)
    kept = [(n, line) for n, line in numbered if line.strip(" \t,;") and not line.lstrip().startswith("#")]
    if not kept:
        raise FileFormatError(f"{path}, line 1: no samples; expected a table of wavelengths and values")
    marked = _spreadsheet_mark(kept[0][1]) if len(kept) > 1 else None
    kept = kept if marked is None else kept[1:]
    delimiter = marked or _delimiter([line for _, line in kept])
    rows = [(line_number, _cells(line, delimiter)) for line_number, line in kept]
    if len(rows) > 1 and not is_number(rows[0][1][0]):
        rows[0] = (rows[0][0], _headings(kept[0][1], delimiter, used(rows[1][1])))
    above = rows[0][0] - 2  # of the line before the first row, from 0
    if is_number(rows[0][1][0]) and above >= 0 and numbered[above][1].lstrip().startswith("#"):
        comment = _headings(numbered[above][1].lstrip("# \t"), delimiter, used(rows[0][1]))
        if len(comment) == used(rows[0][1]) and names_wavelengths(comment[0]):
            rows.insert(0, (above + 1, comment))
    if delimiter == "," and len(rows[0][1]) > 2 and all(cell.isdecimal() for _, cells in rows for cell in cells):
        raise FileFormatError(
            f"{path}, line {rows[0][0]}: {', '.join(rows[0][1])[:40]!r} may be three numbers or more, or have "
            "decimal commas; separate cells by semicolons, or give each column a heading"
        )
    if delimiter in (";", "\t") and not any("." in cell and is_number(cell) for _, cells in rows for cell in cells):
        _require_no_thousands(path, rows)
        rows = rows[:1] + [(n, [_with_point(cell) for cell in cells]) for n, cells in rows[1:]]
        rows[0] = (rows[0][0], [_with_point(cell) for cell in rows[0][1]])
    return rows


def _with_plain_wavelengths(path: Path, rows: list[Row]) -> list[Row]:
    """The rows with numbers in place of wavelengths such as ``400 nm``, in the first column or in the first row."""
    for begin in (0, 1):  # with and without headings
        down = labeled_wavelengths([cells[0] for _, cells in rows[begin:]])
        # Under numbers in the first row, R400 and R410 are names of paints.
        if down and None not in down and not (begin and runs_across(path, rows[0], rows[1:])):
            plain = [(n, [number, *cells[1:]]) for number, (n, cells) in zip(down, rows[begin:], strict=True) if number]
            return rows[:begin] + plain
    line, (corner, *headings) = rows[0]
    headings = headings[: used(headings)]
    if None not in labeled_wavelengths([corner, *headings]):
        raise FileFormatError(
            f"{path}, line {line}: the wavelength {corner!r} heads the first column; expected a column of names before "
            "the wavelengths: insert one"
        )
    numbers = labeled_wavelengths(headings)
    known = [number for number in numbers if number is not None]
    if not known or not runs_across(path, (line, [corner, *known]), rows[1:]):
        return rows
    if None in numbers:
        other, at = headings[numbers.index(None)], numbers.index(None) + 2
        wavelength = headings[numbers.index(known[0])]
        raise FileFormatError(
            f"{path}, line {line}: {other!r} heads column {at} beside wavelengths such as {wavelength!r}; expected one "
            "column of names and then wavelengths alone: remove the other columns"
        )
    return [(line, [corner, *known]), *rows[1:]]


def _spreadsheet_mark(line: str) -> str | None:
    """The separator that a spreadsheet states in a first line such as ``sep=;``; None if the line is another."""
    stated = line.strip(" \r\n").strip('"')
    return stated[4] if len(stated) == 5 and stated.lower().startswith("sep=") else None


def _headings(line: str, delimiter: str, width: int) -> list[str]:
    """Cells of a line of headings; separated by blanks, ``Wavelength (nm)`` is one if that gives ``width`` of them."""
    cells = _cells(line, delimiter)
    if delimiter != " " or len(cells) == width:
        return cells
    merged: list[str] = []
    for cell in cells:
        if merged and cell.startswith(("(", "[")):
            merged[-1] += f" {cell}"
        else:
            merged.append(cell)
    return merged if len(merged) == width else cells


def _with_point(cell: str) -> str:
    """``0,5`` as ``0.5``; other text as it is."""
    return cell.replace(",", ".") if re.fullmatch(r"[-+]?\d*,\d+([eE][-+]?\d+)?", cell) else cell


def _delimiter(lines: Sequence[str]) -> str:
    """The separator of most rows; a comma beside semicolons or tabs is a decimal comma."""
    for candidate in (";", "\t", ","):
        if 2 * sum(candidate in line for line in lines) >= len(lines):
            return candidate
    return " "


def _cells(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))]


def _columns_from_columns(path: Path, header: Row, body: list[Row], wavelength_unit: str | None) -> list[Column]:
    """One column of the table is one spectrum."""
    width = max((used(cells) for _, cells in [header, *body]), default=0)
    if not body or width < 2:
        line = body[0][0] if body else header[0]
        raise FileFormatError(
            f"{path}, line {line}: found {width} column(s) and {len(body)} row(s) of numbers; expected wavelengths and "
            "at least one column of values, separated by comma, semicolon, tab or blanks"
        )
    headings = header[1][:width]
    _require_wavelengths_first(path, header[0], headings)
    for line, cells in body:
        if headings and used(cells) > len(headings):
            raise FileFormatError(
                f"{path}, line {line}: {counted(used(cells), 'cell')} under {counted(len(headings), 'heading')}; "
                f"expected a heading each; {_ABOVE}"
            )
    own = readable(path.stem)
    unnamed = [own] if width == 2 else [f"{own} {number}" for number in range(1, width)]
    names = headings[1:] + [""] * (width - len(headings)) if headings else unnamed
    columns = [named_column(name, own, wavelength_unit) for name in names]
    for line, cells in body:
        if len(cells) < width and not headings:
            raise FileFormatError(f"{path}, line {line}: {counted(len(cells), 'cell')}, expected {width}")
        wavelength = number(path, line, cells[0], f"a wavelength; {_ABOVE}" if line == body[0][0] else "a wavelength")
        for column, cell in zip(columns, cells[1:], strict=False):
            if cell:
                column.add(line, wavelength, number(path, line, cell, f"a value of {column.name!r}"))
    return columns


def _require_wavelengths_first(path: Path, line: int, headings: list[str]) -> None:
    """Raise FileFormatError if a column before that of the wavelengths counts the rows."""
    named = [heading.lower().startswith(AT_START) or heading.lower() in ALONE for heading in headings]
    if any(named) and not names_wavelengths(headings[0]):
        raise FileFormatError(
            f"{path}, line {line}: {headings[named.index(True)]!r} heads column {named.index(True) + 1}; expected the "
            "wavelengths in the first column: remove the columns before them"
        )


def _require_no_thousands(path: Path, rows: list[Row]) -> None:
    """Raise FileFormatError for a column with ``987`` and ``1,234``, which may be 1234."""
    for index in range(max(len(cells) for _, cells in rows)):
        column = [(line, cells[index]) for line, cells in rows if index < len(cells)]
        grouped = [(line, cell) for line, cell in column if "," in cell and is_number(cell.replace(",", ""))]
        whole = any(cell.isdecimal() and int(cell) for _, cell in column)
        if grouped and whole and all(_GROUPED.fullmatch(cell) for _, cell in grouped):
            line, cell = grouped[0]
            raise FileFormatError(
                f"{path}, line {line}: {cell!r} beside whole numbers may be {cell.replace(',', '')} or "
                f"{cell.replace(',', '.')}; write it without separators of thousands, or with a decimal point"
            )


def _columns_from_rows(path: Path, header: Row, body: list[Row], wavelength_unit: str | None) -> list[Column]:
    """One row of the table is one spectrum; the first row holds the wavelengths."""
    line_of_wavelengths, (corner, *across) = header
    across = across[: used(across)]
    wavelengths = [number(path, line_of_wavelengths, cell, "a wavelength") for cell in across]
    columns = []
    for line, (name, *cells) in body:
        if used(cells) > len(wavelengths):
            raise FileFormatError(
                f"{path}, line {line}: {counted(used(cells), 'value')} for {counted(len(wavelengths), 'wavelength')}"
            )
        column = named_column(name, readable(path.stem), wavelength_unit)
        column.value_unit = column.value_unit or stated_unit(corner, FRACTION_PER_UNIT)
        for wavelength, cell in zip(wavelengths, cells, strict=False):
            if cell:
                column.add(line, wavelength, number(path, line, cell, f"a value of {name!r}"))
        columns.append(column)
    return columns
