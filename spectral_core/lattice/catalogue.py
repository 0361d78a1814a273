# SPDX-License-Identifier: GPL-3.0-or-later
"""Ready lattices: the best class and scales found for a dimension, rate and criterion, frozen for n to 10, and for
packing to 16.

The frozen scales come from the searches of ``optimization`` and ``covering`` with many starts over every class
(``python -m benchmarks lattice-acceptance`` checks them); a ready lattice costs a dictionary lookup.
"""

from __future__ import annotations

import functools
import json
from dataclasses import dataclass
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import require_whole
from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.lattice.classes import LatticeClass, lattice_classes
from spectral_core.lattice.construction import Lattice, build_lattice, class_of
from spectral_core.lattice.polynomials import CharacteristicPolynomial

CRITERIA = ("second_moment", "packing", "covering")
"""Goals of frozen scales: mean squared distance, least distance of two points, largest distance to a point."""
MAX_FROZEN_DIMENSIONS = 10
"""Of all criteria; the scales for packing go to 16."""


@dataclass(frozen=True)
class FrozenScales:
    """A class, its scales and their figures of merit."""

    lattice_class: LatticeClass
    log_scales: NDArray[np.float64]
    value: float
    """Second moment, packing radius or covering radius at unit density, by the criterion."""
    exact: bool
    """True if ``value`` is exact for these scales; else it is an estimate (see docs/lattice.md)."""


def make_lattice(
    dimensions: int,
    rate: int = 2,
    *,
    criterion: str = "second_moment",
    middle: int | None = None,
    improper: bool = False,
    log_scales: ArrayLike | None = None,
) -> Lattice:
    """A lattice with rotational dilation of ``rate`` in 1 to 16 dimensions; microseconds after the first call.

    ``criterion`` is second_moment (default), packing, covering or unit (S = I). ``improper`` admits lattices whose
    similarity contains a reflection where they are better. Given ``middle`` (the coefficient C) or ``log_scales`` (r,),
    the companion lattice of that polynomial is built with these scales instead (S = I without them).

    Raises InvalidInputError if no scales are frozen (n above 10 except for packing, rates other than 2 and 3): build
    with criterion="unit", or search with ``optimize_packing`` or ``optimize_second_moment``.
    """
    dimensions, rate = (
        require_whole(name, value, low, 1 << 30)
        for name, value, low in (("dimensions", dimensions, 1), ("rate", rate, 2))
    )
    if criterion not in (*CRITERIA, "unit"):
        raise UnknownNameError.among("lattice criterion", str(criterion), (*CRITERIA, "unit"))
    if middle is not None or log_scales is not None or criterion == "unit":
        proper_middle = _widest_middle(dimensions, rate) if middle is None and not improper else middle
        return build_lattice(class_of(dimensions, rate, proper_middle, improper=improper), log_scales)
    return _frozen_lattice(int(dimensions), int(rate), criterion, bool(improper))


def sampling_lattice(dimensions: int, rate: int = 2) -> Lattice:
    """Default lattice of points: the largest frozen packing radius.

    For rates other than 2 and 3 it is the lattice with unit scales: its separation is smaller.
    """
    frozen = f"{dimensions},{rate}" in _table()
    return make_lattice(dimensions, rate, criterion="packing" if frozen else "unit")


def frozen_scales(dimensions: int, rate: int, criterion: str, *, improper: bool = False) -> FrozenScales:
    """The class and scales of a criterion from the shipped table. Raises InvalidInputError if it has none."""
    if criterion not in CRITERIA:
        raise UnknownNameError.among("lattice criterion", str(criterion), CRITERIA)
    CharacteristicPolynomial(dimensions, rate)  # raises for a wrong dimension or rate
    rows = _table().get(f"{dimensions},{rate}", {})
    if criterion not in rows:
        raise InvalidInputError(
            f"no lattice of {dimensions} dimensions and rate {rate} is in the table for {criterion}, which has 1 to "
            f"{MAX_FROZEN_DIMENSIONS} dimensions (16 for packing) and the rates 2 and 3. Take the criterion 'unit', "
            "which needs no table"
        )
    row = rows.get(f"{criterion} improper") if improper else None
    row = row or rows[criterion]
    polynomial = CharacteristicPolynomial(dimensions, rate, row["middle"], row["improper"])
    scales = np.array(row["log_scales"])
    scales.setflags(write=False)
    return FrozenScales(LatticeClass(polynomial, row["index"]), scales, row["value"], row["exact"])


@functools.cache
def _frozen_lattice(dimensions: int, rate: int, criterion: str, improper: bool) -> Lattice:
    frozen = frozen_scales(dimensions, rate, criterion, improper=improper)
    return build_lattice(frozen.lattice_class, frozen.log_scales, criterion=criterion)


def _widest_middle(dimensions: int, rate: int) -> int | None:
    """The proper C of largest absolute value, positive: with S = I it has the best packing, and it is never a plain
    grid.
    """
    if dimensions % 2:
        return None
    return max(one.polynomial.middle for one in lattice_classes(dimensions, rate).classes)


@functools.cache
def _table() -> dict[str, dict[str, dict[str, Any]]]:
    text = resources.files("spectral_core.lattice").joinpath("frozen_scales.json").read_text("utf-8")
    table: dict[str, dict[str, dict[str, Any]]] = json.loads(text)["scales"]
    return table
