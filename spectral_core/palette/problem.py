# SPDX-License-Identifier: GPL-3.0-or-later
"""The design problem of a palette: lights in columns, reflectances in rows, and a request in each cell.

Colors are linear sRGB, relative to a perfect white under a light of luminance 1 (see ``spectral_core.spectra.observer
.normalized``). A light of luminance 6 makes a reflectance of 1/6 as bright as white: the method of the thesis (section
5.4.1) to keep reflectances below 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import (
    frozen_array,
    read_only_when_copied,
    require_declared,
    require_kind,
    require_range,
    require_text,
)
from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.palette.cell import LARGEST, Cell, CellMode, require_size
from spectral_core.palette.given import (
    CellIndex,
    cell_index_of,
    number_of,
    require_bounds,
    require_each,
    sequence_of,
    shown,
)
from spectral_core.spectra.observer import OBSERVER_NAMES, STANDARD
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid

Array = NDArray[np.float64]

MOST_OVER_Y = 1e4
"""Largest X and Z of a required white, relative to its Y."""


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class PaletteLight:
    """A column: a measured light, one to design with ``spectrum`` as its start, or amounts of ``primaries``."""

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
        require_kind("the spectrum of a light", self.spectrum, Illuminant)
        for name in ("primaries", "variants"):
            object.__setattr__(self, name, sequence_of(f"{name} of light {self.name!r}", getattr(self, name)))
            require_each(f"{name} of light {self.name!r}", getattr(self, name), Illuminant, "an Illuminant")
        require_declared(self)
        for each in (self.spectrum, *self.primaries, *self.variants):
            require_size(f"light {each.name!r}", each.values)
        requests = {
            "primaries": bool(self.primaries),
            "white_xyz": self.white_xyz is not None,
            "luminance": self.luminance is not None,
        }
        given = [word for word, asked in requests.items() if asked]
        if given and not self.free:
            raise InvalidInputError(
                f"light {self.name!r} is fixed, so {', '.join(given)} cannot be required; let it be designed: free=True"
            )
        if self.free and self.variants:
            raise InvalidInputError(f"light {self.name!r} is designed; only a measured light can have variants")
        if self.white_xyz is not None:
            object.__setattr__(self, "white_xyz", frozen_array("white_xyz", self.white_xyz, (3,)))
            if np.any(np.asarray(self.white_xyz) <= 0):
                raise InvalidInputError(f"white_xyz of light {self.name!r} must be positive; got {self.white_xyz}")
            largest = float(np.max(self.white_xyz))
            if largest / MOST_OVER_Y > self.white_xyz[1]:
                raise InvalidInputError(
                    f"white_xyz of light {self.name!r} is {self.white_xyz}; expected X and Z of at most "
                    f"{MOST_OVER_Y:g} times Y: of violet light of 380 nm, Z is 170 times Y"
                )
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
        require_text("the name of a reflectance", self.name)
        if self.spectrum is not None:
            require_kind(f"the spectrum of {self.name!r}", self.spectrum, Reflectance, "or None")

    @property
    def free(self) -> bool:
        """True if it is designed."""
        return self.spectrum is None


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class SubspaceCriterion:
    """Weight ω_F of the error of a renderer that computes in the basis (Eqs. 5.10 to 5.12).

    ``basis``: (n, m) on the palette's grid, Eq. 5.2. ``componentwise``: products by coefficient, as in the sharpened
    spectral factor model; else by the full matrix R of Eq. 5.7.
    """

    basis: Array
    weight: float = 1.0
    componentwise: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "basis", frozen_array("the subspace basis", self.basis, (None, None)))
        require_range("the weight of the subspace criterion", self.weight, 0.0, LARGEST)


@dataclass(frozen=True, slots=True, eq=False)
class PaletteProblem:
    """Lights, reflectances, a request per cell, and the weights of the requests. Build one, or take a preset."""

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
    """Bounds of light spectra, or of the amounts of primaries. Below 0 only for study, as no lamp emits negative
    light.
    """
    rounds: int = 1000
    """Most rounds of reflectances and lights; they stop when nothing improves. The thesis uses 1."""
    scale_lights: bool = False
    """Brighten all lights by one factor until the reflectances fit below their bound (section 5.5)."""
    observers: tuple[str, ...] = (STANDARD,)
    """The colors for the first observer are the targets; same, black and constant cells should hold for all."""
    robustness: Literal["soft", "worst_case"] = "soft"
    """Further observers and variants: rows of least squares, or minimization of the largest of their errors."""
    robust_weight: float = 1.0
    """Weight of their rows, relative to each cell's own."""

    def __post_init__(self) -> None:
        if not isinstance(self.grid, SpectralGrid):
            raise InvalidInputError(
                f"the grid of a palette is {shown(self.grid)}; expected a SpectralGrid, such as design_grid()"
            )
        for name in ("lights", "reflectances", "observers"):
            object.__setattr__(self, name, sequence_of(f"the {name} of a palette", getattr(self, name)))
            if not getattr(self, name):
                raise InvalidInputError(f"a palette needs at least one of its {name}; got none")
        require_each("lights", self.lights, PaletteLight, "a PaletteLight")
        require_each("reflectances", self.reflectances, PaletteReflectance, "a PaletteReflectance")
        rows = sequence_of("the cells of a palette", self.cells)
        object.__setattr__(self, "cells", tuple(sequence_of("a row of cells", row) for row in rows))
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
                self._check_cell(i, j, cell)

    def _check_cell(self, i: int, j: int, cell: Cell) -> None:
        if not isinstance(cell, Cell):
            raise InvalidInputError(f"cells[{i}][{j}] is {shown(cell)}; expected a Cell, such as Cell.fixed(rgb)")
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
            object.__setattr__(self, name, number_of(name, getattr(self, name)))
        if not isinstance(self.rounds, int | np.integer):
            raise InvalidInputError(f"rounds is {self.rounds!r}; expected a whole number")
        require_range("smoothness", self.smoothness, 0.0, LARGEST)
        require_range("robust_weight", self.robust_weight, 0.0, LARGEST)
        require_range("rounds", self.rounds, 1, 100_000)
        for name, choices in (
            ("smoothness_operator", ("mended", "thesis")),
            ("match", ("linear", "perceptual")),
            ("robustness", ("soft", "worst_case")),
        ):
            if not isinstance(given := getattr(self, name), str) or given not in choices:
                raise InvalidInputError(f"{name} is {given!r}; expected one of {', '.join(choices)}")
        for name in ("reflectance_bounds", "light_bounds"):
            require_bounds(name, getattr(self, name))

    def with_cell(self, index: CellIndex, cell: Cell) -> Self:
        """The same problem with one cell replaced."""
        return self.with_cells({cell_index_of(index): cell})

    def with_cells(self, cells: Mapping[CellIndex, Cell]) -> Self:
        """The same problem with some cells replaced. Raises InvalidInputError for cells outside the table."""
        rows = list(self.cells)
        require_kind("the cells to replace", cells, Mapping, "such as {(0, 1): Cell.free()}")
        for index, cell in cells.items():
            i, j = cell_index_of(index)
            if not (0 <= i < len(rows) and 0 <= j < len(self.lights)):
                raise InvalidInputError(f"cell {(i, j)} is outside the table of {len(rows)}×{len(self.lights)} cells")
            self._check_cell(i, j, cell)
            rows[i] = (*rows[i][:j], cell, *rows[i][j + 1 :])
        # Everything else was checked when this problem was built; a drag makes sixty of them a second.
        changed = object.__new__(type(self))
        for name in self.__slots__:
            object.__setattr__(changed, name, getattr(self, name))
        object.__setattr__(changed, "cells", tuple(rows))
        return changed
