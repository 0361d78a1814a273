# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra named on a command line: from the catalogue, or from a file.

A name of the catalogue means the catalogue, whatever files the folder has: ``./D65`` is the file.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from spectral_core.errors import InvalidInputError, UnknownNameError, first_of
from spectral_core.files.guarded import no_file

if TYPE_CHECKING:
    from spectral_core.spectra.files.columns import SpectrumKind
    from spectral_core.spectra.spectrum import Illuminant, Reflectance, Spectrum


def reflectance_named(word: str) -> Reflectance:
    """A reflectance of the catalogue, or FILE, or FILE@NAME. Raises InvalidInputError."""
    from spectral_core.spectra import catalogue
    from spectral_core.spectra.spectrum import Reflectance

    found = None if word in catalogue.reflectance_names() else _from_file(word, "reflectance")
    return catalogue.reflectance(word) if found is None else Reflectance(found.name, found.grid, found.values)


def illuminant_named(word: str) -> Illuminant:
    """An illuminant of the catalogue, or FILE, or FILE@NAME. Raises InvalidInputError."""
    from spectral_core.spectra import catalogue
    from spectral_core.spectra.spectrum import Illuminant

    found = None if catalogue.is_illuminant(word) else _from_file(word, "illuminant")
    return catalogue.illuminant(word) if found is None else Illuminant(found.name, found.grid, found.values)


def files_in(word: str) -> list[str]:
    """The names that may be a file in NAME, FILE, FILE@NAME or FILE:NAME."""
    return [file for file, _ in _splits(word)]


def _from_file(word: str, kind: SpectrumKind) -> Spectrum | None:
    """The one spectrum that FILE, FILE@NAME or FILE:NAME names; None if the word names no file."""
    from spectral_core.spectra.files import FORMATS, read_spectra

    split = _splits(word)
    file, wanted = next(((file, name) for file, name in split if Path(file).is_file()), ("", ""))
    if not file:
        endings = tuple(ending for each in FORMATS.values() for ending in each)
        missing = next((file for file, _ in split if file.lower().endswith(endings)), None)
        if missing is not None:
            raise InvalidInputError(no_file(missing))
        return None
    spectra = read_spectra(Path(file), kind=kind)
    found = [each for each in spectra if not wanted or each.name == wanted]
    if len(found) == 1:
        return found[0]
    if not found:
        raise UnknownNameError.among(f"spectrum of {file}", wanted, [each.name for each in spectra])
    if wanted:
        raise InvalidInputError(f"{file} holds {len(found)} spectra that are named {wanted!r}; rename them in the file")
    names = first_of((repr(each.name) for each in found), len(found))
    raise InvalidInputError(f"{file} holds {len(found)} spectra ({names}), expected one; name one as {file}@NAME")


def _splits(word: str) -> list[tuple[str, str]]:
    """All divisions of a word into a file and a name; both may contain the marks between them."""
    places = [index for mark in "@:" for index, letter in enumerate(word) if letter == mark]
    return [(word, ""), *((word[:index], word[index + 1 :]) for index in places)]
