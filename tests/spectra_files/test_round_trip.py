# SPDX-License-Identifier: GPL-3.0-or-later
"""Round trips: bit-exact numbers, types, names, grids and sources."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spectral_core.errors import InvalidInputError
from spectral_core.spectra import catalogue
from spectral_core.spectra.files import read_spectra, read_spectrum, write_spectra
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, Spectrum

KINDS = {"illuminant": Illuminant, "reflectance": Reflectance, "spectrum": Spectrum}


@st.composite
def spectra(draw: st.DrawFn) -> Spectrum:
    wavelengths = draw(
        st.lists(st.floats(200, 3000, allow_subnormal=False), min_size=2, max_size=12, unique=True).map(sorted)
    )
    kind = draw(st.sampled_from(sorted(KINDS)))
    low, high = {"illuminant": (0, 1e6), "reflectance": (0, 1), "spectrum": (-1e6, 1e6)}[kind]
    values = draw(st.lists(st.floats(low, high), min_size=len(wavelengths), max_size=len(wavelengths)))
    text = st.text(st.characters(categories=["L", "N", "P", "S"], include_characters=" "), max_size=20)
    name = " ".join(draw(text).split()) or "unnamed"
    grid = SpectralGrid(np.array(wavelengths), draw(st.sampled_from(["linear", "sampled"])))
    return KINDS[kind](name, grid, np.array(values), source=" ".join(draw(text).split()))


def assert_same(read: Spectrum, written: Spectrum, path: Path) -> None:
    assert type(read) is type(written)
    assert read.name == written.name
    assert read.source == (written.source or path.name)
    assert read.grid.same_as(written.grid)
    np.testing.assert_array_equal(read.values, written.values)


COMMON = settings(max_examples=60)


@COMMON
@given(st.lists(spectra(), min_size=1, max_size=4))
def test_csv_keeps_any_spectra_on_any_grids(tmp_path: Path, written: list[Spectrum]) -> None:
    path = tmp_path / "table.csv"
    write_spectra(path, written)
    read = read_spectra(path)
    assert len(read) == len(written)
    for one, other in zip(read, written, strict=True):
        assert_same(one, other, path)


@COMMON
@given(spectra(), st.sampled_from([".spd", ".spdx"]))
def test_formats_of_one_spectrum_keep_it(tmp_path: Path, written: Spectrum, ending: str) -> None:
    path = tmp_path / f"one{ending}"
    write_spectra(path, [written])
    if not (ending == ".spdx" and written.name == "None"):
        assert_same(read_spectrum(path), written, path)


@pytest.mark.parametrize("ending", [".csv", ".spd", ".spdx"])
@pytest.mark.parametrize(
    "spectrum", [catalogue.illuminant("HP1"), catalogue.reflectance("dark skin")], ids=["light", "surface"]
)
def test_shipped_spectra_are_kept(tmp_path: Path, ending: str, spectrum: Spectrum) -> None:
    path = tmp_path / f"shipped{ending}"
    write_spectra(path, [spectrum])
    assert_same(read_spectrum(path), spectrum, path)


def test_one_table_can_have_lights_and_surfaces(tmp_path: Path) -> None:
    written = [catalogue.illuminant("D65"), catalogue.reflectance("dark skin"), catalogue.illuminant("LPS")]
    write_spectra(tmp_path / "mixed.csv", written)
    read = read_spectra(tmp_path / "mixed.csv")
    assert [type(spectrum) for spectrum in read] == [Illuminant, Reflectance, Illuminant]
    assert [spectrum.grid.size for spectrum in read] == [spectrum.grid.size for spectrum in written]


def test_a_file_without_its_ending_is_recognized_by_its_contents(tmp_path: Path) -> None:
    light = catalogue.illuminant("A")
    for file_format in ("csv", "spd", "spdx"):
        path = tmp_path / f"{file_format}.dat"
        write_spectra(path, [light], file_format=file_format)
        np.testing.assert_array_equal(read_spectrum(path).values, light.values)


@pytest.mark.parametrize("ending", ["csv", "spd", "spdx"])
@pytest.mark.parametrize("name", ["5014", "1e3", "nan"])
def test_names_that_look_like_something_else_are_kept(tmp_path: Path, ending: str, name: str) -> None:
    spectrum = Spectrum(name, SpectralGrid.uniform(800, 1000, 100), np.array([0.1, 0.2, 0.3]))
    write_spectra(tmp_path / f"x.{ending}", [spectrum])
    assert_same(read_spectrum(tmp_path / f"x.{ending}"), spectrum, tmp_path / f"x.{ending}")


@pytest.mark.parametrize("names", [("5014", "5015"), ("900", "950", "1000"), ("1", "2")])
def test_numbers_as_names_of_infrared_spectra_do_not_turn_the_table(tmp_path: Path, names: tuple[str, ...]) -> None:
    grid = SpectralGrid.uniform(800, 1000, 100)
    written = [Spectrum(name, grid, np.array([0.1, 0.2, 0.3]) * number) for number, name in enumerate(names, 1)]
    write_spectra(tmp_path / "x.csv", written)
    for read, spectrum in zip(read_spectra(tmp_path / "x.csv"), written, strict=True):
        assert_same(read, spectrum, tmp_path / "x.csv")


@pytest.mark.parametrize("ending", [".csv", ".spd", ".spdx"])
@pytest.mark.parametrize("knots", [[0.1, 400.0], [9.9, 700.0], [400.0, 1.1e6]])
def test_wavelengths_that_would_be_refused_are_not_written(tmp_path: Path, ending: str, knots: list[float]) -> None:
    """They were written, and the file could not be read."""
    path = tmp_path / f"far{ending}"
    with pytest.raises(InvalidInputError, match="a file holds 10 to 1e"):
        write_spectra(path, [Spectrum("far", SpectralGrid(knots), [1.0, 2.0])])
    assert not path.exists()
