# SPDX-License-Identifier: GPL-3.0-or-later
"""Units and quantities that tables and SPDX files state in their own words."""

from pathlib import Path

import pytest

from spectral_core.errors import FileFormatError
from spectral_core.spectra.files import read_spectra
from spectral_core.spectra.spectrum import Reflectance, SpectralGrid


@pytest.mark.parametrize(
    "heading",
    ["Reflectance (%) SCI", "R (%) paint", "Percent reflectance", "Reflectance (in %)", "R%_a", "R [%], 8 degrees"],
)
@pytest.mark.parametrize("across", [False, True])
def test_percent_is_stated_anywhere_in_a_heading(tmp_path: Path, heading: str, across: bool) -> None:
    """A dark surface in percent is not read as fractions, in columns and in rows."""
    file = tmp_path / "dark.csv"
    file.write_text(f'"{heading}";400;500\npaint;0.5;0.6\n' if across else f'nm;"{heading}"\n400;0.5\n500;0.6\n')

    (dark,) = read_spectra(file, kind="reflectance")

    assert dark.values.tolist() == pytest.approx([0.005, 0.006], rel=1e-12)


@pytest.mark.parametrize("heading", ["50% gray", "50 % gray", "20 percent gray"])
def test_a_share_in_a_name_is_no_unit(tmp_path: Path, heading: str) -> None:
    """A percent sign behind a number belongs to the name."""
    file = tmp_path / "gray.csv"
    file.write_text(f"nm,{heading}\n400,0.5\n500,0.6\n")

    (gray,) = read_spectra(file, kind="reflectance")

    assert (gray.name, gray.values.tolist()) == (heading, [0.5, 0.6])


def test_separators_at_the_end_of_lines_are_no_columns_of_a_table_across(tmp_path: Path) -> None:
    """A spreadsheet ends each line with the separators of its widest line."""
    file = tmp_path / "across.csv"
    file.write_text("Name,400,500,600,,\nA,0.1,0.2,0.3,,\n")

    (surface,) = read_spectra(file, kind="reflectance")

    assert (surface.name, surface.values.tolist()) == ("A", [0.1, 0.2, 0.3])


@pytest.mark.parametrize(
    ("text", "kind", "message"),
    [
        ("nm\tcounts\n400\t987\n410\t1,234\n", "illuminant", "line 3: '1,234' beside whole numbers may be 1234"),
        ("n,Wavelength,R\n380,400,0.5\n381,500,0.6\n", None, "'Wavelength' heads column 2; expected the wavelengths"),
        ("nm,Absorbance\n400,0.5\n500,0.6\n", "reflectance", "'Absorbance' is no reflectance"),
        ("nm,Abs.\n400,0.5\n500,0.6\n", "reflectance", "'Abs.' is no reflectance"),
        ("nm,OD\n400,0.5\n500,0.6\n", "reflectance", "'OD' is no reflectance"),
        ("nm,Absorptance\n400,0.5\n500,0.6\n", "illuminant", "'Absorptance' is no illuminant"),
        ("n,nm,W\n380,400,0.5\n381,500,0.6\n", None, "'nm' heads column 2; expected the wavelengths"),
        ("nm,Photon flux\n400,0.5\n500,0.6\n", "illuminant", "'Photon flux' is no illuminant"),
        ("nm,PPFD (umol/m2/s/nm)\n400,0.5\n500,0.6\n", "illuminant", "is no illuminant"),
        ("nm,Reflectance\n400,0.5\n500,0.6\n", "illuminant", "'Reflectance' is no illuminant"),
        ("nm,Irradiance (W/m2)\n400,0.5\n500,0.6\n", "reflectance", "is no reflectance"),
        ("Device: x\n400\t0.1\n500\t0.2\n", None, "remove other lines above the table, or begin them with '#'"),
    ],
)
def test_numbers_of_another_meaning_are_refused(tmp_path: Path, text: str, kind: str | None, message: str) -> None:
    """A file that states that its numbers are something else is not read as a spectrum of that kind."""
    file = tmp_path / "other.txt"
    file.write_text(text)

    with pytest.raises(FileFormatError, match=message.replace("(", r"\(")):
        read_spectra(file, kind=kind)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("name", "kind"), [("Radiance Pearl", "reflectance"), ("Abs Blue", "reflectance"), ("Photonics LED", "illuminant")]
)
def test_names_that_begin_like_quantities_are_names(tmp_path: Path, name: str, kind: str) -> None:
    """A heading of several words may be a product."""
    file = tmp_path / "named.csv"
    file.write_text(f"nm,{name}\n400,0.5\n500,0.6\n")

    (found,) = read_spectra(file, kind=kind)  # type: ignore[arg-type]

    assert found.name == name


