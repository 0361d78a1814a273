# SPDX-License-Identifier: GPL-3.0-or-later
"""SPDX compared with colour-science's reader and writer, .spd with Mitsuba's reader; errors of SPDX."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, InvalidInputError, UnknownNameError
from spectral_core.spectra import catalogue
from spectral_core.spectra.files import SpdxDocument, read_spdx, read_spectrum, write_spdx, write_spectra
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, Spectrum


@pytest.fixture(scope="module")
def colour() -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip("colour")


@pytest.mark.parametrize(
    "spectrum", [catalogue.illuminant("FL11"), catalogue.reflectance("blue sky")], ids=["light", "surface"]
)
def test_colour_science_reads_written_files(tmp_path: Path, colour: Any, spectrum: Spectrum) -> None:
    path = tmp_path / "ours.spdx"
    write_spectra(path, [spectrum])
    theirs = colour.SpectralDistribution_IESTM2714(str(path)).read()
    np.testing.assert_array_equal(theirs.wavelengths, spectrum.grid.wavelengths_nm)
    np.testing.assert_array_equal(theirs.values, spectrum.values)
    assert theirs.header.description == spectrum.name
    assert theirs.spectral_quantity == ("relative" if isinstance(spectrum, Illuminant) else "reflectance")


def test_files_of_colour_science_are_read(tmp_path: Path, colour: Any) -> None:
    path = tmp_path / "theirs.spdx"
    header = colour.io.tm2714.Header_IESTM2714(manufacturer="Acme & Sons", description="a lamp <1>", comments="25 °C")
    data = dict(zip(range(400, 701, 20), np.linspace(0.1, 3, 16), strict=True))
    theirs = colour.SpectralDistribution_IESTM2714(
        str(path),
        header=header,
        spectral_quantity="irradiance",
        bandwidth_FWHM=2.5,
        bandwidth_corrected=True,
        data=data,
    )
    theirs.write()
    ours = read_spdx(path)
    assert isinstance(ours.spectrum, Illuminant)
    assert (ours.spectrum.name, ours.spectrum.source) == ("a lamp <1>", "Acme & Sons")
    assert ours.header == {"Manufacturer": "Acme & Sons", "Description": "a lamp <1>", "Comments": "25 °C"}
    assert (ours.quantity, ours.bandwidth_nm, ours.geometry) == ("irradiance", 2.5, None)
    np.testing.assert_array_equal(ours.spectrum.grid.wavelengths_nm, list(data))
    np.testing.assert_allclose(ours.spectrum.values, list(data.values()), rtol=1e-11)  # colour-science prints 12 digits


def test_a_spectrum_named_none_keeps_its_name(tmp_path: Path, colour: Any) -> None:
    """colour-science writes "None" where an element has no text; that is no name."""
    path = tmp_path / "lamp.spdx"
    grid = SpectralGrid.uniform(400, 700, 20)
    write_spectra(path, [Illuminant("None", grid, np.ones(grid.size), source="None")])
    found = read_spectrum(path)
    assert (found.name, found.source) == ("None", "None")
    theirs = colour.SpectralDistribution_IESTM2714(
        str(path), spectral_quantity="relative", data=dict(zip(grid.wavelengths_nm, np.ones(grid.size), strict=True))
    )
    theirs.write()
    assert (read_spectrum(path).name, read_spectrum(path).source) == ("lamp", "lamp.spdx")


def test_mitsuba_reads_written_spd_files(tmp_path: Path) -> None:
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_spectral")
    spectrum = catalogue.illuminant("A")
    write_spectra(tmp_path / "a.spd", [spectrum])
    wavelengths, values = mitsuba.spectrum_from_file(str(tmp_path / "a.spd"))
    np.testing.assert_array_equal(np.array(wavelengths), spectrum.grid.wavelengths_nm)
    np.testing.assert_allclose(np.array(values), spectrum.values, rtol=1e-6)  # in single precision


def test_a_document_with_all_elements_is_read_back(tmp_path: Path) -> None:
    written = SpdxDocument(
        Reflectance("tile", SpectralGrid.uniform(), np.linspace(0, 1, 31)),
        "R-Factor",
        {"Description": "tile", "DocumentCreator": "me", "DocumentCreationDate": "2026-01-01", "ReportNumber": "7"},
        bandwidth_nm=5.0,
        bandwidth_corrected=False,
        geometry="45a:0",
    )
    write_spdx(tmp_path / "tile.spdx", written)
    read = read_spdx(tmp_path / "tile.spdx")
    for name in ("quantity", "header", "bandwidth_nm", "bandwidth_corrected", "geometry"):
        assert getattr(read, name) == getattr(written, name)
    np.testing.assert_array_equal(read.spectrum.values, written.spectrum.values)


DOCUMENT = """<?xml version="1.0"?>
<IESTM2714 xmlns="iestm2714" version="1.0">
 <Header><Description>lamp</Description></Header>
 <SpectralDistribution>
  <SpectralQuantity>relative</SpectralQuantity>
  <SpectralData wavelength="400.0">0.5</SpectralData>
  <SpectralData wavelength="410.0">0.6</SpectralData>
 </SpectralDistribution>
</IESTM2714>
"""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("0.6", "six", r"lamp\.spdx, line 7: 'six' is not a number; expected a value"),
        ("410.0", "400.0", r"line 7: wavelength 400 nm repeats 400 nm on line 6"),
        (' wavelength="410.0"', "", r"line 7: SpectralData without a wavelength"),
        ("relative", "loudness", r"line 5: SpectralQuantity is 'loudness'; expected one of flux, intensity"),
        ("<SpectralQuantity>relative</SpectralQuantity>", "", r"line 1: SpectralQuantity is 'missing'"),
        ("</Header>", "", r"line 9: mismatched tag; expected the XML of IES TM-27-14"),
        ('"iestm2714"', '"urn:svg"', r"line 2: the root is <IESTM2714> of namespace 'urn:svg'"),
        ("IESTM2714", "svg", r"line 2: the root is <svg>"),
        ('<?xml version="1.0"?>', '<!DOCTYPE x [<!ENTITY a "b">]>', r"line 1: a DOCTYPE is not part of"),
        ("0.6", "-0.6", r"line 7: illuminant 'lamp' is -0\.6, expected at least 0"),
    ],
)
def test_spdx_errors_name_file_and_line(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = tmp_path / "lamp.spdx"
    path.write_text(DOCUMENT, encoding="utf-8")
    assert isinstance(read_spectrum(path), Illuminant)
    path.write_text(DOCUMENT.replace(old, new), encoding="utf-8")
    with pytest.raises(FileFormatError, match=message):
        read_spectrum(path)


def test_contradictory_documents_are_refused() -> None:
    light = Illuminant("l", SpectralGrid.uniform(), np.ones(31))
    with pytest.raises(UnknownNameError, match="no spectral quantity of TM-27-14 is named 'loudness'"):
        SpdxDocument(light, "loudness")
    with pytest.raises(UnknownNameError, match="no header element of TM-27-14 is named 'Maker'"):
        SpdxDocument(light, "relative", {"Maker": "x"})
    with pytest.raises(
        InvalidInputError, match="illuminant 'l' cannot be written as the spectral quantity 'reflectance'"
    ):
        write_spdx("never.spdx", SpdxDocument(light, "reflectance"))
