# SPDX-License-Identifier: GPL-3.0-or-later
"""Sources of spectra in a .blend, without bpy: the shipped catalogue and files on disk."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.files.guarded import is_file, no_file
from spectral_core.spectra import catalogue
from spectral_core.spectra.spectrum import Illuminant, Reflectance, Spectrum

KINDS: dict[str, type[Spectrum]] = {"illuminant": Illuminant, "reflectance": Reflectance}
READ_AS: dict[str, Literal["illuminant", "reflectance"]] = {"illuminant": "illuminant", "reflectance": "reflectance"}
BLACKBODIES = ("blackbody 1900", "blackbody 2700", "blackbody 3200", "blackbody 4000", "blackbody 5600")
"""Candle, household bulb, studio tungsten, cool white and flash, as examples; any temperature can be entered."""


def names(kind: str) -> list[str]:
    """Names for ``"illuminant"`` or ``"reflectance"``, the most used ones first."""
    if kind == "reflectance":
        return catalogue.reflectance_names()
    return [*catalogue.ALIASES, *catalogue.illuminant_names(), *BLACKBODIES]


def named(kind: str, name: str) -> Spectrum:
    """The spectrum of that name. Raises UnknownNameError."""
    if not name.strip():
        raise InvalidInputError(f"no {kind} is chosen; pick one from the list, for example {names(kind)[0]!r}")
    return catalogue.reflectance(name) if kind == "reflectance" else catalogue.illuminant(name)


def from_file(kind: str, path: str, entry: str) -> tuple[Spectrum, list[str]]:
    """The spectrum ``entry`` of a file (the only one if ``entry`` is empty), and the names of all in it."""
    from spectral_core.spectra.files import read_spectra

    if not path.strip():
        raise InvalidInputError("no file is chosen; pick a .csv, .spdx or .spd file with a measured spectrum")
    if not is_file(path):
        raise InvalidInputError(no_file(path, "choose it again, or pack the file"))
    spectra = read_spectra(path, kind=READ_AS[kind])
    known = [spectrum.name for spectrum in spectra]
    if entry and entry not in known:
        raise UnknownNameError.among(f"spectrum in {Path(path).name}", entry, known)
    if not entry and len(spectra) > 1:
        raise InvalidInputError(f"{Path(path).name} holds {len(spectra)} spectra; choose one: {', '.join(known[:6])}")
    return spectra[known.index(entry) if entry else 0], known
