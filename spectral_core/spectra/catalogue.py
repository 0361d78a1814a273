# SPDX-License-Identifier: GPL-3.0-or-later
"""Named spectra that ship with the library: CIE observers, illuminants, lamps and color chart patches.

The tables under ``data/`` are written by ``scripts/make_datasets.py`` from colour-science (BSD-3-Clause), which
holds them from the CIE and the makers; ``data/SOURCES.md`` names each. More come from files, or from
colour-science itself where it is installed.
"""

from __future__ import annotations

from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_kind, require_range, require_text
from spectral_core.errors import UnknownNameError
from spectral_core.spectra.spectrum import EXCITING_NM, LAST_NM, Illuminant, Reflectance, SpectralGrid

ALIASES = {"sodium": "HP1", "high-pressure sodium": "HP1", "daylight": "D65", "tungsten": "A", "equal energy": "E"}
"""Common names of lamps, each with the measured lamp that it means."""
_BLACK_BODY = "blackbody "


@cache
def _table(file_name: str) -> tuple[list[str], NDArray[np.float64]]:
    """Column names and values (rows, columns) of a CSV under data/; empty cells are NaN."""
    text = resources.files("spectral_core.spectra").joinpath("data", file_name).read_text("utf-8")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    names = lines[0].split(",")
    # genfromtxt of NumPy takes more than twice as long, on Blender's main thread
    values = np.array([[float(cell) if cell else np.nan for cell in line.split(",")] for line in lines[1:]])
    return names, values


def _column(file_name: str, name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wavelengths (nm) and values of one spectrum, over the range where it was measured."""
    names, values = _table(file_name)
    column = values[:, names.index(name)]
    known = np.isfinite(column)
    return values[known, 0], column[known]


def color_matching_functions(name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wavelengths (n,) in nm and color matching functions (3, n) of a CIE observer, at 1 nm."""
    names, values = _table("observers.csv")
    if f"{name} x" not in names:
        known = [heading.removesuffix(" x") for heading in names if heading.endswith(" x")]
        raise UnknownNameError.among("observer", str(name), known)
    columns = [names.index(f"{name} {axis}") for axis in "xyz"]
    known = np.isfinite(values[:, columns[0]])
    return values[known, 0], values[known][:, columns].T.copy()


def illuminant_names() -> list[str]:
    """Names that illuminant() knows, CIE illuminants first."""
    return _table("illuminants.csv")[0][1:]


def is_illuminant(name: str) -> bool:
    """True for a name of an illuminant, and for a black body of any number, which ``illuminant`` may refuse."""
    name = require_text("the name of an illuminant", name).strip()
    known = ALIASES.get(name.lower(), name)
    if not f"{known} ".lower().startswith(_BLACK_BODY):
        return known in illuminant_names()
    try:
        _kelvin(name, known[len(_BLACK_BODY) :])
    except UnknownNameError:  # a file such as "blackbody lamp.csv"
        return False
    return True


def illuminant(name: str) -> Illuminant:
    """A measured light by name (``"D65"``, ``"HP1"``, ``"FL11"``, …) on its own grid, in relative power per nm.

    ``"blackbody 3200"`` gives Planck's law at that temperature in kelvin. Spaces around a name, as of a pasted one, do
    not count. Raises UnknownNameError, and InvalidInputError for a temperature outside of 500 to 50000 K, or for no
    text.
    """
    return _illuminant(require_text("name of an illuminant", name).strip())


@cache
def _illuminant(name: str) -> Illuminant:
    known = ALIASES.get(name.lower(), name)
    if f"{known} ".lower().startswith(_BLACK_BODY):
        return blackbody(_kelvin(name, known[len(_BLACK_BODY) :]))
    if known not in illuminant_names():
        raise UnknownNameError.among("illuminant", name, [*illuminant_names(), *ALIASES, "blackbody 3200"])
    wavelengths, values = _column("illuminants.csv", known)
    return Illuminant(known, SpectralGrid(wavelengths), values, source="CIE / maker's data, see data/SOURCES.md")


def _kelvin(name: str, text: str) -> float:
    try:
        return float(text.strip().rstrip("Kk"))
    except ValueError:
        raise UnknownNameError(
            f"{name!r} names no temperature; expected one in kelvin, such as 'blackbody 3200'"
        ) from None


def reflectance_names() -> list[str]:
    """Names that reflectance() knows: the 24 patches of the color checker."""
    return _table("reflectances.csv")[0][1:]


def reflectance(name: str) -> Reflectance:
    """A measured surface by name (``"dark skin"``, …) on its own grid; spaces around it do not count.

    Raises UnknownNameError, and InvalidInputError for no text.
    """
    return _reflectance(require_text("name of a reflectance", name).strip())


@cache
def _reflectance(name: str) -> Reflectance:
    if name not in reflectance_names():
        raise UnknownNameError.among("reflectance", name, reflectance_names())
    wavelengths, values = _column("reflectances.csv", name)
    return Reflectance(name, SpectralGrid(wavelengths), values, source="color checker, N. Ohta 1997")


PLANCK = "Planck's law"
"""Source of the spectra of black bodies, which are so smooth that three channels represent them well as lights."""


def blackbody(temperature_k: float, grid: SpectralGrid | None = None) -> Illuminant:
    """Planck's law, relative to its value at 560 nm, at ``temperature_k`` from 500 to 50,000 kelvin.

    ``grid``: None for 300 to 830 nm in steps of 5 nm, so that its ultraviolet excites dyes as that of CIE's A does.
    """
    kelvin = require_range("temperature", temperature_k, 500, 50_000, " K")
    grid = SpectralGrid(np.arange(EXCITING_NM, LAST_NM + 1, 5.0)) if grid is None else grid
    require_kind("the grid", grid, SpectralGrid, "such as SpectralGrid([400, 550, 700])")
    second_radiation_constant_nm_k = 1.438776877e7

    def relative(wavelengths_nm: NDArray[np.float64]) -> NDArray[np.float64]:
        return wavelengths_nm**-5 / np.expm1(second_radiation_constant_nm_k / (wavelengths_nm * kelvin))

    values = relative(grid.wavelengths_nm) / relative(np.array([560.0]))
    return Illuminant(f"blackbody {kelvin:g}", grid, values, source=PLANCK)


def natural_reflectance_components() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wavelengths (n,) in nm, and spectra (k, n) with the second moments of measured surfaces: Σ kᵀk = mean of SᵀS.

    Statistics of the 99 materials of CIE 224:2017, for interpolations and priors; they are no surfaces themselves.
    """
    values = _table("natural_components.csv")[1]
    return values[:, 0], values[:, 1:].T.copy()
