# SPDX-License-Identifier: GPL-3.0-or-later
"""Classes of integer dilations: matrices K with a given polynomial that differ by more than a change of basis.

The thesis leaves this enumeration open. By Latimer, MacDuffee and Taussky the classes of integer matrices with an
irreducible characteristic polynomial p, up to unimodular change of basis, are the classes of fractional ideals of
Z[x]/(p), the non-invertible ones included. For rates 2 and 3 and n from 2 to 10 they were computed with PARI, class
groups certified without assumption: the class number is 1 throughout, so the companion matrix is the only class
except where Z[x]/(p) is not the maximal order. Those few extra classes are tabled here as matrices.
"""

from __future__ import annotations

import functools
import json
from dataclasses import dataclass
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_kind, require_whole
from spectral_core.errors import InvalidInputError
from spectral_core.lattice.polynomials import (
    CharacteristicPolynomial,
    characteristic_polynomials,
    has_square_factor,
)


@dataclass(frozen=True, order=True)
class LatticeClass:
    """One class of dilations: a polynomial, and the number of its ideal class (0 is that of the companion matrix)."""

    polynomial: CharacteristicPolynomial
    index: int = 0

    def __post_init__(self) -> None:
        require_kind("the polynomial of a lattice class", self.polynomial, CharacteristicPolynomial)
        known = len(_extra_matrices(self.polynomial)) + 1
        if not 0 <= require_whole("the class index", self.index, -1 << 31, 1 << 31) < known:
            raise InvalidInputError(
                f"class index is {self.index}; {self.polynomial} has {known} known class(es), counted from 0"
            )

    @property
    def dilation(self) -> NDArray[np.int64]:
        """The integer dilation K, (n, n), that represents the class."""
        if self.index == 0:
            return self.polynomial.companion()
        return np.array(_extra_matrices(self.polynomial)[self.index - 1], dtype=np.int64)

    def __str__(self) -> str:
        return f"{self.polynomial}" + (f", ideal class {self.index}" if self.index else "")


@dataclass(frozen=True)
class Enumeration:
    """All known classes of a dimension and rate, and True if the list is complete."""

    classes: tuple[LatticeClass, ...]
    complete: bool
    reason: str
    """Reason for the completeness of the list, or the open cases."""


def lattice_classes(dimensions: int, rate: int, *, improper: bool | None = False) -> Enumeration:
    """Known classes of dilations, and a statement on the completeness of the list."""
    polynomials = characteristic_polynomials(dimensions, rate, improper=improper)
    classes = tuple(LatticeClass(p, i) for p in polynomials for i in range(len(_extra_matrices(p)) + 1))
    if dimensions == 1:
        return Enumeration(classes, True, "one dimension has one lattice, Z")
    if rate in (2, 3) and dimensions <= 10:
        return Enumeration(
            classes, True, "class groups certified; ideal class monoids enumerated (see docs/lattice.md)"
        )
    if has_square_factor(rate):
        reason = f"rate {rate} has a square factor, so polynomials other than trinomials may exist"
    elif rate in (2, 3):
        reason = f"class groups were certified up to dimension 10, not for {dimensions}"
    else:
        reason = f"rate {rate} has class numbers above 1 in some dimensions; only companion matrices are listed"
    return Enumeration(classes, False, reason)


@functools.cache
def _table() -> dict[str, list[list[list[int]]]]:
    text = resources.files("spectral_core.lattice").joinpath("extra_classes.json").read_text("utf-8")
    table: dict[str, list[list[list[int]]]] = json.loads(text)["classes"]
    return table


def _extra_matrices(polynomial: CharacteristicPolynomial) -> list[list[list[int]]]:
    if polynomial.improper:
        return []
    return _table().get(f"{polynomial.dimensions},{polynomial.rate},{polynomial.middle}", [])
