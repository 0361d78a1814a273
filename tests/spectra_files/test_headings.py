# SPDX-License-Identifier: GPL-3.0-or-later
"""Headings of tables: numbers as names, comments as headings, units of other quantities, marks of spreadsheets."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from spectral_core.documents.codecs import SpectrumFiles, decoded_spectrum
from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.spectra.files import read_spectra, write_spectra
from spectral_core.spectra.spectrum import Reflectance, SpectralGrid

GRID = SpectralGrid.uniform(380, 780, 5)


def read(folder: Path, text: str, name: str = "table.csv", kind="reflectance"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    found = read_spectra(path, kind=kind)
    return [(each.name, each.grid.wavelengths_nm.tolist(), each.values.tolist()) for each in found]


@pytest.mark.parametrize("names", [("1003", "5014"), ("5014", "1003"), ("5014", "600"), ("801", "802", "803")])
def test_paints_with_numbers_as_names_are_read_back(tmp_path: Path, names) -> None:
    paints = [Reflectance(name, GRID, np.full(GRID.size, 0.1 * k)) for k, name in enumerate(names, 1)]
    write_spectra(tmp_path / "ral.csv", paints)
    found = read_spectra(tmp_path / "ral.csv")
    assert [each.name for each in found] == list(names)
    for before, after in zip(paints, found, strict=True):
        np.testing.assert_array_equal(after.values, before.values)
        assert after.grid.same_as(GRID)


@pytest.mark.parametrize(
    "text",
    [
        "# wavelength_nm,one [%],two [%]\n400,10,50\n410,20,60\n",
        "# first line\n# wavelength_um one_percent two_percent\n0.400 10 50\n0.410 20 60\n",
        "#Wavelength (nm)\tone (%)\ttwo (%)\n400\t10\t50\n410\t20\t60\n",
        "Wavelength (nm)   one (%)  two (%)\n400 10 50\n410 20 60\n",
        "λ/nm;one/%;two/%\n400;10;50\n410;20;60\n",
        "sep=;\nWavelength [nm];one [%];two [%]\n400;10;50\n410;20;60\n",
    ],
)
def test_units_are_taken_from_every_form_of_heading(tmp_path: Path, text: str) -> None:
    one, two = read(tmp_path, text, "table.txt")
    assert one[0].startswith("one")
    assert two[0].startswith("two")
    np.testing.assert_allclose([one[1], two[1]], [[400, 410]] * 2, rtol=1e-14)
    np.testing.assert_allclose([one[2], two[2]], [[0.1, 0.2], [0.5, 0.6]], rtol=1e-14)


@pytest.mark.parametrize("heading", ["%R", "% Reflectance", "R%", "%T"])
def test_a_percent_sign_beside_a_letter_is_a_unit(tmp_path: Path, heading: str) -> None:
    assert read(tmp_path, f"nm,{heading}\n400,10\n410,55\n")[0][2] == pytest.approx([0.1, 0.55])
    paint = Reflectance(heading, GRID, np.full(GRID.size, 0.25))
    write_spectra(tmp_path / "written.csv", [paint])
    (found,) = read_spectra(tmp_path / "written.csv")
    assert found.name == heading
    np.testing.assert_array_equal(found.values, paint.values)


@pytest.mark.parametrize("heading", ["%50 gray", "gray 50%", "50%"])
def test_a_percent_sign_beside_a_number_is_a_name(tmp_path: Path, heading: str) -> None:
    assert read(tmp_path, f"nm,{heading}\n400,0.1\n410,0.5\n") == [(heading, [400, 410], [0.1, 0.5])]


def test_a_remark_above_the_numbers_is_no_heading(tmp_path: Path) -> None:
    assert read(tmp_path, "# measured on Tuesday, twice\n400,0.1\n410,0.2\n")[0][0] == "table"


@pytest.mark.parametrize(
    ("heading", "first"),
    [("Frequency (THz)", 430), ("Wavenumber (cm-1)", 14000), ("wavenumber 1/cm", 14000), ("Photon energy [eV]", 20)],
)
def test_another_quantity_than_wavelengths_is_refused(tmp_path: Path, heading: str, first: int) -> None:
    text = f"{heading},paint\n" + "".join(f"{first + 10 * k},0.3\n" for k in range(30))
    with pytest.raises(FileFormatError, match="line 1: .* is no wavelength in nm, um, angstrom, m; convert"):
        read(tmp_path, text)


def test_a_name_that_xml_cannot_hold_is_refused(tmp_path: Path) -> None:
    paint = Reflectance("red\x01", GRID, np.full(GRID.size, 0.2))
    with pytest.raises(InvalidInputError, match="which no XML file can hold"):
        write_spectra(tmp_path / "red.spdx", [paint])
    assert not (tmp_path / "red.spdx").exists()


def test_a_name_that_a_file_has_twice_is_refused(tmp_path: Path) -> None:
    (tmp_path / "two.csv").write_text("nm,red,red\n400,0.1,0.2\n500,0.1,0.2\n", encoding="utf-8")
    with pytest.raises(InvalidInputError, match="holds 2 spectra named 'red'"):
        decoded_spectrum({"file": "two.csv", "name": "red"}, "reflectance", GRID, SpectrumFiles(tmp_path))


@pytest.mark.parametrize("heading", ["Wavelength (A)", "λ [A]", "Wavelength in A", "wavelength_A"])
def test_the_letter_a_after_a_wavelength_is_angstrom(tmp_path: Path, heading: str) -> None:
    """Spectroscopy tables in English write A for Å; read in nm they had no visible light and no message."""
    assert read(tmp_path, f"{heading},R\n4000,0.1\n5000,0.5\n")[0][1] == pytest.approx([400, 500])


@pytest.mark.parametrize("heading", ["Wavelength (nm, air)", "wavelength (nm) (vac)", "Wavelength (vacuum)", "nm (1)"])
def test_a_medium_in_brackets_is_no_unit(tmp_path: Path, heading: str) -> None:
    assert read(tmp_path, f'"{heading}",R\n400,0.1\n500,0.5\n')[0][1] == [400, 500]


@pytest.mark.parametrize("heading", ["lambda [kÅ]", "f [PHz]", "wavelength (microm)", "wavelength [10^-9 m]"])
def test_unknown_units_in_brackets_are_refused(tmp_path: Path, heading: str) -> None:
    with pytest.raises(FileFormatError, match="no wavelength in nm, um, angstrom, m"):
        read(tmp_path, f"{heading},R\n400,0.1\n500,0.5\n")


def test_a_unit_of_the_caller_replaces_an_unknown_one(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("wavelength (microm),R\n0.4,0.1\n0.5,0.5\n")
    assert read_spectra(path, wavelength_unit="um")[0].grid.wavelengths_nm == pytest.approx([400, 500])


def test_integers_between_commas_without_headings_may_be_decimal_commas(tmp_path: Path) -> None:
    """400,0,1 is 0.1 at 400 nm in half of the world."""
    with pytest.raises(FileFormatError, match="line 1: '400, 0, 1'.* decimal commas"):
        read(tmp_path, "400,0,1\n500,0,5\n600,0,9\n", kind="illuminant")
    assert len(read(tmp_path, "nm,one,two\n400,0,1\n500,0,5\n600,0,9\n", kind="illuminant")) == 2
