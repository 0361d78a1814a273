# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra named on a command line: from the catalogue, or from a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from spectral_core.errors import InvalidInputError

if TYPE_CHECKING:
    from spectral_core.spectra.files.columns import SpectrumKind
    from spectral_core.spectra.spectrum import Illuminant, Reflectance, Spectrum


def reflectance_named(word: str) -> Reflectance:
    """A reflectance of the catalogue, or FILE, or FILE@NAME. Raises InvalidInputError."""
    from spectral_core.spectra import catalogue
    from spectral_core.spectra.spectrum import Reflectance

    found = _from_file(word, "reflectance")
    return catalogue.reflectance(word) if found is None else Reflectance(found.name, found.grid, found.values)


def illuminant_named(word: str) -> Illuminant:
    """An illuminant of the catalogue, or FILE, or FILE@NAME. Raises InvalidInputError."""
    from spectral_core.spectra import catalogue
    from spectral_core.spectra.spectrum import Illuminant

    found = _from_file(word, "illuminant")
    return catalogue.illuminant(word) if found is None else Illuminant(found.name, found.grid, found.values)


def _from_file(word: str, kind: SpectrumKind) -> Spectrum | None:
    """The one spectrum that FILE, FILE@NAME or FILE:NAME names; None if there is no such file."""
    from spectral_core.spectra.files import read_spectra

    for mark in ("@", ":"):
        file, _, wanted = word.partition(mark)
        if Path(file).is_file():
            break
    else:
        return None
    found = [each for each in read_spectra(Path(file), kind=kind) if not wanted or each.name == wanted]
    if len(found) != 1:
        raise InvalidInputError(f"{file} holds {len(found)} spectra that fit {word!r}; name one as FILE@NAME")
    return found[0]
