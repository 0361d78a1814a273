# SPDX-License-Identifier: GPL-3.0-or-later
"""Code shared by all spectrum formats: from text with line numbers to one checked spectrum per column."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_kind
from spectral_core.errors import FileFormatError, InvalidInputError, UnknownNameError, counted
from spectral_core.spectra.spectrum import Illuminant, Interpolation, Reflectance, SpectralGrid, Spectrum

SpectrumKind = Literal["illuminant", "reflectance", "spectrum"]
KINDS: dict[str, type[Spectrum]] = {"illuminant": Illuminant, "reflectance": Reflectance, "spectrum": Spectrum}

NM_PER_UNIT = {"nm": 1.0, "um": 1e3, "angstrom": 0.1, "m": 1e9}
FRACTION_PER_UNIT = {"fraction": 1.0, "percent": 0.01}
UNIT_SPELLINGS = {
    "nanometers": "nm", "nanometres": "nm", "nanometer": "nm", "nanometre": "nm",
    "µm": "um", "μm": "um", "micron": "um", "microns": "um", "micrometers": "um", "micrometres": "um",
    "å": "angstrom", "angstroms": "angstrom",
    "%": "percent",
}  # fmt: skip

PLAUSIBLE_NM = (10.0, 1e6)
"""Wavelengths outside of this range are a wrong unit: from extreme ultraviolet to a millimeter."""


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """The caller's statements about a file; None uses the file's."""

    kind: SpectrumKind | None = None
    wavelength_unit: str | None = None
    value_unit: str | None = None

    def __post_init__(self) -> None:
        if self.kind is not None and (not isinstance(self.kind, str) or self.kind not in KINDS):
            raise UnknownNameError.among("kind of spectrum", str(self.kind), get_args(SpectrumKind))
        for name, known in (("wavelength_unit", NM_PER_UNIT), ("value_unit", FRACTION_PER_UNIT)):
            given = getattr(self, name)
            if given is not None:
                object.__setattr__(self, name, known_unit(given, known))


@dataclass(slots=True)
class Column:
    """One spectrum as read: numbers with their line numbers, and the file's statements about them."""

    name: str
    lines: list[int] = field(default_factory=list)
    wavelengths: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    kind: SpectrumKind | None = None
    source: str = ""
    wavelength_unit: str | None = None
    value_unit: str | None = None
    interpolation: Interpolation = "linear"

    def add(self, line: int, wavelength: float, value: float) -> None:
        """Append one sample."""
        self.lines.append(line)
        self.wavelengths.append(wavelength)
        self.values.append(value)


def kind_of(spectrum: Spectrum) -> SpectrumKind:
    """``"illuminant"``, ``"reflectance"``, or ``"spectrum"`` for any other spectrum."""
    require_kind("the spectrum", spectrum, Spectrum)
    if isinstance(spectrum, Illuminant):
        return "illuminant"
    return "reflectance" if isinstance(spectrum, Reflectance) else "spectrum"


def known_unit(given: str, known: dict[str, float]) -> str:
    """The unit's own name from any of its spellings. Raises UnknownNameError."""
    name = str(given).strip().lower()
    name = UNIT_SPELLINGS.get(name, name)
    if name not in known:
        raise UnknownNameError.among("unit", str(given), known)
    return name


def is_number(text: str) -> bool:
    """True if ``text`` reads as a number, NaN and Inf included."""
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text  # Python reads 1_0 as 10


def number(path: Path, line: int, text: str, what: str) -> float:
    """``text`` as a finite float. Raises FileFormatError."""
    if not is_number(text):
        raise FileFormatError(f"{path}, line {line}: {text!r} is not a number; expected {what}")
    value = float(text)
    if not math.isfinite(value):
        raise FileFormatError(f"{path}, line {line}: {text!r} is not finite; expected {what}, or leave the sample out")
    return value


def require_readable(spectrum: Spectrum) -> None:
    """Raise InvalidInputError for wavelengths that would be refused when they are read back."""
    low, high = PLAUSIBLE_NM
    knots = spectrum.grid.wavelengths_nm
    if knots[0] < low or knots[-1] > high:
        raise InvalidInputError(
            f"spectrum {spectrum.name!r} has wavelengths from {knots[0]:g} to {knots[-1]:g} nm; a file holds {low:g} "
            f"to {high:g} nm. Leave out the others, or convert them to nm"
        )


