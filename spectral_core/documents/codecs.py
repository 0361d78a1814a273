# SPDX-License-Identifier: GPL-3.0-or-later
"""Encodings that all documents share: wavelength grids, spectra and colors, to plain tables and back."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import frozen_array, require_range
from spectral_core.errors import FileFormatError, InvalidInputError, UnknownNameError
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import linear_from_display_rgb
from spectral_core.spectra.files import SpectrumKind, read_spectra
from spectral_core.spectra.observer import normalized, xyz_from_spectrum
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, Spectrum
from spectral_core.spectra.start_lights import LEAST_PERIOD_NM, sine_light

SOURCES = ("catalogue", "file", "values", "sine_nm")
MOST_FILES, MOST_FILE_BYTES = 1000, 64 << 20
"""Most spectrum files of one document, and most bytes of all of them together."""


class SpectrumFiles:
    """The spectrum files of one document: each is read once, within a limit for all of them together."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._read: dict[tuple[Path, SpectrumKind], list[Spectrum]] = {}
        self._bytes = 0

    def spectra(self, name: str, kind: SpectrumKind) -> tuple[Path, list[Spectrum]]:
        """The path of the file ``name``, and its spectra. Raises FileFormatError."""
        path = self._folder / name
        if (path, kind) not in self._read:
            found = read_spectra(path, kind=kind)
            self._bytes += path.stat().st_size
            if len(self._read) >= MOST_FILES or self._bytes > MOST_FILE_BYTES:
                raise FileFormatError(
                    f"{path}: the document names more than {MOST_FILES} spectrum files, or files of more than "
                    f"{MOST_FILE_BYTES >> 20} MiB together; keep the spectra that it uses in one smaller file"
                )
            self._read[path, kind] = found
        return path, self._read[path, kind]


def decoded_color(given: list[float] | str) -> NDArray[np.float64]:
    """Linear sRGB (3,) of ``[r, g, b]``, or of a display color ``#rrggbb``. Raises InvalidInputError."""
    if not isinstance(given, str):
        return frozen_array("color", given, (3,))
    if not re.fullmatch("#[0-9a-fA-F]{6}", given):
        raise InvalidInputError(f"color {given[:40]!r}; expected #rrggbb, or linear [r, g, b]")
    return linear_from_display_rgb([int(given[at : at + 2], 16) / 255 for at in (1, 3, 5)])


def encoded_grid(grid: SpectralGrid) -> dict[str, Any]:
    """Start, stop and step if they give the same wavelengths, else all of them."""
    knots = grid.wavelengths_nm
    step = float(knots[1] - knots[0])
    table: dict[str, Any] = {"start_nm": float(knots[0]), "stop_nm": float(knots[-1]), "step_nm": step}
    more = {} if grid.interpolation == "linear" else {"interpolation": grid.interpolation}
    try:  # by the reader itself, whose limits are narrower than those of a grid
        uniform = decoded_grid(table | more).same_as(grid)
    except InvalidInputError:
        uniform = False
    return (table if uniform else {"wavelengths_nm": knots.tolist()}) | more


def decoded_grid(table: dict[str, Any]) -> SpectralGrid:
    """Inverse of encoded_grid. Raises InvalidInputError."""
    interpolation = table.get("interpolation", "linear")
    steps = [word for word in ("start_nm", "stop_nm", "step_nm") if word in table]
    if "wavelengths_nm" in table and not steps:
        return SpectralGrid(frozen_array("wavelengths_nm", table["wavelengths_nm"], (None,)), interpolation)
    if len(steps) != 3 or "wavelengths_nm" in table:
        raise InvalidInputError(
            f"grid gives {', '.join(word for word in table if word != 'interpolation') or 'nothing'}; expected "
            "start_nm, stop_nm and step_nm, or wavelengths_nm"
        )
    start, stop, step = (require_range(word, table[word], 1e-3, 1e6, " nm") for word in steps)
    return SpectralGrid.uniform(start, stop, step, interpolation=interpolation)


def encoded_spectrum(spectrum: Spectrum, grid: SpectralGrid) -> dict[str, Any]:
    """The catalogue's name if it gives exactly the same numbers, else samples."""
    named = _catalogue_entry(spectrum) or _sine_entry(spectrum, grid)
    if named is not None:
        return named
    table: dict[str, Any] = {"name": spectrum.name}
    if spectrum.source:
        table["source"] = spectrum.source
    if not spectrum.grid.same_as(grid):
        table["wavelengths_nm"] = spectrum.grid.wavelengths_nm.tolist()
        if spectrum.grid.interpolation != "linear":
            table["interpolation"] = spectrum.grid.interpolation
    table["values"] = spectrum.values.tolist()
    return table


