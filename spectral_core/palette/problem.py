# SPDX-License-Identifier: GPL-3.0-or-later
"""What is asked of a palette: lights in columns, reflectances in rows, and a wish for each cell where they meet.

Colors are linear sRGB, relative to a perfect white under a light of luminance 1 (see ``spectral_core.spectra.observer
.normalized``). A light of luminance 6 makes a reflectance of 1/6 as bright as white: the thesis' way (section 5.4.1)
to leave reflectances room below 1.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import KW_ONLY, dataclass, replace
from enum import StrEnum
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, require_finite, require_range
from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.spectra.observer import OBSERVER_NAMES, STANDARD
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid

Array = NDArray[np.float64]
CellIndex = tuple[int, int]
"""(reflectance, light): row and column of a cell."""


class CellMode(StrEnum):
    """What a cell asks for."""

    FIXED = "fixed"
    FREE = "free"
    SAME = "same"
    BLACK = "black"
    CONSTANT = "constant"
    DISTINCT = "distinct"
    IGNORE = "ignore"


@dataclass(frozen=True, slots=True, eq=False)
class Cell:
    """The wish for one reflectance under one light. Make one with the class methods; they name what each mode needs."""

    mode: CellMode = CellMode.IGNORE
    target: Array | None = None
    """FIXED: linear RGB (3,)."""
    others: tuple[CellIndex, ...] = ()
    """SAME: the one cell to equal. CONSTANT: cells of the same row. DISTINCT: the cells to differ from."""
    box: tuple[Array, Array] | None = None
    """FREE, SAME, CONSTANT: least and greatest linear RGB, (3,) each, that the free color may take."""
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
            object.__setattr__(self, "target", frozen_array("the target color of a cell", self.target, (3,)))
        needs_others = self.mode in (CellMode.SAME, CellMode.CONSTANT, CellMode.DISTINCT)
        if bool(self.others) != needs_others or (self.mode is CellMode.SAME and len(self.others) != 1):
            raise InvalidInputError(
                f"a cell of mode {self.mode} refers to {len(self.others)} other cells; 'same' takes one, 'constant' "
                "and 'distinct' at least one, all other modes none"
            )
        if self.box is not None:
            self._freeze_box(*self.box)
        require_range("the weight of a cell", self.weight, 0.0, 1e30)

    def _check_kinds(self) -> None:
        """Refuse what is no mode, no number and no cell before anything is computed with it."""
        try:
            object.__setattr__(self, "mode", CellMode(self.mode))
        except ValueError:
            raise UnknownNameError.among("cell mode", str(self.mode), [mode.value for mode in CellMode]) from None
        object.__setattr__(self, "weight", _number("the weight of a cell", self.weight))
        object.__setattr__(self, "others", tuple(_cell_index(other) for other in _sequence("others", self.others)))
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
        """The color of cell ``other`` = (reflectance, light), whatever that becomes (Eq. 5.15): a metamer."""
        return cls(CellMode.SAME, others=(other,), box=_box(box), weight=weight, exact=exact)

    @classmethod
    def black(cls, *, weight: float = 1.0, exact: bool = False) -> Self:
        """No color at all: a metameric black (section 5.4.4)."""
        return cls(CellMode.BLACK, weight=weight, exact=exact)

    @classmethod
    def constant(cls, *others: CellIndex, weight: float = 1.0, exact: bool = False) -> Self:
        """The color that this reflectance has in ``others``, cells of its own row: object color constancy."""
        return cls(CellMode.CONSTANT, others=tuple(others), weight=weight, exact=exact)

    @classmethod
    def distinct_from(cls, *others: CellIndex, weight: float = 1.0) -> Self:
        """As different as possible from ``others``."""
        return cls(CellMode.DISTINCT, others=tuple(others), weight=weight)

    @classmethod
    def ignore(cls) -> Self:
        """No wish."""
        return cls()


def _box(box: tuple[ArrayLike, ArrayLike] | None) -> tuple[Array, Array] | None:
    if box is None:
        return None
    ends = _sequence("the box of a cell", box)
    if len(ends) != 2:
        raise InvalidInputError(f"the box of a cell has {len(ends)} ends; expected the least and the greatest color")
    return _raw(ends[0]), _raw(ends[1])


def _raw(values: ArrayLike) -> Array:
    """Numbers as given; ``Cell`` checks and freezes them."""
    return values  # type: ignore[return-value]


def _box_end(name: str, values: ArrayLike) -> Array:
    """An end of a box, (3,): any number or an infinity, which leaves that side open; never NaN."""
    try:
        end = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"{name} must be three numbers; {error}") from error
    if end.shape != (3,):
        raise InvalidInputError(f"{name} has shape {end.shape}; expected 3")
    require_finite(name, np.where(np.isinf(end), 0.0, end))
    end.setflags(write=False)
    return end


def _number(name: str, value: object) -> float:
    if isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool):
        return float(value)
    raise InvalidInputError(f"{name} is {value!r}; expected a number")


def _sequence(name: str, values: object) -> tuple[Any, ...]:
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise InvalidInputError(f"{name}: got {values!r}; expected a tuple")
    return tuple(values)


def _cell_index(other: object) -> CellIndex:
    """(reflectance, light) as two whole numbers."""
    if isinstance(other, tuple | list) and len(other) == 2 and all(isinstance(k, int | np.integer) for k in other):
        return int(other[0]), int(other[1])
    raise InvalidInputError(f"a cell refers to {other!r}; expected (reflectance, light), two whole numbers")


def _require_kind(name: str, values: Iterable[object], kind: type | tuple[type, ...], expected: str) -> None:
    for number, value in enumerate(values):
        if not isinstance(value, kind):
            raise InvalidInputError(f"{name}[{number}] is {value!r}; expected {expected}")


@dataclass(frozen=True, slots=True, eq=False)
class PaletteLight:
    """A column: a measured light, or one to design from ``spectrum`` on, or amounts of ``primaries``."""

    spectrum: Illuminant
    free: bool = False
    primaries: tuple[Illuminant, ...] = ()
    """LED or lamp spectra that the light is mixed from, amounts at least 0. Empty: any spectrum."""
    white_xyz: Array | None = None
    """Chromaticity that the light itself must have, as any XYZ (3,) of it; None: any."""
    luminance: float | None = None
    """Luminance that a designed light must keep; None: any."""
    variants: tuple[Illuminant, ...] = ()
    """Other lights under which this column's same, black and constant cells should hold too."""

    def __post_init__(self) -> None:
        _require_kind("the spectrum of a light", (self.spectrum,), Illuminant, "an Illuminant")
        for name in ("primaries", "variants"):
            object.__setattr__(self, name, _sequence(f"{name} of light {self.name!r}", getattr(self, name)))
            _require_kind(f"{name} of light {self.name!r}", getattr(self, name), Illuminant, "an Illuminant")
        wishes = {
            "primaries": bool(self.primaries),
            "white_xyz": self.white_xyz is not None,
            "luminance": self.luminance is not None,
        }
        given = [word for word, asked in wishes.items() if asked]
        if given and not self.free:
            raise InvalidInputError(
                f"light {self.name!r} is fixed, so {', '.join(given)} cannot be asked of it; free it"
            )
        if self.free and self.variants:
            raise InvalidInputError(f"light {self.name!r} is designed; only a measured light can have variants")
        if self.white_xyz is not None:
            object.__setattr__(self, "white_xyz", frozen_array("white_xyz", self.white_xyz, (3,)))
            if np.any(np.asarray(self.white_xyz) <= 0):
                raise InvalidInputError(f"white_xyz of light {self.name!r} must be positive; got {self.white_xyz}")
        if self.luminance is not None:
            require_range(f"the luminance of light {self.name!r}", self.luminance, 1e-9, 1e9)

    @property
    def name(self) -> str:
        """The spectrum's name."""
        return self.spectrum.name


