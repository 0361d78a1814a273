# SPDX-License-Identifier: GPL-3.0-or-later
"""CSV and .spd files of instruments and spreadsheets, and the errors for invalid ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from spectral_core.errors import FileFormatError, InvalidInputError, UnknownNameError
from spectral_core.spectra.files import detect_format, read_spectra, read_spectrum, write_spectra
from spectral_core.spectra.files.columns import SpectrumKind
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid, Spectrum

PLAIN = "wavelength,one,two\n400,0.1,0.5\n410,0.2,0.6\n420,0.3,0.7\n"


def file_of(folder: Path, text: str, name: str = "table.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        PLAIN.replace(",", ";"),
        PLAIN.replace(",", "\t"),
        PLAIN.replace(",", "  "),
        PLAIN.replace(",", ";").replace(".", ","),
        PLAIN.replace(",", "\t").replace(".", ","),
        "\ufeff" + PLAIN.replace("\n", "\r\n"),
        "# measured on Tuesday: cloudy\n\n" + PLAIN,
        "wavelength,one,two\n420,0.3,0.7\n410,0.2,0.6\n400,0.1,0.5\n",
        PLAIN.replace("\n", ",\n"),
        "sample,400,410,420\none,0.1,0.2,0.3\ntwo,0.5,0.6,0.7\n",
        "Wavelength (µm),one,two\n0.4,0.1,0.5\n0.41,0.2,0.6\n0.42,0.3,0.7\n",
        "wavelength_um,one,two\n0.4,0.1,0.5\n0.41,0.2,0.6\n0.42,0.3,0.7\n",
        "wavelength,one [%],two (%)\n400,10,50\n410,20,60\n420,30,70\n",
        "# value unit: percent\nwavelength,one,two\n400,10,50\n410,20,60\n420,30,70\n",
        "# wavelength unit: angstrom\nwavelength,one,two\n4000,.1,.5\n4100,.2,.6\n4200,.3,.7\n",
    ],
)
def test_every_dialect_gives_the_same_two_spectra(tmp_path: Path, text: str) -> None:
    one, two = read_spectra(file_of(tmp_path, text), kind="reflectance")
    assert (one.name, two.name) == ("one", "two")
    np.testing.assert_allclose(one.grid.wavelengths_nm, [400, 410, 420], rtol=1e-14)
    np.testing.assert_allclose(one.values, [0.1, 0.2, 0.3], rtol=1e-14)
    np.testing.assert_allclose(two.values, [0.5, 0.6, 0.7], rtol=1e-14)


def test_numbered_samples_in_a_heading_are_not_wavelengths(tmp_path: Path) -> None:
    read = read_spectra(file_of(tmp_path, "wavelength,1,2,3\n400,0.1,0.2,0.3\n410,0.1,0.2,0.3\n"))
    assert [spectrum.name for spectrum in read] == ["1", "2", "3"]
    across = read_spectra(file_of(tmp_path, "sample,400,410\n1,0.1,0.2\n2,0.3,0.4\n"))
    assert [spectrum.values.tolist() for spectrum in across] == [[0.1, 0.2], [0.3, 0.4]]


def test_without_a_heading_spectra_get_the_name_of_the_file(tmp_path: Path) -> None:
    assert read_spectrum(file_of(tmp_path, "400,0.1\n410,0.2\n", "paint.csv")).name == "paint"
    names = [s.name for s in read_spectra(file_of(tmp_path, "400,0.1,0.2\n410,0.2,0.3\n", "paints.csv"))]
    assert names == ["paints 1", "paints 2"]


def test_empty_cells_give_each_spectrum_its_own_wavelengths(tmp_path: Path) -> None:
    one, two = read_spectra(file_of(tmp_path, "nm,one,two\n400,0.1,\n410,,0.6\n420,0.3,0.7\n"))
    assert one.grid.wavelengths_nm.tolist() == [400, 420]
    assert two.grid.wavelengths_nm.tolist() == [410, 420]


@pytest.mark.parametrize(("stated", "wanted"), [("illuminant", "reflectance"), ("reflectance", "illuminant")])
def test_a_lamp_is_no_paint(tmp_path: Path, stated: str, wanted: SpectrumKind) -> None:
    path = file_of(tmp_path, f"# kind: {stated}\nnm,one\n400,0.1\n500,0.2\n")
    with pytest.raises(FileFormatError, match=f"'one' is of the kind {stated}; expected {wanted}"):
        read_spectra(path, kind=wanted)
    assert read_spectra(path, kind="spectrum")[0].name == "one"


def test_arguments_override_the_file(tmp_path: Path) -> None:
    path = file_of(tmp_path, "# kind: illuminant\nnm,lamp\n0.4,10\n0.5,20\n", "um.csv")
    assert type(read_spectrum(file_of(tmp_path, "# kind: illuminant\nnm,lamp\n400,10\n500,20\n"))) is Illuminant
    lamp = read_spectra(path, kind="spectrum", wavelength_unit="µm", value_unit="%")[0]
    assert type(lamp) is Spectrum
    np.testing.assert_allclose(lamp.grid.wavelengths_nm, [400, 500])
    assert lamp.values.tolist() == [0.1, 0.2]


def test_other_comments_are_ignored(tmp_path: Path) -> None:
    text = "# Source: lab 3, bench 2, J. Doe\n# Kind:\n# unit: whatever\nnm,lamp\n400,10\n500,20\n"
    assert read_spectrum(file_of(tmp_path, text)).source == "lab 3, bench 2, J. Doe"


def test_spd_with_comments_and_irregular_blanks(tmp_path: Path) -> None:
    read = read_spectrum(file_of(tmp_path, "# glass\n\n400   0.5\n410\t0.6\n420, 0.7\n", "glass.spd"))
    assert (read.name, type(read)) == ("glass", Spectrum)
    assert read.values.tolist() == [0.5, 0.6, 0.7]


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.csv", "wavelength,x\n400,0.1\n410,oops\n", r"a\.csv, line 3: 'oops' is not a number; expected a value of"),
        ("a.csv", "wavelength,x\n400,0.1\n410,nan\n", r"line 3: 'nan' is not finite"),
        ("a.csv", "# note\nwavelength,x\n400,0.1\n400,0.2\n", r"line 4: wavelength 400 nm repeats 400 nm on line 3"),
        ("a.csv", "wavelength,x\n400,0.1\n420,0.2\n410,0.2\n", r"line 4: wavelength 410 nm breaks the order of 420 nm"),
        ("a.csv", "wavelength,x\n0.4,0.1\n0.5,0.2\n", r"line 2: wavelength 0\.4 nm .* wavelength_unit='um' would fit"),
        ("a.csv", "wavelength,x\n400,0.1\n", r"line 2: spectrum 'x' has 1 sample, expected at least 2"),
        ("a.csv", "wavelength,x\n400,0.1\n410,0.2,0.3\n", r"line 3: 3 cells under 2 headings; expected a heading each"),
        ("a.csv", "400,0.1\n410\n", r"line 2: 1 cell, expected 2"),
        ("a.csv", "wavelength\n400\n410\n", r"line 2: found 1 column\(s\) and 2 row\(s\)"),
        # a pattern that tries every start of a run of blanks takes quadratic time
        ("a.csv", f"(nm{' ' * 30_000}x,y{' ' * 30_000}[\n400,oops\n", r"line 2: 'oops' is not a number"),
        ("a.csv", "hello world\n", r"line 1: found .* 0 row\(s\) of numbers"),
        ("a.csv", "\n\n", r"line 1: the file is empty"),
        ("a.csv", "# only words\n", r"line 1: no samples"),
        ("a.csv", "# kind: lamp\nw,x\n400,1\n500,1\n", r"line 1: no kind is named 'lamp'"),
        ("a.csv", "# kind: illuminant, spectrum\nw,x\n400,1\n500,1\n", r"'kind' is stated for 2 spectra, .* holds 1"),
        ("a.spd", "400 0.5\n410 0.6 0.7\n", r"a\.spd, line 2: 3 values .* expected a wavelength \(nm\) and a value"),
        ("a.spd", "# nothing\n", r"line 1: no samples"),
        ("a.spdx", "400 0.5\n", r"a\.spdx, line 1: no XML"),
    ],
)
def test_errors_name_file_and_line(tmp_path: Path, name: str, text: str, message: str) -> None:
    with pytest.raises(FileFormatError, match=message):
        read_spectra(file_of(tmp_path, text, name))


@pytest.mark.parametrize(
    ("kind", "values", "message"),
    [
        ("illuminant", (1.0, -0.25), r"line 3: illuminant 'x' is -0\.25, expected at least 0.*kind='spectrum'"),
        ("reflectance", (0.5, -0.1), r"line 3: reflectance 'x' is -0\.1, expected at least 0"),
        ("reflectance", (0.5, 55.0), r"line 3: reflectance 'x' is 55, expected 0 to 1; value_unit='percent' would fit"),
        ("reflectance", (0.5, 1.2), r"line 3: reflectance 'x' is 1\.2, expected 0 to 1; a fluorescent"),
    ],
)
def test_values_impossible_for_the_type_are_refused(
    tmp_path: Path, kind: str, values: tuple[float, float], message: str
) -> None:
    path = file_of(tmp_path, f"nm,x\n400,{values[0]}\n500,{values[1]}\n")
    with pytest.raises(FileFormatError, match=message):
        read_spectra(path, kind=kind)  # type: ignore[arg-type]
    assert read_spectrum(path, kind="spectrum").values.tolist() == list(values)


def test_files_that_are_not_text_are_refused(tmp_path: Path) -> None:
    for data, message in [
        (b"\x89PNG\r\n\x1a\n\0\0", "not UTF-8 text; save"),
        (b"400\0 1\n", "a binary file"),
    ]:
        (tmp_path / "x.csv").write_bytes(data)
        with pytest.raises(FileFormatError, match=message):
            read_spectra(tmp_path / "x.csv")
    with pytest.raises(FileFormatError, match=r"there is no file .*nowhere\.csv"):
        read_spectra(tmp_path / "nowhere.csv")


def test_utf_16_of_spreadsheets_is_read(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text(PLAIN, encoding="utf-16")
    assert len(read_spectra(tmp_path / "x.csv")) == 2


def test_wrong_requests_are_refused(tmp_path: Path) -> None:
    light = Illuminant("l", SpectralGrid.uniform(), np.ones(31))
    path = file_of(tmp_path, PLAIN)
    with pytest.raises(FileFormatError, match=r"holds 2 spectra \('one', 'two'\), expected one; use read_spectra"):
        read_spectrum(path)
    with pytest.raises(UnknownNameError, match="no unit is named 'inch'"):
        read_spectra(path, wavelength_unit="inch")
    with pytest.raises(UnknownNameError, match="no kind of spectrum is named 'lamp'"):
        read_spectra(path, kind="lamp")  # type: ignore[arg-type]
    with pytest.raises(UnknownNameError, match="no spectrum file format is named 'exr'"):
        read_spectra(path, file_format="exr")
    with pytest.raises(InvalidInputError, match=r"cannot tell the format of 'a\.exr' from its ending"):
        write_spectra(tmp_path / "a.exr", [light])
    with pytest.raises(InvalidInputError, match="a spd file holds one spectrum, got 2"):
        write_spectra(tmp_path / "a.spd", [light, light])
    with pytest.raises(InvalidInputError, match="no spectra to write"):
        write_spectra(tmp_path / "a.csv", [])
    assert sorted(child.name for child in tmp_path.iterdir()) == ["table.csv"]


def test_detection_prefers_the_contents_of_the_file(tmp_path: Path) -> None:
    assert detect_format(file_of(tmp_path, "<IESTM2714/>", "a.csv")) == "spdx"
    assert detect_format(file_of(tmp_path, "400 1\n500 2\n", "a.dat")) == "spd"
    assert detect_format(file_of(tmp_path, "400,1\n500,2\n", "a.dat")) == "csv"


TABLE_TEXT = st.text(st.sampled_from("0123456789.,;\t\n -+eE#:%wnmk\"'()[]<>/x\x00é"), max_size=80)


@settings(max_examples=150)
@given(TABLE_TEXT, st.sampled_from([".csv", ".spd", ".spdx", ".dat"]))
@example("w,x\n1e400,1\n2e400,2\n", ".csv")
@example("400,1\n1e-400,2\n", ".csv")
@example('<IESTM2714><SpectralData wavelength="1">', ".spdx")
@example('"', ".csv")
@example('# kind: "\n400 1\n500 1', ".spd")
def test_any_text_is_read_or_refused_with_its_file(tmp_path: Path, text: str, ending: str) -> None:
    path = tmp_path / f"any{ending}"
    path.write_bytes(text.encode("utf-8"))
    try:
        spectra = read_spectra(path)
    except FileFormatError as error:
        assert str(path) in str(error)
    else:
        assert all(spectrum.grid.size == spectrum.values.size for spectrum in spectra)


def test_points_in_names_leave_decimal_commas(tmp_path: Path) -> None:
    """``paint No. 1`` was taken for a number with a decimal point, and the table was refused."""
    across = file_of(tmp_path, "paint;400;410,5;420\nNo. 1;0,5;0,6;0,7\nNo. 2;0,1;0,2;0,3\n")
    spectra = read_spectra(across)
    assert [spectrum.name for spectrum in spectra] == ["No. 1", "No. 2"]
    assert spectra[0].grid.wavelengths_nm.tolist() == [400, 410.5, 420]
    assert spectra[1].values.tolist() == [0.1, 0.2, 0.3]


@pytest.mark.parametrize("text", ["400,1_0\n500,2\n", "4_00,1\n500,2\n", "wavelength,a\n400,.1\n500,1_1\n"])
def test_underscores_are_not_part_of_numbers(tmp_path: Path, text: str) -> None:
    """Python reads 1_0 as 10."""
    with pytest.raises(FileFormatError):
        read_spectra(file_of(tmp_path, text))
