# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of a palette's input: numbers, sequences, references to cells, types; and the names of cells in messages."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array
from spectral_core.errors import InvalidInputError, counted

if TYPE_CHECKING:
    from spectral_core.palette.problem import PaletteProblem

Array = NDArray[np.float64]
CellIndex = tuple[int, int]
"""(reflectance, light): row and column of a cell."""


def number_of(name: str, value: object) -> float:
    if isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool):
        return float(value)
    raise InvalidInputError(f"{name} is {value!r}; expected a number")


def sequence_of(name: str, values: object) -> tuple[Any, ...]:
    is_number = isinstance(values, np.ndarray) and values.ndim == 0  # it counts as iterable
    if is_number or isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise InvalidInputError(f"{name}: got {values!r}; expected a tuple")
    return tuple(values)


def require_bounds(name: str, bounds: object) -> None:
    """Raise InvalidInputError unless ``bounds`` are two numbers, the lower one first."""
    found = sequence_of(name, bounds)
    if len(found) != 2:
        raise InvalidInputError(f"{name} are {found}; expected the lower and the upper one")
    low, high = (number_of(f"a bound of {name}", bound) for bound in found)
    if not low < high:
        raise InvalidInputError(f"{name} are ({low}, {high}); expected the lower one first")


def cell_index_of(other: object) -> CellIndex:
    """(reflectance, light) as two whole numbers."""
    if isinstance(other, tuple | list) and len(other) == 2 and all(isinstance(k, int | np.integer) for k in other):
        return int(other[0]), int(other[1])
    raise InvalidInputError(f"a cell refers to {other!r}; expected (reflectance, light), two whole numbers")


def require_each(name: str, values: Iterable[object], kind: type, expected: str) -> None:
    """Raise InvalidInputError that names the first of ``values`` which is not of ``kind``, by its number."""
    for number, value in enumerate(values):
        if not isinstance(value, kind):
            raise InvalidInputError(f"{name}[{number}] is {shown(value)}; expected {expected}")


def shown(value: object) -> str:
    """The value as Python writes it; only its type where that would take more than a line."""
    written = repr(value)
    return written if len(written) <= 80 and "\n" not in written else f"of type {type(value).__name__}"


def light_and_color(pair: object) -> tuple[Any, ArrayLike]:
    """The two parts of an exact color."""
    found = sequence_of("an exact color", pair)
    if len(found) != 2:
        raise InvalidInputError(f"an exact color has {counted(len(found), 'part')}; expected a light and its color")
    return found[0], found[1]


def color_ends(color: ArrayLike) -> Array:
    """Least and greatest color (2, 3) of an exact color or of a range."""
    ends = np.array(color) if np.shape(color) == (2, 3) else np.zeros(0)
    if ends.size and ends.dtype.kind in "fiu" and not np.isnan(ends).any() and np.all(ends[0] <= ends[1]):
        return ends
    return np.stack([frozen_array("exact color", color, (3,))] * 2)


def cell_name(problem: PaletteProblem, cell: CellIndex) -> str:
    """“Red” under “D65”."""
    rows, columns = [item.name for item in problem.reflectances], [light.name for light in problem.lights]
    return f"{told_apart(rows, cell[0])} under {told_apart(columns, cell[1])}"


def told_apart(names: list[str], index: int) -> str:
    """A name in quotes, with its number if another item has the same name."""
    return f"“{names[index]}”" + (f" ({index + 1})" if names.count(names[index]) > 1 else "")