@dataclass(frozen=True, slots=True, eq=False)
class PaletteReflectance:
    """A row: a measured surface (``spectrum``), or one to design (None)."""

    name: str
    spectrum: Reflectance | None = None

    def __post_init__(self) -> None:
        if self.spectrum is not None:
            _require_kind(f"the spectrum of {self.name!r}", (self.spectrum,), Reflectance, "a Reflectance, or None")

    @property
    def free(self) -> bool:
        """Whether it is to be designed."""
        return self.spectrum is None


@dataclass(frozen=True, slots=True, eq=False)
class SubspaceCriterion:
    """Weight ω_F of the error that a renderer makes which computes in the basis (Eqs. 5.10 to 5.12).

    ``basis``: (n, m) on the palette's grid, Eq. 5.2. ``componentwise``: products by coefficient, as in the sharpened
    spectral factor model; else by the full matrix R of Eq. 5.7.
    """

    basis: Array
    weight: float = 1.0
    componentwise: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "basis", frozen_array("the subspace basis", self.basis, (None, None)))
        require_range("the weight of the subspace criterion", self.weight, 0.0, 1e30)


@dataclass(frozen=True, slots=True, eq=False)
class PaletteProblem:
    """Lights, reflectances, a wish per cell, and how the wishes are weighed. Build one, or take a preset."""

    grid: SpectralGrid
    lights: tuple[PaletteLight, ...]
    reflectances: tuple[PaletteReflectance, ...]
    cells: tuple[tuple[Cell, ...], ...]
    """``cells[reflectance][light]``."""
    _: KW_ONLY
    smoothness: float = 0.01
    """ω_D of Eq. 5.14: weight of the roughness of every designed spectrum."""
    smoothness_operator: Literal["mended", "thesis"] = "mended"
    """'mended': second derivative, ends mirrored, the same on every grid; 'thesis': Eq. 5.13 as its figures used it."""
    match: Literal["linear", "perceptual"] = "linear"
    """Color errors in linear RGB, or in CIELAB linearized at the wanted color."""
    subspace: SubspaceCriterion | None = None
    reflectance_bounds: tuple[float, float] = (0.0, 1.0)
    light_bounds: tuple[float, float] = (0.0, np.inf)
    """Of light spectra, or of the amounts of primaries. Below 0 only for study: no lamp does it."""
    rounds: int = 1000
    """At most this many rounds of reflectances and lights; they stop when nothing improves. 1 is the thesis' way."""
    scale_lights: bool = False
    """Brighten all lights by one factor until the reflectances fit below their bound (section 5.5)."""
    observers: tuple[str, ...] = (STANDARD,)
    """The first one's colors are the targets; same, black and constant cells should hold for all."""
    robustness: Literal["soft", "worst_case"] = "soft"
    """Further observers and variants: rows of least squares, or the largest of their errors made least."""
    robust_weight: float = 1.0
    """Weight of their rows, relative to each cell's own."""

    def __post_init__(self) -> None:
        for name in ("lights", "reflectances", "observers"):
            object.__setattr__(self, name, _sequence(f"the {name} of a palette", getattr(self, name)))
            if not getattr(self, name):
                raise InvalidInputError(f"a palette needs at least one of its {name}; got none")
        _require_kind("lights", self.lights, PaletteLight, "a PaletteLight")
        _require_kind("reflectances", self.reflectances, PaletteReflectance, "a PaletteReflectance")
        rows = _sequence("the cells of a palette", self.cells)
        object.__setattr__(self, "cells", tuple(_sequence("a row of cells", row) for row in rows))
        self._check_cells()
        self._check_weights()
        for light in self.lights:
            if light.free and not light.primaries:
                light.spectrum.require_grid(self.grid)
        for name in self.observers:
            if name not in OBSERVER_NAMES:
                raise UnknownNameError.among("observer", name, OBSERVER_NAMES)
        if self.subspace is not None and self.subspace.basis.shape[0] != self.grid.size:
            raise InvalidInputError(
                f"the subspace basis has {self.subspace.basis.shape[0]} rows, the grid {self.grid.size} samples"
            )

    def _check_cells(self) -> None:
        shape = (len(self.reflectances), len(self.lights))
        if len(self.cells) != shape[0] or any(len(row) != shape[1] for row in self.cells):
            raise InvalidInputError(
                f"{len(self.cells)} rows of cells with lengths {sorted({len(row) for row in self.cells})}; expected "
                f"{shape[0]} rows (reflectances) of {shape[1]} cells (lights)"
            )
        for i, row in enumerate(self.cells):
            for j, cell in enumerate(row):
                if not isinstance(cell, Cell):
                    raise InvalidInputError(f"cells[{i}][{j}] is {cell!r}; expected a Cell, such as Cell.fixed(rgb)")
                for other in cell.others:
                    self._check_reference((i, j), other, cell.mode)

    def _check_reference(self, here: CellIndex, other: CellIndex, mode: CellMode) -> None:
        inside = 0 <= other[0] < len(self.reflectances) and 0 <= other[1] < len(self.lights)
        if not inside or other == here or (mode is CellMode.CONSTANT and other[0] != here[0]):
            raise InvalidInputError(
                f"cell {here} is {mode} with cell {other}; expected another cell of the table"
                + (" in the same row" if mode is CellMode.CONSTANT else "")
            )

    def _check_weights(self) -> None:
        for name in ("smoothness", "robust_weight"):
            object.__setattr__(self, name, _number(name, getattr(self, name)))
        if not isinstance(self.rounds, int | np.integer):
            raise InvalidInputError(f"rounds is {self.rounds!r}; expected a whole number")
        require_range("smoothness", self.smoothness, 0.0, 1e30)
        require_range("robust_weight", self.robust_weight, 0.0, 1e30)
        require_range("rounds", self.rounds, 1, 100_000)
        for name, choices in (
            ("smoothness_operator", ("mended", "thesis")),
            ("match", ("linear", "perceptual")),
            ("robustness", ("soft", "worst_case")),
        ):
            if getattr(self, name) not in choices:
                raise InvalidInputError(f"{name} is {getattr(self, name)!r}; expected one of {', '.join(choices)}")
        for name in ("reflectance_bounds", "light_bounds"):
            bounds = _sequence(name, getattr(self, name))
            if len(bounds) != 2:
                raise InvalidInputError(f"{name} are {bounds}; expected the lower and the upper one")
            low, high = (_number(f"a bound of {name}", bound) for bound in bounds)
            if not low < high:
                raise InvalidInputError(f"{name} are ({low}, {high}); expected the lower one first")

    def with_cell(self, index: CellIndex, cell: Cell) -> Self:
        """The same problem with one cell replaced."""
        return self.with_cells({index: cell})

    def with_cells(self, wishes: Mapping[CellIndex, Cell]) -> Self:
        """The same problem with some cells replaced. Raises InvalidInputError for cells outside the table."""
        rows = [list(row) for row in self.cells]
        for (i, j), cell in wishes.items():
            if not (0 <= i < len(rows) and 0 <= j < len(self.lights)):
                raise InvalidInputError(f"cell {(i, j)} is outside the table of {len(rows)}×{len(self.lights)} cells")
            rows[i][j] = cell
        return replace(self, cells=tuple(map(tuple, rows)))
