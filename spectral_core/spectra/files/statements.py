# SPDX-License-Identifier: GPL-3.0-or-later
"""Statements of a text file about its spectra, in comments: ``# kind: reflectance``, ``# value unit: percent``.

One statement applies to all columns, or one per column separated by commas. Comments with other words are ignored.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from io import StringIO
from pathlib import Path
from typing import Any

from spectral_core.errors import FileFormatError, UnknownNameError, counted
from spectral_core.spectra.files.columns import FRACTION_PER_UNIT, KINDS, NM_PER_UNIT, Column, kind_of, known_unit
from spectral_core.spectra.spectrum import Spectrum

_JCAMP = re.compile(r"##\s*(?:TITLE|JCAMP-?DX|XYDATA|XYPOINTS)\s*=", re.IGNORECASE)

WORDS = ("name", "kind", "source", "interpolation", "wavelength unit", "value unit")


def require_no_other_format(path: Path, numbered: Sequence[tuple[int, str]]) -> None:
    """Raise FileFormatError for the lines of a format that would be read as a table of something else."""
    for n, line in numbered:
        if line.strip() == "BEGIN_DATA_FORMAT":
            raise FileFormatError(
                f"{path}, line {n}: a measurement file of CGATS or Argyll; expected a table: keep its line of field "
                "names and its lines of data, with one column of names and the columns of wavelengths"
            )
        if _JCAMP.match(line):  # its statements look like comments: units, factors, and several samples in a line
            raise FileFormatError(
                f"{path}, line {n}: a file of JCAMP-DX ({line.strip()[:40]!r}); expected a table: export it as CSV, "
                "with a column of wavelengths and a column of values"
            )


class Statements:
    """Collects the statements of a file's comments, then writes them onto its columns."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._found: dict[str, tuple[int, list[str]]] = {}

    def take(self, line: int, comment: str) -> None:
        """Keep the comment if it is a statement."""
        word, colon, rest = comment.lstrip("# \t").partition(":")
        if colon and word.strip().lower() in WORDS:
            values = next(csv.reader(StringIO(rest.strip()), skipinitialspace=True), [])
            if values:
                self._found[word.strip().lower()] = (line, values)

    def apply(self, columns: Sequence[Column]) -> None:
        """Apply the file's statements to the columns. Raises FileFormatError for an unknown word or a wrong count."""
        for word, (line, stated) in self._found.items():
            # A name or source may contain commas. If its parts are not as many as the columns, it is one text for all.
            prose = word in ("name", "source") and len(stated) != len(columns)
            values = [", ".join(stated)] if prose else stated
            if len(values) not in (1, len(columns)):
                raise FileFormatError(
                    f"{self._path}, line {line}: {word!r} is stated for "
                    f"{counted(len(values), 'spectrum', 'spectra')}, the file holds {len(columns)}; expected one for "
                    "all or one each"
                )
            for index, column in enumerate(columns):
                value = values[index] if len(values) > 1 else values[0]
                setattr(column, word.replace(" ", "_"), self._checked(line, word, value))

    def _checked(self, line: int, word: str, value: str) -> Any:
        try:
            if word == "wavelength unit":
                return known_unit(value, NM_PER_UNIT)
            if word == "value unit":
                return known_unit(value, FRACTION_PER_UNIT)
            allowed = {"kind": list(KINDS), "interpolation": ["linear", "sampled"]}.get(word)
            if allowed is not None and value not in allowed:
                raise UnknownNameError.among(word, value, allowed)
        except UnknownNameError as error:
            raise FileFormatError(f"{self._path}, line {line}: {error}") from error
        return value


def statements_of(spectra: Sequence[Spectrum], *, names: bool) -> list[str]:
    """Comment lines that state kind, source, interpolation (where not linear) and, if asked, name and unit."""
    stated: dict[str, list[str]] = {
        "name": [spectrum.name for spectrum in spectra] if names else [],
        "value unit": ["fraction"] if names else [],
        "kind": [str(kind_of(spectrum)) for spectrum in spectra],
        "source": [spectrum.source for spectrum in spectra],
        "interpolation": [str(spectrum.grid.interpolation) for spectrum in spectra],
    }
    unsaid = {"source": "", "interpolation": "linear"}
    lines = []
    for word, values in stated.items():
        if values and set(values) != {unsaid.get(word)}:
            shown = values[:1] if len(set(values)) == 1 else values
            lines.append(f"# {word}: {_csv_line(shown)}")
    return lines


def _csv_line(values: Sequence[str]) -> str:
    """Values as one CSV line; a line break in one would end the comment, so white space is folded to one blank."""
    buffer = StringIO()
    csv.writer(buffer, lineterminator="").writerow([" ".join(value.split()) for value in values])
    return buffer.getvalue()
