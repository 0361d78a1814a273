# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays whose numbers are not what they seem are refused where they enter."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from spectral_core.checks import frozen_array, require_range, require_whole
from spectral_core.errors import InvalidInputError
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid
from spectral_core.volume.field import ScalarVolume

GRID = SpectralGrid([400, 500, 600])
PARTLY = np.ma.masked_greater([0.1, 0.2, 9.0], 1.0)


@pytest.mark.parametrize(
    "make",
    [
        lambda: frozen_array("x", PARTLY),
        lambda: Reflectance("paint", GRID, PARTLY),
        lambda: SpectralGrid(np.ma.masked_equal([400.0, 500.0, 999.0], 999.0)),
        lambda: ScalarVolume("v", np.ma.masked_less(np.linspace(0, 1, 24).reshape(2, 3, 4), 0.02)),
    ],
)
def test_masked_values_are_refused(make: Callable[[], object]) -> None:
    """NumPy dropped the mask: what lay under it, such as 1e20, became data."""
    with pytest.raises(InvalidInputError, match=r"holds 1 masked value\(s\); fill them or leave them out"):
        make()


def test_a_masked_array_without_masked_values_is_an_array() -> None:
    assert frozen_array("x", np.ma.array([1.0, 2.0])).tolist() == [1.0, 2.0]


def test_complex_numbers_are_refused() -> None:
    """NumPy dropped the imaginary part of arrays, though not of lists."""
    with pytest.raises(InvalidInputError, match="spectrum 'paint' holds complex numbers; expected real ones"):
        Reflectance("paint", GRID, np.array([0.1 + 1j, 0.2, 0.3]))
    assert frozen_array("x", np.array([1j]), dtype=np.complex128)[0] == 1j


@pytest.mark.parametrize(
    ("values", "shape", "said"),
    [
        (0.5, (None,), r"shape \(\); expected a list of numbers"),
        ([1, 2], (3,), r"shape \(2,\); expected a list of 3 numbers"),
        ([1, 2], (None, 3), r"shape \(2,\); expected any×3"),
        ([1, 2], (), r"shape \(2,\); expected a single number"),
    ],
)
def test_a_wrong_shape_is_said_in_words(values: object, shape: tuple[int | None, ...], said: str) -> None:
    with pytest.raises(InvalidInputError, match=said):
        frozen_array("x", values, shape)  # type: ignore[arg-type]


def test_wavelengths_in_place_of_a_grid_are_refused() -> None:
    """The message was "'list' object has no attribute 'size'"."""
    with pytest.raises(InvalidInputError, match="'lamp' is of type list; expected a SpectralGrid, such as"):
        Illuminant("lamp", [400, 500], [1.0, 2.0])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("wavelengths", "got"), [([], "none"), ([500], "500"), ([700, 600, 500, 400, 300], r"700, 600, 500, 400, … \(5\)")]
)
def test_a_faulty_grid_is_quoted(wavelengths: list[float], got: str) -> None:
    """The message of an empty grid was "got 0 from inf to 0"."""
    with pytest.raises(InvalidInputError, match=f"without repeats; got {got}$"):
        SpectralGrid(wavelengths)  # type: ignore[arg-type]


@pytest.mark.parametrize("text", ["5", " 5.0 ", b"5", np.str_("5"), ""])
@pytest.mark.parametrize("require", [require_range, require_whole])
def test_text_is_no_number(text: object, require: Callable[..., object]) -> None:
    """It passed, and was kept as text, with which nothing can be computed later."""
    with pytest.raises(InvalidInputError, match="size is .*, a text; expected a number, without quotes"):
        require("size", text, 0, 10)
    assert require("size", np.float32(5), 0, 10) == 5


@pytest.mark.parametrize("wavelengths", ["blue", ["500 nm"], [500.0, None], [[500.0], [510.0, 520.0]], 5j, PARTLY])
def test_what_is_no_wavelength_is_refused(wavelengths: object) -> None:
    """The errors were those of NumPy; masked values and imaginary parts were dropped."""
    for call in (Reflectance("paint", GRID, [0.1, 0.2, 0.3]).at, GRID.values_from_knots):
        with pytest.raises(InvalidInputError, match="wavelengths (must be real numbers|holds 1 masked value)"):
            call(wavelengths)  # type: ignore[arg-type]


def test_a_matrix_of_wavelengths_has_values_but_no_rows() -> None:
    points = np.array([[400.0, 450.0], [550.0, 610.0]])
    assert Reflectance("paint", GRID, [0.1, 0.2, 0.3]).at(points) == pytest.approx(np.array([[0.1, 0.15], [0.25, 0.0]]))
    with pytest.raises(InvalidInputError, match=r"wavelengths has shape \(2, 2\); expected a list of numbers, or one"):
        GRID.values_from_knots(points)
