# SPDX-License-Identifier: GPL-3.0-or-later
"""Headings of tables of spectra: the units and quantities that they state."""

from __future__ import annotations

import re
from pathlib import Path

from spectral_core.errors import FileFormatError
from spectral_core.spectra.files.columns import (
    FRACTION_PER_UNIT,
    NM_PER_UNIT,
    Column,
    SpectrumKind,
    known_unit,
)

WAVELENGTH_WORDS = ("wavelength", "wave length", "lambda", "λ", "wl")
"""Beginnings of the heading of wavelengths."""
AT_START = WAVELENGTH_WORDS[:-1]
"""Those that begin no other heading: WLED is a lamp."""
ALONE = ("nm", "um", "µm", "μm", "wl")
"""Whole headings of wavelengths; in longer ones they may be part of a name."""
MEDIA = ("air", "vacuum", "vac", "vac.")
"""Words in brackets after a wavelength that state no unit."""
OTHER_WORDS = ("wavenumber", "wave number", "frequency", "energy", "photon energy")
OTHER_UNITS = (
    "cm-1", "cm^-1", "cm⁻¹", "1/cm", "ev", "phz", "thz", "ghz", "hz", "pm", "mm", "cm",
)  # fmt: skip
"""Beginnings and units of headings of other quantities, whose numbers may look like wavelengths in nm."""
NEITHER = ("absorbance", "absorptance", "optical density", "kubelka", "log(1/", "k/s", "photon flux", "photons", "ppfd")
"""Beginnings of headings of values that are no reflectances and no power of a light."""
NEITHER_ALONE = ("abs", "abs.", "absorption", "od", "extinction", "f(r)")
"""Whole headings of such values; longer ones may be names, such as Abs Blue."""
OF_OTHERS = {"reflectance": ("irradiance", "radiance"), "illuminant": ("reflectance", "transmittance")}
"""Headings of values that are not of a kind; longer ones may be names, such as Radiance Pearl."""
PHOTONS = ("µmol", "μmol", "umol")
"""Units of numbers of photons, which are no power: a photon of blue light has more energy than one of red light."""
_PERCENT = re.compile(r"(?<![\d\s])\s*(?:%(?!\s*\d)|(?<![^\W_])percent(?![^\W_]))", re.IGNORECASE)
"""A statement of percent; ``50% gray`` is a name."""


def names_wavelengths(heading: str) -> bool:
    """True for ``Wavelength``, ``λ/nm``, ``nm``."""
    return heading.lower().startswith(WAVELENGTH_WORDS) or stated_unit(heading, NM_PER_UNIT) is not None


def named_column(heading: str, fallback: str, wavelength_unit: str | None) -> Column:
    """Column of a heading; ``paint [%]`` is a paint in percent."""
    column = Column(heading or fallback, wavelength_unit=wavelength_unit)
    column.value_unit = stated_unit(heading, FRACTION_PER_UNIT)
    if column.value_unit:
        name, _, bracketed = _last_word(heading)
        column.name = (name if bracketed else heading) or fallback
    return column


def wavelength_unit(path: Path, header: tuple[int, list[str]], given: str | None) -> str | None:
    """Unit that the first heading states; None if it states none. Raises FileFormatError for another quantity, and for
    an unknown unit if no other is ``given``.
    """
    line, (heading, *_) = header
    _, last, is_bracketed = _last_word(heading)
    if last == "A" and (is_bracketed or heading.lower().startswith(WAVELENGTH_WORDS)):
        return "angstrom"  # a single letter after another word may be a name
    # "wavelength (nm, air)" states its unit before its last word
    words = [word for word in re.findall(r"[^\W\d_]+", heading.lower()) if word in ("nm", "um", "µm", "μm")]
    unit = stated_unit(heading, NM_PER_UNIT) or (known_unit(words[0], NM_PER_UNIT) if words else None)
    is_other = heading.lower().startswith(OTHER_WORDS) or last.lower() in OTHER_UNITS
    is_unknown = not (given or unit) and is_bracketed and names_wavelengths(heading) and last.lower() not in MEDIA
    if is_other or is_unknown or heading.lower().endswith("1/cm"):
        raise FileFormatError(
            f"{path}, line {line}: {heading!r} is no wavelength in {', '.join(NM_PER_UNIT)}; convert the numbers to "
            "wavelengths, and name the unit in the heading"
        )
    return unit


def stated_unit(heading: str, known: dict[str, float]) -> str | None:
    """Unit that a heading states: ``wavelength_nm``, ``Wavelength (µm)``, or anywhere in it ``%`` or ``percent``, but
    not behind a number; None if it states none.
    """
    if "percent" in known and _PERCENT.search(heading):
        return "percent"
    try:
        return known_unit(_last_word(heading)[1], known)
    except ValueError:
        return None


def require_quantity(path: Path, line: int, column: Column, kind: SpectrumKind | None) -> None:
    """Raise FileFormatError if the heading of a column states another quantity than ``kind``; the file's own statement
    of a kind has priority.
    """
    if column.kind is not None or kind not in ("reflectance", "illuminant"):
        return
    heading = column.name.lower()
    alone = re.split(r"[(\[/,_]", heading)[0].strip().removeprefix("spectral ")
    is_neither = heading.startswith(NEITHER) or bool({heading, alone} & set(NEITHER_ALONE))
    if is_neither or alone in OF_OTHERS[kind] or any(unit in heading for unit in PHOTONS):
        wanted = "the share of light that it reflects" if kind == "reflectance" else "its power per wavelength"
        raise FileFormatError(
            f"{path}, line {line}: {column.name!r} is no {kind}; expected {wanted}: convert the numbers and rename the "
            f"heading, or state '# kind: {kind}' in the file if the heading is a name"
        )


def _last_word(heading: str) -> tuple[str, str, bool]:
    """Divide a heading: all but its last word, the last word, and whether that is in brackets.

    Without a regular expression: one that finds the bracket from the front tries every start, and took hours for a
    heading of 20,000 blanks.
    """
    text = heading.rstrip()
    if text.endswith(("]", ")")):
        opened = max(text.rfind("["), text.rfind("("))
        inside = text[opened + 1 : -1]
        if opened >= 0 and not set(inside) & set("])"):
            return text[:opened].rstrip(), inside.strip(), True
        return text, "", False
    cut = max(text.rfind("_"), text.rfind(" "), text.rfind("/"))
    return text[: max(cut, 0)].rstrip(), text[cut + 1 :], False
