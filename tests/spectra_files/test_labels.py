# SPDX-License-Identifier: GPL-3.0-or-later
"""Wavelengths with a word or a unit in one cell, as spectrometers write them."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import FileFormatError
from spectral_core.spectra.files import read_spectra

WAVELENGTHS = [380, 390, 400, 410]
ROWS = {"red": [0.1, 0.2, 0.3, 0.4], "dark": [0.01, 0.02, 0.03, 0.04]}
LABELS = ["{} nm", "{}nm", "R{}", "nm{}", "λ{}", "R_{}nm", "SPECTRAL_NM_{}", "Spec{}", "R[{}nm]", "[{}]"]


def table(tmp_path, lines):
    path = tmp_path / "measured.csv"
    path.write_text("\n".join(",".join(map(str, line)) for line in lines), encoding="utf-8")
    return path


@pytest.mark.parametrize("label", LABELS)
@pytest.mark.parametrize("names", [("red", "dark"), ("101", "102")])
def test_labels_in_the_first_row(tmp_path, label, names) -> None:
    rows = [[name, *values] for name, values in zip(names, ROWS.values(), strict=True)]
    path = table(tmp_path, [["Sample", *map(label.format, WAVELENGTHS)], *rows])
    spectra = read_spectra(path, kind="reflectance")
    assert [each.name for each in spectra] == list(names)
    for each, values in zip(spectra, ROWS.values(), strict=True):
        assert each.grid.wavelengths_nm.tolist() == WAVELENGTHS
        assert each.values.tolist() == values


@pytest.mark.parametrize("label", LABELS)
@pytest.mark.parametrize("headings", [[["wavelength", "red", "dark"]], []])
def test_labels_in_the_first_column(tmp_path, label, headings) -> None:
    values = zip(map(label.format, WAVELENGTHS), *ROWS.values(), strict=True)
    spectra = read_spectra(table(tmp_path, [*headings, *values]))
    assert [each.grid.wavelengths_nm.tolist() for each in spectra] == [WAVELENGTHS, WAVELENGTHS]
    assert np.array_equal([each.values for each in spectra], list(ROWS.values()))


@pytest.mark.parametrize("names", [("red", "dark"), ("101", "102")])
def test_other_columns_beside_labels_are_named(tmp_path, names) -> None:
    """Samples 101 and 102 were read as wavelengths of 101 and 102 nm."""
    rows = [[name, 50, *values] for name, values in zip(names, ROWS.values(), strict=True)]
    path = table(tmp_path, [["Sample", "L*", "R380", "R390", "R400", "R410"], *rows])
    with pytest.raises(FileFormatError, match=r"line 1: 'L\*' heads column 2 beside wavelengths such as 'R380'"):
        read_spectra(path)


@pytest.mark.parametrize(
    ("headings", "down"),
    [
        (["name", 400, 500, 600], ["R400", "R410", "R420"]),  # codes of paints
        (["nm", "400nm", "450nm", "500nm"], [380, 390, 400]),  # LEDs
        (["λ", "R400", "R450", "R500"], [380, 390, 400]),
        (["nm", "R1", "R2", "R3"], [380, 390, 400]),  # test colors of CIE 13.3
    ],
)
def test_names_that_look_like_labels_stay_names(tmp_path, headings, down) -> None:
    spectra = read_spectra(table(tmp_path, [headings, *([each, 0.1, 0.2, 0.3] for each in down)]))
    across = isinstance(headings[1], int)
    assert [each.name for each in spectra] == (down if across else headings[1:])
    assert spectra[0].grid.wavelengths_nm.tolist() == (headings[1:] if across else down)


@pytest.mark.parametrize("label", ["{}", "R{}", "{} nm"])
@pytest.mark.parametrize("first", [401, 801])
@pytest.mark.parametrize("corner", ["Sample", "SAMPLE_ID", "Paint no.", ""])
def test_numbers_of_samples_are_not_read_as_wavelengths(tmp_path, label, first, corner) -> None:
    """Samples 401 and 402 over 380 to 410 nm were four spectra of 401 and 402 nm."""
    rows = [[first + k, *values] for k, values in enumerate(ROWS.values())]
    path = table(tmp_path, [[corner, *map(label.format, WAVELENGTHS)], *rows])
    if not corner and first == 401:
        with pytest.raises(FileFormatError, match="may both be wavelengths; name the first column 'wavelength_nm'"):
            read_spectra(path)
        return
    spectra = read_spectra(path)
    assert [each.name for each in spectra] == [str(first), str(first + 1)]
    assert spectra[0].grid.wavelengths_nm.tolist() == WAVELENGTHS


def test_a_row_of_labels_without_a_column_of_names_is_refused(tmp_path) -> None:
    """The first sample became the name of its spectrum."""
    path = table(tmp_path, [["380 nm", "390 nm", "400 nm", "410 nm"], *ROWS.values()])
    with pytest.raises(FileFormatError, match="the wavelength '380 nm' heads the first column"):
        read_spectra(path)


@pytest.mark.parametrize("ending", ["txt", "dx", "spd"])
@pytest.mark.parametrize(
    "data", ["##XYDATA=(X++(Y..Y))\n400 0.1 0.2\n420 0.3 0.4", "##XYPOINTS=(XY..XY)\n400 0.1\n410 0.2"]
)
def test_a_file_of_jcamp_is_named(tmp_path, ending, data) -> None:
    """Its statements of units and factors look like comments, and several samples in a line like several spectra."""
    path = tmp_path / f"measured.{ending}"
    path.write_text(f"##TITLE=paint\n##JCAMP-DX=4.24\n##YUNITS=ABSORBANCE\n{data}\n##END=\n")
    with pytest.raises(FileFormatError, match="line 1: a file of JCAMP-DX"):
        read_spectra(path, kind="reflectance")


def test_a_file_of_cgats_is_named(tmp_path) -> None:
    path = tmp_path / "measured.txt"
    path.write_text(
        'CGATS.17\nORIGINATOR "maker"\nNUMBER_OF_FIELDS 3\nBEGIN_DATA_FORMAT\nSAMPLE_NAME nm400 nm410\n'
        "END_DATA_FORMAT\nBEGIN_DATA\nred 0.1 0.2\nEND_DATA\n"
    )
    with pytest.raises(FileFormatError, match="line 4: a measurement file of CGATS or Argyll; expected a table"):
        read_spectra(path)