def built(path: Path, column: Column, options: ReadOptions) -> Spectrum:
    """The checked spectrum of one column, in nm and fractions. Raises FileFormatError naming the line."""
    kind = options.kind or column.kind or "spectrum"
    _require_kind(path, column, kind)
    wavelength_unit = options.wavelength_unit or column.wavelength_unit or "nm"
    value_unit = options.value_unit or column.value_unit or "fraction"
    if len(column.wavelengths) < 2:
        line = column.lines[-1] if column.lines else 1
        samples = counted(len(column.wavelengths), "sample")
        raise FileFormatError(f"{path}, line {line}: spectrum {column.name!r} has {samples}, expected at least 2")
    wavelengths = np.array(column.wavelengths) * NM_PER_UNIT[wavelength_unit]
    values = np.array(column.values) * FRACTION_PER_UNIT[value_unit]
    lines = list(column.lines)
    if wavelengths[0] > wavelengths[-1]:  # some spectrometers write from red to blue, so the order is reversed
        wavelengths, values, lines = wavelengths[::-1], values[::-1], lines[::-1]
    _require_wavelengths(path, lines, wavelengths, wavelength_unit)
    _require_values(path, column.name, lines, values, kind)
    try:
        grid = SpectralGrid(wavelengths, column.interpolation)
        return KINDS[kind](column.name, grid, values, source=column.source or readable(path.name))
    except InvalidInputError as error:
        raise FileFormatError(f"{path}, lines {min(lines)} to {max(lines)}: {error}") from error


def readable(name: str) -> str:
    """The name of a file as any text can state it: bytes that are not UTF-8 become a replacement character."""
    return os.fsencode(name).decode("utf-8", "replace")


def _require_kind(path: Path, column: Column, kind: SpectrumKind) -> None:
    """Check that the spectrum is what the caller wants: a lamp is no paint. ``"spectrum"`` accepts both."""
    if "spectrum" in (kind, column.kind or "spectrum") or column.kind == kind:
        return
    raise FileFormatError(
        f"{path} states that {column.name!r} is of the kind {column.kind}; expected {kind}: choose a file of "
        f"{kind}s, or correct the statement in the file"
    )


def _require_wavelengths(path: Path, lines: list[int], wavelengths: NDArray[np.float64], unit: str) -> None:
    """Check that wavelengths ascend and are plausible for their unit."""
    steps = np.diff(wavelengths)
    if np.any(steps <= 0):
        at = int(np.argmax(steps <= 0)) + 1
        what = "repeats" if steps[at - 1] == 0 else "breaks the order of"
        raise FileFormatError(
            f"{path}, line {lines[at]}: wavelength {wavelengths[at]:g} nm {what} {wavelengths[at - 1]:g} nm on line "
            f"{lines[at - 1]}; expected every wavelength once, in order"
        )
    low, high = PLAUSIBLE_NM
    if wavelengths[0] < low or wavelengths[-1] > high:
        at = 0 if wavelengths[0] < low else -1
        fitting = [
            name for name, factor in NM_PER_UNIT.items() if 200 <= wavelengths[at] / NM_PER_UNIT[unit] * factor <= 3000
        ]
        hint = f"; wavelength_unit={fitting[0]!r} would fit" if fitting else ""
        raise FileFormatError(
            f"{path}, line {lines[at]}: wavelength {wavelengths[at]:g} nm (read in {unit}) is no wavelength of light, "
            f"expected {low:g} to {high:g} nm{hint}"
        )


def _require_values(path: Path, name: str, lines: list[int], values: NDArray[np.float64], kind: SpectrumKind) -> None:
    """Check that values are possible for the type: a light is not negative, a surface reflects between 0 and 1."""
    if kind == "spectrum":
        return
    at = int(values.argmin())
    slack = Reflectance.TOLERANCE if kind == "reflectance" else 0.0
    if values[at] < -slack:
        raise FileFormatError(
            f"{path}, line {lines[at]}: {kind} {name!r} is {values[at]:g}, expected at least 0; correct the sample, or "
            "read it with kind='spectrum' unchanged"
        )
    at = int(values.argmax())
    if kind == "reflectance" and values[at] > 1 + slack:
        hint = "; value_unit='percent' would fit" if 1.5 < values[at] <= 100 else ""
        raise FileFormatError(
            f"{path}, line {lines[at]}: reflectance {name!r} is {values[at]:g}, expected 0 to 1{hint}; a fluorescent "
            "or glossy sample can be read with kind='spectrum'"
        )