def decoded_spectrum(
    table: dict[str, Any] | str, kind: SpectrumKind, grid: SpectralGrid, files: SpectrumFiles
) -> Illuminant | Reflectance | Spectrum:
    """The spectrum of a table or a catalogue name.

    Parameters
    ----------
    table : a catalogue name, or a table that gives exactly one of ``SOURCES``.
    kind : ``illuminant`` or ``reflectance``, if the source does not state it.
    grid : wavelengths of samples that bring none.
    files : where the spectrum files are that the document names.

    Raises
    ------
    InvalidInputError
        Also as FileFormatError or UnknownNameError.
    """
    if isinstance(table, str):
        table = {"catalogue": table}
    given = [word for word in SOURCES if word in table]
    if len(given) != 1:
        raise InvalidInputError(f"a spectrum gives {' and '.join(given) or 'nothing'}; expected one of {SOURCES}")
    if given[0] != "values" and ("wavelengths_nm" in table or "interpolation" in table):
        raise InvalidInputError(f"a spectrum from the {given[0]} has wavelengths of its own; leave wavelengths_nm out")
    if given[0] == "catalogue":
        spectrum = _from_catalogue(table, kind)
    elif given[0] == "sine_nm":
        return sine_light(float(table["sine_nm"]), grid, luminance=float(table.get("luminance", 1.0)))
    elif given[0] == "file":
        spectrum = _from_file(table, kind, files)
    else:
        spectrum = _from_samples(table, kind, grid)
    if "luminance" not in table:
        return spectrum
    if not isinstance(spectrum, Illuminant):
        raise InvalidInputError(f"spectrum {spectrum.name!r} is no light, so it has no luminance; remove luminance")
    return normalized(spectrum, luminance=float(table["luminance"]))


def _from_catalogue(table: dict[str, Any], kind: SpectrumKind) -> Spectrum:
    name = table["catalogue"]
    found: Spectrum = catalogue.reflectance(name) if kind == "reflectance" else catalogue.illuminant(name)
    if "name" in table:
        raise InvalidInputError(f"the spectrum {name!r} of the catalogue keeps its name; name the light or reflectance")
    return found


def _from_file(table: dict[str, Any], kind: SpectrumKind, files: SpectrumFiles) -> Spectrum:
    path, spectra = files.spectra(table["file"], kind)
    wanted = table.get("name")
    if wanted is None:
        if len(spectra) > 1:
            raise InvalidInputError(f"{path} holds {len(spectra)} spectra; say which by name")
        return spectra[0]
    found = [spectrum for spectrum in spectra if spectrum.name == wanted]
    if len(found) > 1:
        raise InvalidInputError(f"{path} holds {len(found)} spectra named {wanted!r}; give each a name of its own")
    if found:
        return found[0]
    raise UnknownNameError.among(f"spectrum of {path}", wanted, [spectrum.name for spectrum in spectra])


def _from_samples(table: dict[str, Any], kind: SpectrumKind, grid: SpectralGrid) -> Spectrum:
    own = grid
    if "wavelengths_nm" in table:
        own = SpectralGrid(
            frozen_array("wavelengths_nm", table["wavelengths_nm"], (None,)), table.get("interpolation", "linear")
        )
    elif "interpolation" in table:
        own = SpectralGrid(grid.wavelengths_nm, table["interpolation"])
    made = {"illuminant": Illuminant, "reflectance": Reflectance, "spectrum": Spectrum}[kind]
    values = frozen_array("values", table["values"], (None,))
    return made(table.get("name", "unnamed"), own, values, source=table.get("source", ""))


def _catalogue_entry(spectrum: Spectrum) -> dict[str, Any] | None:
    """``{catalogue, luminance}`` if it decodes to the same numbers, bit for bit."""
    known = {"illuminant": catalogue.illuminant_names, "reflectance": catalogue.reflectance_names}
    kind = type(spectrum).__name__.lower()
    if kind not in known or spectrum.name not in known[kind]():
        return None
    measured: Spectrum
    measured = catalogue.illuminant(spectrum.name) if kind == "illuminant" else catalogue.reflectance(spectrum.name)
    if not measured.grid.same_as(spectrum.grid):
        return None
    if np.array_equal(measured.values, spectrum.values):
        return {"catalogue": spectrum.name}
    if isinstance(measured, Illuminant):
        luminance = _round_luminance(spectrum)
        if luminance > 0 and np.array_equal(normalized(measured, luminance=luminance).values, spectrum.values):
            return {"catalogue": spectrum.name, "luminance": luminance}
    return None


def _sine_entry(spectrum: Spectrum, grid: SpectralGrid) -> dict[str, Any] | None:
    """``{sine_nm, luminance}`` for the thesis' start lights, if it decodes to the same numbers."""
    match = re.fullmatch(r"sine ([0-9]+(?:\.[0-9]+)?) nm", spectrum.name)
    if match is None or not isinstance(spectrum, Illuminant) or not spectrum.grid.same_as(grid):
        return None
    luminance = _round_luminance(spectrum)
    if (
        luminance <= 0
        or float(match[1]) < LEAST_PERIOD_NM
        or not np.array_equal(sine_light(float(match[1]), grid, luminance=luminance).values, spectrum.values)
    ):
        return None
    return {"sine_nm": float(match[1]), "luminance": luminance}


def _round_luminance(light: Spectrum) -> float:
    """Y of a light, rounded to a few digits."""
    return round(float((xyz_from_spectrum(light.grid) @ light.values)[1]), 12)
