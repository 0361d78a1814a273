# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra in files: CSV tables, IES TM-27-14 (``.spdx``) and Mitsuba's ``.spd``.

>>> lamps = read_spectra("lamps.csv", kind="illuminant")  # doctest: +SKIP
>>> write_spectra("paint.spdx", [paint])  # doctest: +SKIP

Statements of a file (type, units) are used; the caller states the others. Nothing is inferred from the size of numbers:
if they contradict the stated unit, the error names the unit that would fit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from spectral_core.checks import path_of, require_kind
from spectral_core.errors import FileFormatError, InvalidInputError, UnknownNameError, first_of
from spectral_core.files.guarded import read_text, reading
from spectral_core.spectra.files import csv_table, mitsuba_spd, spdx
from spectral_core.spectra.files.columns import ReadOptions, SpectrumKind, is_number, kind_of, require_readable
from spectral_core.spectra.files.spdx import SpdxDocument, read_spdx, write_spdx
from spectral_core.spectra.spectrum import Spectrum

__all__ = [
    "FORMATS",
    "SpdxDocument",
    "SpectrumKind",
    "detect_format",
    "kind_of",
    "read_spdx",
    "read_spectra",
    "read_spectrum",
    "write_spdx",
    "write_spectra",
]

FORMATS = {"csv": (".csv", ".tsv", ".txt"), "spdx": (".spdx", ".xml"), "spd": (".spd",)}
"""Format names, each with its file name endings."""


def read_spectra(
    path: str | Path,
    *,
    kind: SpectrumKind | None = None,
    wavelength_unit: str | None = None,
    value_unit: str | None = None,
    file_format: str | None = None,
) -> list[Spectrum]:
    """All spectra of a file, each on its own wavelengths, in the order of the file.

    ``kind``: ``"illuminant"``, ``"reflectance"`` or ``"spectrum"``; None takes what the file states, and a plain
    ``Spectrum`` where it states nothing. A lamp that is wanted as a reflectance, or the reverse, is an error.
    ``wavelength_unit``: ``"nm"``, ``"um"``, ``"angstrom"`` or ``"m"``; ``value_unit``: ``"fraction"`` or
    ``"percent"``; None uses the file's statement, else nm and fraction.
    Raises FileFormatError (file, line, what was expected), UnknownNameError.
    """
    file = path_of(path)
    options = ReadOptions(kind, wavelength_unit, value_unit)
    name = None if file_format is None else _known_format(file_format)
    with reading(file, "spectra"):
        name = name or detect_format(file)
        if name == "spdx":
            return [spdx.read_spdx(file, options).spectrum]
        reader = mitsuba_spd.read if name == "spd" else csv_table.read
        return reader(file, options)


def read_spectrum(path: str | Path, *, kind: SpectrumKind | None = None) -> Spectrum:
    """The one spectrum of a file; read_spectra where there may be several. Raises FileFormatError."""
    spectra = read_spectra(path, kind=kind)
    if len(spectra) != 1:
        names = first_of((repr(spectrum.name) for spectrum in spectra), len(spectra))
        raise FileFormatError(f"{path} holds {len(spectra)} spectra ({names}), expected one; use read_spectra")
    return spectra[0]


def write_spectra(path: str | Path, spectra: Sequence[Spectrum], *, file_format: str | None = None) -> None:
    """Write spectra so that read_spectra returns them with the same values, kinds, wavelengths and names.

    The format follows from the file name's ending or from ``file_format``. CSV holds any number of spectra on any
    grids; SPDX and .spd hold exactly one. Raises InvalidInputError.
    """
    file = path_of(path)
    name = format_of_ending(file) if file_format is None else _known_format(file_format)
    if isinstance(spectra, Spectrum):
        raise InvalidInputError(f"one spectrum, {spectra.name!r}, to write to {file}; expected a list of spectra")
    if not isinstance(spectra, Sequence):
        raise InvalidInputError(f"the spectra are {str(spectra)[:40]!r}; expected a list of spectra")
    if not spectra:
        raise InvalidInputError(f"no spectra to write to {file}; give at least one")
    for spectrum in spectra:
        require_kind("one of the spectra", spectrum, Spectrum)
        require_readable(spectrum)
    if name == "csv":
        csv_table.write(file, spectra)
        return
    if len(spectra) != 1:
        raise InvalidInputError(
            f"a {name} file holds one spectrum, got {len(spectra)} for {file}; write one file each, or a .csv"
        )
    writer: Callable[[Path, Spectrum], None] = mitsuba_spd.write if name == "spd" else spdx.write_spdx
    writer(file, spectra[0])


def detect_format(path: str | Path) -> str:
    """``"csv"``, ``"spdx"`` or ``"spd"``: from the contents of the file, and from its extension if that is ambiguous.

    Raises FileFormatError for a file that is absent, empty or not text.
    """
    file = path_of(path)
    text = read_text(file)
    if text.lstrip().startswith("<"):
        return "spdx"
    if file.suffix.lower() in FORMATS["spdx"]:
        raise FileFormatError(
            f"{file}, line 1: no XML; an SPDX (IES TM-27-14) file starts with '<?xml' or '<IESTM2714'"
        )
    if file.suffix.lower() == ".spd":
        return "spd"
    if file.suffix.lower() in FORMATS["csv"]:
        return "csv"
    lines = [line.split() for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    pairs = bool(lines) and all(len(line) == 2 and all(map(is_number, line)) for line in lines)
    return "spd" if pairs else "csv"


def _known_format(name: str) -> str:
    if name not in FORMATS:
        raise UnknownNameError.among("spectrum file format", name, FORMATS)
    return name


def format_of_ending(path: str | Path) -> str:
    """``"csv"``, ``"spdx"`` or ``"spd"``: the format that ``write_spectra`` writes there. Raises InvalidInputError."""
    file = path_of(path)
    for name, suffixes in FORMATS.items():
        if file.suffix.lower() in suffixes:
            return name
    endings = ", ".join(ending for suffixes in FORMATS.values() for ending in suffixes)
    raise InvalidInputError(f"cannot tell the format of {file.name!r} from its ending; name it with one of {endings}")
