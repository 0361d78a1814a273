# SPDX-License-Identifier: GPL-3.0-or-later
"""IES TM-27-14, "IES Standard Format for the Electronic Transfer of Spectral Data": one spectrum as XML (``.spdx``).

Read with expat itself rather than a tree, so that an error can name its line; a DOCTYPE is refused, so no entity is
ever expanded.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from xml.parsers import expat
from xml.sax.saxutils import escape

from spectral_core.checks import path_of, require_declared, require_kind
from spectral_core.errors import FileFormatError, InvalidInputError, UnknownNameError
from spectral_core.files.guarded import read_text, reading
from spectral_core.files.whole import write_text
from spectral_core.spectra.files.columns import (
    Column,
    ReadOptions,
    SpectrumKind,
    built,
    kind_of,
    number,
    readable,
    require_readable,
)
from spectral_core.spectra.spectrum import Spectrum

NAMESPACE = "http://www.ies.org/iestm2714"
NAMESPACES = (NAMESPACE, "iestm2714", "")
"""The standard's, the one of the sample file that travels with it, and none (hand-written files)."""

HEADER_ELEMENTS = (
    "Manufacturer", "CatalogNumber", "Description", "DocumentCreator", "UniqueIdentifier", "MeasurementEquipment",
    "Laboratory", "ReportNumber", "ReportDate", "DocumentCreationDate", "Comments",
)  # fmt: skip
"""In the order of the standard's schema; Description and DocumentCreator are required there."""

KIND_OF_QUANTITY: dict[str, SpectrumKind] = {
    **dict.fromkeys(("flux", "intensity", "irradiance", "radiance", "exitance", "relative"), "illuminant"),
    **dict.fromkeys(("reflectance", "R-Factor"), "reflectance"),
    **dict.fromkeys(("transmittance", "T-Factor", "absorptance", "other"), "spectrum"),
}  # fmt: skip
NOT_READ_AS = {
    "reflectance": ("absorptance",),
    "illuminant": ("absorptance", "transmittance", "T-Factor"),
}
"""Quantities that have no kind of their own, and are not read as these."""
QUANTITY_OF_KIND: dict[SpectrumKind, str] = {
    "illuminant": "relative",
    "reflectance": "reflectance",
    "spectrum": "other",
}

