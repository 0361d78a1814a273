# SPDX-License-Identifier: GPL-3.0-or-later
"""Mitsuba's ``.spd``: one ``wavelength value`` pair per line, in nm, separated by white space; ``#`` starts a comment.

The format has no fields for names and kinds; they are written as comments (``# kind: illuminant``) that Mitsuba skips.
"""

from __future__ import annotations

from pathlib import Path

from spectral_core.errors import FileFormatError, counted
from spectral_core.files.guarded import read_text
from spectral_core.files.whole import write_text
from spectral_core.spectra.files.columns import Column, ReadOptions, built, number, readable
from spectral_core.spectra.files.statements import Statements, require_no_other_format, statements_of
from spectral_core.spectra.spectrum import Spectrum


def read(path: Path, options: ReadOptions) -> list[Spectrum]:
    """The spectrum of the file, as a list of one. Raises FileFormatError."""
    column, statements = Column(readable(path.stem)), Statements(path)
    numbered = list(enumerate(read_text(path).splitlines(), 1))
    require_no_other_format(path, numbered)
    for line_number, line in numbered:
        if line.lstrip().startswith("#"):
            statements.take(line_number, line)
            continue
        cells = line.replace(",", " ").split()
        if not cells:
            continue
        if len(cells) != 2:
            raise FileFormatError(
                f"{path}, line {line_number}: {counted(len(cells), 'value')} ({line.strip()[:40]!r}), expected a "
                "wavelength (nm) and a value"
            )
        wavelength, value = (number(path, line_number, cell, "a wavelength and a value") for cell in cells)
        column.add(line_number, wavelength, value)
    if not column.lines:
        raise FileFormatError(f"{path}, line 1: no samples; expected lines of a wavelength (nm) and a value")
    statements.apply([column])
    return [built(path, column, options)]


def write(path: Path, spectrum: Spectrum) -> None:
    """Write one spectrum; numbers are the shortest that read back exactly."""
    samples = zip(spectrum.grid.wavelengths_nm.tolist(), spectrum.values.tolist(), strict=True)
    lines = [*statements_of([spectrum], names=True), *(f"{wavelength!r} {value!r}" for wavelength, value in samples)]
    write_text(path, "\n".join(lines) + "\n")