def test_decimal_commas_of_three_places_are_read(tmp_path: Path) -> None:
    """Numbers of one format are not ambiguous: separators of thousands stand beside whole numbers."""
    file = tmp_path / "comma.csv"
    file.write_text("nm;a;b\n400;1,234;0,125\n500;12,345;0\n600;2,000;1\n")

    first, second = read_spectra(file, kind="illuminant")

    assert first.values.tolist() == [1.234, 12.345, 2.0]
    assert second.values.tolist() == [0.125, 0.0, 1.0]


def test_own_files_are_read_back_whatever_their_names(tmp_path: Path) -> None:
    """The kind that a file states has priority over a name that is like a quantity."""
    from spectral_core.spectra.files import write_spectra

    names = ["Absorbance sample", "R (%) SCI", "Irradiance", "50% gray"]
    written = [Reflectance(name, SpectralGrid([400.0, 500.0]), [0.5, 0.25]) for name in names]  # type: ignore[arg-type]
    write_spectra(tmp_path / "own.csv", written)

    found = read_spectra(tmp_path / "own.csv", kind="reflectance")

    assert [(each.name, each.values.tolist()) for each in found] == [(name, [0.5, 0.25]) for name in names]


SPDX = (
    '<IESTM2714 version="1.0"><Header><Description>a</Description></Header><SpectralDistribution>'
    '<SpectralQuantity>{quantity}</SpectralQuantity><SpectralData wavelength="400">0.5</SpectralData>'
    '<SpectralData wavelength="500">0.6</SpectralData></SpectralDistribution>{more}</IESTM2714>'
)


@pytest.mark.parametrize(
    ("quantity", "kind", "is_read"),
    [
        ("absorptance", "reflectance", False),
        ("absorptance", "illuminant", False),
        ("transmittance", "illuminant", False),
        ("T-Factor", "illuminant", False),
        ("transmittance", "reflectance", True),
        ("absorptance", "spectrum", True),
    ],
)
def test_spdx_quantities_are_not_read_as_others(tmp_path: Path, quantity: str, kind: str, is_read: bool) -> None:
    """The absorptance of a paint is no reflectance, and a filter is no lamp."""
    file = tmp_path / "a.spdx"
    file.write_text(SPDX.format(quantity=quantity, more=""))

    if is_read:
        assert len(read_spectra(file, kind=kind)) == 1  # type: ignore[arg-type]
        return
    with pytest.raises(FileFormatError, match=f"SpectralQuantity is '{quantity}'"):
        read_spectra(file, kind=kind)  # type: ignore[arg-type]


def test_spdx_with_two_distributions_is_refused(tmp_path: Path) -> None:
    """Two measurements in a file were joined to one spectrum if their wavelengths rose."""
    file = tmp_path / "two.spdx"
    more = '<SpectralDistribution><SpectralData wavelength="600">1</SpectralData></SpectralDistribution>'
    file.write_text(SPDX.format(quantity="flux", more=more))

    with pytest.raises(FileFormatError, match="a second SpectralDistribution; expected one"):
        read_spectra(file)