_NO_XML = re.compile("[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_SAMPLED_NOTE = "interpolation: sampled"
_NOTHING = "None"
"""Text of an empty element in files of colour-science. The same word as a name is written as a CDATA section."""


@dataclass(frozen=True, slots=True)
class SpdxDocument:
    """A TM-27-14 file. ``header``: texts by the standard's element names; ``bandwidth_nm``: FWHM, None if unknown."""

    spectrum: Spectrum
    quantity: str
    header: dict[str, str] = field(default_factory=dict)
    bandwidth_nm: float | None = None
    bandwidth_corrected: bool | None = None
    geometry: str | None = None
    """Reflection or transmission geometry, such as ``"di:8"``; None if not stated."""

    def __post_init__(self) -> None:
        require_declared(self)
        if self.quantity not in KIND_OF_QUANTITY:
            raise UnknownNameError.among("spectral quantity of TM-27-14", self.quantity, KIND_OF_QUANTITY)
        unknown = set(self.header) - set(HEADER_ELEMENTS)
        if unknown:
            raise UnknownNameError.among("header element of TM-27-14", sorted(unknown)[0], HEADER_ELEMENTS)


def read_spdx(path: str | Path, options: ReadOptions | None = None) -> SpdxDocument:
    """The file with its header. Raises FileFormatError (file, line, what was expected)."""
    file = path_of(path)
    with reading(file, "the XML of IES TM-27-14"):
        return _read(file, options or ReadOptions())


def _read(file: Path, options: ReadOptions) -> SpdxDocument:
    handler = _Handler(file)
    handler.parse(read_text(file))
    column, texts = handler.column, handler.texts
    quantity = texts.get("SpectralQuantity", ("", 1))[0]
    if quantity not in KIND_OF_QUANTITY:
        line = texts.get("SpectralQuantity", ("", 1))[1]
        raise FileFormatError(
            f"{file}, line {line}: SpectralQuantity is {quantity or 'missing'!r}; expected one of "
            f"{', '.join(KIND_OF_QUANTITY)}"
        )
    if quantity in NOT_READ_AS.get(options.kind or "", ()):
        raise FileFormatError(
            f"{file}, line {texts['SpectralQuantity'][1]}: SpectralQuantity is {quantity!r}; expected a file of "
            f"{options.kind}s, or read it with kind='spectrum'"
        )
    header = {name: texts[name][0] for name in HEADER_ELEMENTS if texts.get(name, ("", 0))[0]}
    described = [header.get(name, "") for name in ("Manufacturer", "CatalogNumber")]
    column.name = header.get("Description") or readable(file.stem)
    column.source = " ".join(text for text in described if text)
    column.kind = KIND_OF_QUANTITY[quantity]
    column.interpolation = "sampled" if _SAMPLED_NOTE in header.get("Comments", "") else "linear"
    bandwidth = texts.get("BandwidthFWHM")
    corrected = texts.get("BandwidthCorrected")
    return SpdxDocument(
        spectrum=built(file, column, options),
        quantity=quantity,
        header=header,
        bandwidth_nm=number(file, bandwidth[1], bandwidth[0], "a bandwidth in nm") if bandwidth else None,
        bandwidth_corrected=corrected[0].lower() in ("true", "1") if corrected else None,
        geometry=next(
            (texts[name][0] for name in ("ReflectionGeometry", "TransmissionGeometry") if name in texts), None
        ),
    )


def write_spdx(path: str | Path, document: SpdxDocument | Spectrum) -> None:
    """Write a TM-27-14 file; a bare spectrum gets the header that the standard requires.

    A bare spectrum's name becomes Description and its source Manufacturer, which read_spdx reverses.
    """
    if isinstance(document, Spectrum):
        document = _document_of(document)
    require_kind("what to write", document, SpdxDocument, "or a Spectrum")
    spectrum, header = document.spectrum, dict(document.header)
    require_readable(spectrum)
    if kind_of(spectrum) != KIND_OF_QUANTITY[document.quantity] and kind_of(spectrum) != "spectrum":
        raise InvalidInputError(
            f"{kind_of(spectrum)} {spectrum.name!r} cannot be written as the spectral quantity {document.quantity!r}; "
            f"use {QUANTITY_OF_KIND[kind_of(spectrum)]!r}"
        )
    header.setdefault("Description", spectrum.name)
    header.setdefault("DocumentCreator", "Spectral Scene Design")
    header.setdefault("DocumentCreationDate", datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S"))
    if spectrum.grid.interpolation == "sampled" and _SAMPLED_NOTE not in header.get("Comments", ""):
        header["Comments"] = "; ".join(filter(None, [header.get("Comments"), _SAMPLED_NOTE]))
    lines = ['<?xml version="1.0" encoding="utf-8"?>', f'<IESTM2714 xmlns="{NAMESPACE}" version="1.0">', "\t<Header>"]
    lines += [_element(name, header[name]) for name in HEADER_ELEMENTS if header.get(name)]
    lines += ["\t</Header>", "\t<SpectralDistribution>", _element("SpectralQuantity", document.quantity)]
    if document.geometry is not None:
        side = "Transmission" if document.quantity in ("transmittance", "T-Factor") else "Reflection"
        lines.append(_element(f"{side}Geometry", document.geometry))
    if document.bandwidth_nm is not None:
        lines.append(_element("BandwidthFWHM", repr(float(document.bandwidth_nm))))
    if document.bandwidth_corrected is not None:
        lines.append(_element("BandwidthCorrected", str(document.bandwidth_corrected).lower()))
    lines += [
        f'\t\t<SpectralData wavelength="{wavelength!r}">{value!r}</SpectralData>'
        for wavelength, value in zip(spectrum.grid.wavelengths_nm.tolist(), spectrum.values.tolist(), strict=True)
    ]
    lines += ["\t</SpectralDistribution>", "</IESTM2714>"]
    write_text(path, "\n".join(lines) + "\n")


def _document_of(spectrum: Spectrum) -> SpdxDocument:
    header = {"Description": spectrum.name}
    if spectrum.source:
        header["Manufacturer"] = spectrum.source
    return SpdxDocument(spectrum, QUANTITY_OF_KIND[kind_of(spectrum)], header)


def _element(name: str, text: str) -> str:
    wrong = _NO_XML.search(text)
    if wrong is not None:
        raise InvalidInputError(
            f"{name} {text[:40]!r} contains {wrong[0]!r}, which no XML file can hold; remove it, or write a .csv"
        )
    content = f"<![CDATA[{text}]]>" if text.strip() == _NOTHING else escape(text)
    return f"\t\t<{name}>{content}</{name}>"


class _Handler:
    """Collects the texts of elements with their lines, and the samples."""

    def __init__(self, path: Path) -> None:
        self.column = Column(readable(path.stem))
        self.texts: dict[str, tuple[str, int]] = {}
        self._path = path
        self._parser = expat.ParserCreate("utf-8", " ")
        self._parser.buffer_text = True
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._characters
        self._parser.StartCdataSectionHandler = self._literal
        self._parser.StartDoctypeDeclHandler = self._doctype
        self._open: list[str] = []
        self._text: list[str] = []
        self._is_literal = False
        """True if the text of the open element is in a CDATA section."""
        self._wavelength = 0.0

    def parse(self, text: str) -> None:
        # The text is already decoded, so the encoding in the XML declaration no longer applies.
        try:
            self._parser.Parse(text.encode("utf-8"), True)
        except expat.ExpatError as error:
            raise FileFormatError(
                f"{self._path}, line {error.lineno}: {expat.ErrorString(error.code)}; expected the XML of IES TM-27-14"
            ) from error

    def _doctype(self, *_: object) -> None:
        raise self._error("a DOCTYPE is not part of IES TM-27-14; remove it")

    def _error(self, text: str) -> FileFormatError:
        return FileFormatError(f"{self._path}, line {self._parser.CurrentLineNumber}: {text}")

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        namespace, _, name = tag.rpartition(" ")
        if not self._open and (name != "IESTM2714" or namespace.lower().rstrip("/") not in NAMESPACES):
            raise self._error(f"the root is <{name}> of namespace {namespace!r}; expected <IESTM2714> of {NAMESPACE!r}")
        self._open.append(name)
        self._text, self._is_literal = [], False
        if name == "SpectralDistribution" and self.column.lines:
            raise self._error("a second SpectralDistribution; expected one in a file: divide the file")
        if name == "SpectralData":
            if "wavelength" not in attributes:
                raise self._error('SpectralData without a wavelength; expected <SpectralData wavelength="400">')
            line = self._parser.CurrentLineNumber
            self._wavelength = number(self._path, line, attributes["wavelength"], "a wavelength in nm")

    def _literal(self) -> None:
        self._is_literal = True

    def _characters(self, text: str) -> None:
        self._text.append(text)

    def _end(self, _tag: str) -> None:
        name, line = self._open.pop(), self._parser.CurrentLineNumber
        text = "".join(self._text).strip()
        if name == "SpectralData":
            value = number(self._path, line, text, "a value")
            self.column.add(line, self._wavelength, value)
        elif text and (text != _NOTHING or self._is_literal):
            self.texts[name] = (text, line)
        self._text = []
