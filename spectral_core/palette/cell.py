# SPDX-License-Identifier: GPL-3.0-or-later
"""A cell of a palette: the request for one material under one light."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, read_only_when_copied, require_finite, require_range
from spectral_core.errors import InvalidInputError, UnknownNameError, counted
from spectral_core.palette.given import CellIndex, cell_index_of, number_of, sequence_of

Array = NDArray[np.float64]

LARGEST = 1e30
"""Largest weight, color and power: the squares of their products fit into double precision."""


class CellMode(StrEnum):
    """Types of requests."""

    FIXED = "fixed"
    FREE = "free"
    SAME = "same"
    BLACK = "black"
    CONSTANT = "constant"
    DISTINCT = "distinct"
    IGNORE = "ignore"


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class Cell:
    """The request for one reflectance under one light. Its class methods name the arguments of each mode."""

    mode: CellMode = CellMode.IGNORE
    target: Array | None = None
    """FIXED: linear RGB (3,)."""
    others: tuple[CellIndex, ...] = ()
    """SAME: the cell to equal. CONSTANT: cells of the same row. DISTINCT: the cells to differ from."""
    box: tuple[Array, Array] | None = None
    """FREE, SAME, CONSTANT: least and greatest linear RGB, (3,) each, of the free color."""
    weight: float = 1.0
    exact: bool = False
    """An equality instead of a weighted least-squares row."""

    def __post_init__(self) -> None:
        self._check_kinds()
        if (self.target is not None) != (self.mode is CellMode.FIXED):
            raise InvalidInputError(
                f"a cell of mode {self.mode} with target {self.target}; 'fixed' and only it has one"
            )
        if self.target is not None:
            target = frozen_array("the target color of a cell", self.target, (3,))
            require_size("the target color of a cell", target)
            object.__setattr__(self, "target", target)
        needs_others = self.mode in (CellMode.SAME, CellMode.CONSTANT, CellMode.DISTINCT)
        if bool(self.others) != needs_others or (self.mode is CellMode.SAME and len(self.others) != 1):
            raise InvalidInputError(
                f"a cell of mode {self.mode} refers to {counted(len(self.others), 'other cell')}; 'same' takes "
                "one, 'constant' and 'distinct' at least one, all other modes none"
            )
        if self.box is not None:
            low, high = _box_ends(self.box)
            self._freeze_box(low, high)
        require_range("the weight of a cell", self.weight, 0.0, LARGEST)

    def _check_kinds(self) -> None:
        """Raise InvalidInputError for a wrong mode, number or reference, before anything is computed."""
        try:
            object.__setattr__(self, "mode", CellMode(self.mode))
        except ValueError:
            raise UnknownNameError.among("cell mode", str(self.mode), [mode.value for mode in CellMode]) from None
        object.__setattr__(self, "weight", number_of("the weight of a cell", self.weight))
        object.__setattr__(self, "others", tuple(cell_index_of(other) for other in sequence_of("others", self.others)))
        if not isinstance(self.exact, (bool, np.bool_)):
            raise InvalidInputError(f"exact of a cell is {self.exact!r}; expected True or False")

    def _freeze_box(self, low: ArrayLike, high: ArrayLike) -> None:
        if self.mode not in (CellMode.FREE, CellMode.SAME, CellMode.CONSTANT):
            raise InvalidInputError(f"a cell of mode {self.mode} has a color box; only free colors are held in one")
        ends = _box_end("the box's least color", low), _box_end("the box's greatest color", high)
        if np.any(ends[0] > ends[1]):
            raise InvalidInputError(f"the color box runs from {ends[0].tolist()} to {ends[1].tolist()}; swap its ends")
        object.__setattr__(self, "box", ends)

    @classmethod
    def fixed(cls, linear_rgb: ArrayLike, *, weight: float = 1.0, exact: bool = False) -> Self:
        """The color ``linear_rgb`` (3,)."""
        return cls(CellMode.FIXED, _raw(linear_rgb), weight=weight, exact=exact)

    @classmethod
    def free(cls, box: tuple[ArrayLike, ArrayLike] | None = None, *, weight: float = 1.0, exact: bool = False) -> Self:
        """Any color, or any color in ``box`` (least and greatest linear RGB)."""
        return cls(CellMode.FREE, box=_box(box), weight=weight, exact=exact)

    @classmethod
    def same_as(
        cls,
        other: CellIndex,
        *,
        box: tuple[ArrayLike, ArrayLike] | None = None,
        weight: float = 1.0,
        exact: bool = False,
    ) -> Self:
        """The same color as cell ``other`` = (reflectance, light), which may itself be free (Eq. 5.15): a metamer."""
        return cls(CellMode.SAME, others=(other,), box=_box(box), weight=weight, exact=exact)

    @classmethod
    def black(cls, *, weight: float = 1.0, exact: bool = False) -> Self:
        """No color at all: a metameric black (section 5.4.4)."""
        return cls(CellMode.BLACK, weight=weight, exact=exact)

    @classmethod
    def constant(cls, *others: CellIndex, weight: float = 1.0, exact: bool = False) -> Self:
        """The color of this reflectance in ``others``, cells of its row: object color constancy."""
        return cls(CellMode.CONSTANT, others=tuple(others), weight=weight, exact=exact)

    @classmethod
    def distinct_from(cls, *others: CellIndex, weight: float = 1.0) -> Self:
        """As different as possible from ``others``."""
        return cls(CellMode.DISTINCT, others=tuple(others), weight=weight)

    @classmethod
    def ignore(cls) -> Self:
        """No request."""
        return cls()


def _box(box: tuple[ArrayLike, ArrayLike] | None) -> tuple[Array, Array] | None:
    if box is None:
        return None
    return _box_ends(box)


def _box_ends(box: object) -> tuple[Array, Array]:
    ends = sequence_of("the box of a cell", box)
    if len(ends) != 2:
        raise InvalidInputError(
            f"the box of a cell has {counted(len(ends), 'end')}; expected the least and the greatest color"
        )
    return _raw(ends[0]), _raw(ends[1])


def require_size(name: str, values: Array) -> None:
    """Raise InvalidInputError for numbers whose weighted squares exceed double precision."""
    require_range(f"the largest number of {name}", float(np.abs(values).max(initial=0.0)), 0.0, LARGEST)


def _raw(values: ArrayLike) -> Array:
    """Numbers as given; ``Cell`` checks and freezes them."""
    return values  # type: ignore[return-value]


def _box_end(name: str, values: ArrayLike) -> Array:
    """An end of a box, (3,): any number, or infinity for an open side; never NaN."""
    try:
        end = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"{name} must be three numbers; {error}") from error
    if end.shape != (3,):
        raise InvalidInputError(f"{name} has shape {end.shape}; expected 3")
    require_finite(name, np.where(np.isinf(end), 0.0, end))
    require_size(name, np.where(np.isinf(end), 0.0, end))
    end.setflags(write=False)
    return end
