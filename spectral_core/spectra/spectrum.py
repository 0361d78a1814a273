# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampled spectra: their wavelength grids, illuminants and reflectances.

One ``SpectralGrid`` is shared by design, preview, export and render. Between its knots a spectrum is linear and
outside of them zero, exactly as the renderer reads it, so that the designed spectrum is the rendered one.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import (
    frozen_array,
    read_only_when_copied,
    real_numbers,
    require_choices,
    require_kind,
    require_range,
    require_text,
)
from spectral_core.errors import GridMismatchError, InvalidInputError, counted

Interpolation = Literal["linear", "sampled"]
MOST_KNOTS = 1_000_000
"""Largest grid, more than any instrument resolves; a larger one is a mistake in the unit."""
FIRST_NM, LAST_NM = 360, 830
"""Visible wavelengths: the range of the CIE's 2° tables (CIE 018:2019), which is all that Mitsuba traces."""
EXCITING_NM = 300
"""Shortest wavelength of light that dyes are excited by; light that is defined by a formula begins there."""
WAVELENGTHS_NM: NDArray[np.float64] = np.arange(FIRST_NM, LAST_NM + 1, dtype=np.float64)
"""Every whole nm of the visible wavelengths, (471,)."""
WAVELENGTHS_NM.setflags(write=False)


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class SpectralGrid:
    """Wavelengths at which spectra are known, and the interpolation between them.

    ``wavelengths_nm``: ascending, shape (n,), n >= 2, in nanometers. ``interpolation``: ``"linear"`` (hat functions,
    zero outside; what the renderer does) or ``"sampled"`` (each knot stands for its own cell; the plain sum of the
    thesis, for comparison only).
    """

    wavelengths_nm: NDArray[np.float64]
    interpolation: Interpolation = "linear"

    def __post_init__(self) -> None:
        wavelengths = frozen_array("wavelengths_nm", self.wavelengths_nm, (None,))
        if wavelengths.size < 2 or np.any(np.diff(wavelengths) <= 0) or wavelengths[0] <= 0:
            raise InvalidInputError(
                f"wavelengths_nm must be at least 2 positive wavelengths in ascending order without repeats; got "
                f"{', '.join(f'{wavelength:g}' for wavelength in wavelengths[:4]) or 'none'}"
                f"{f', … ({wavelengths.size})' if wavelengths.size > 4 else ''}"
            )
        require_choices(self)
        object.__setattr__(self, "wavelengths_nm", wavelengths)

    @classmethod
    def uniform(
        cls,
        start_nm: float = 400.0,
        stop_nm: float = 700.0,
        step_nm: float = 10.0,
        *,
        interpolation: Interpolation = "linear",
    ) -> Self:
        """Grid of equal steps; ``stop_nm`` is its last knot and must lie a whole number of steps past ``start_nm``."""
        start_nm, stop_nm, step_nm = (
            require_range(name, value, -math.inf, math.inf, " nm")
            for name, value in (("start_nm", start_nm), ("stop_nm", stop_nm), ("step_nm", step_nm))
        )
        steps = (stop_nm - start_nm) / step_nm if step_nm > 0 else -1.0
        if not steps < MOST_KNOTS:  # also catches NaN and Inf
            raise InvalidInputError(
                f"a grid from {start_nm:g} to {stop_nm:g} nm in steps of {step_nm:g} nm has {steps:g} steps; "
                f"expected under {MOST_KNOTS:,}"
            )
        if steps < 1 or abs(steps - round(steps)) > 1e-9 * max(1.0, steps):
            raise InvalidInputError(
                f"a uniform grid from {start_nm:g} to {stop_nm:g} nm has no whole number of steps of {step_nm:g} nm; "
                "choose a step that divides the range"
            )
        return cls(np.linspace(start_nm, stop_nm, round(steps) + 1), interpolation)

    @property
    def size(self) -> int:
        """Number of knots n."""
        return int(self.wavelengths_nm.size)

    @property
    def cell_widths_nm(self) -> NDArray[np.float64]:
        """Width of each knot's cell, shape (n,), in nm: half-way to its neighbors, ends mirrored."""
        steps = np.diff(self.wavelengths_nm)
        return (np.concatenate([steps[:1], steps]) + np.concatenate([steps, steps[-1:]])) / 2

    def values_from_knots(self, wavelengths_nm: ArrayLike) -> NDArray[np.float64]:
        """Matrix (k, n) that evaluates a spectrum of this grid at k wavelengths (nm); zero outside the grid.

        Hat functions for both interpolations: a ``"sampled"`` grid differs in its integrals only.
        """
        points = np.atleast_1d(real_numbers("wavelengths", wavelengths_nm))
        if points.ndim > 1:
            raise InvalidInputError(f"wavelengths has shape {points.shape}; expected a list of numbers, or one number")
        left, fraction, inside = self._cells_of(points)
        matrix = np.zeros((points.size, self.size))
        rows = np.arange(points.size)
        matrix[rows, left] = np.where(inside, 1.0 - fraction, 0.0)
        matrix[rows, left + 1] = np.where(inside, fraction, 0.0)
        return matrix

    def against_hats(self, wavelengths_nm: NDArray[np.float64], weighted: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sum functions (c, m), given with their weights at m wavelengths (nm), against each hat function: (c, n).

        ``weighted @ values_from_knots(wavelengths_nm)`` without that matrix, which is large for measured spectra.
        """
        left, fraction, inside = self._cells_of(wavelengths_nm)
        low, high = np.where(inside, 1.0 - fraction, 0.0), np.where(inside, fraction, 0.0)
        return np.stack(
            [
                np.bincount(left, row * low, self.size) + np.bincount(left + 1, row * high, self.size)
                for row in np.atleast_2d(weighted)
            ]
        )

    def _cells_of(self, points: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.bool_]]:
        """Left knot of the cell of each point, the position within the cell, and whether the grid reaches there."""
        knots = self.wavelengths_nm
        left = np.clip(np.searchsorted(knots, points, side="right") - 1, 0, self.size - 2)
        fraction = (points - knots[left]) / (knots[left + 1] - knots[left])
        return left, fraction, (points >= knots[0]) & (points <= knots[-1])

    def same_as(self, other: SpectralGrid) -> bool:
        """True if both grids have the same knots and interpolation."""
        require_kind("the other grid", other, SpectralGrid)
        return self is other or (
            self.interpolation == other.interpolation
            and self.size == other.size
            and bool(np.array_equal(self.wavelengths_nm, other.wavelengths_nm))
        )

    def __str__(self) -> str:
        first, last = self.wavelengths_nm[0], self.wavelengths_nm[-1]
        steps = np.diff(self.wavelengths_nm)
        spacing = f"{steps[0]:g} nm" if np.ptp(steps) < 1e-9 * last else f"{steps.min():g} to {steps.max():g} nm"
        return f"{first:g}–{last:g} nm / {spacing} ({self.size} samples)"

    def __repr__(self) -> str:
        return f"SpectralGrid({self}, {self.interpolation})"


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """Values on a grid. ``values``: shape (grid.size,); ``source``: text on their origin."""

    name: str
    grid: SpectralGrid
    values: NDArray[np.float64]
    source: str = field(default="", kw_only=True)

    def __post_init__(self) -> None:
        require_text("the name of a spectrum", self.name)
        require_text(f"the source of spectrum {self.name!r}", self.source)
        if not isinstance(self.grid, SpectralGrid):
            raise InvalidInputError(
                f"the grid of spectrum {self.name!r} is of type {type(self.grid).__name__}; expected a SpectralGrid, "
                "such as SpectralGrid([400, 550, 700])"
            )
        object.__setattr__(self, "values", frozen_array(f"spectrum {self.name!r}", self.values, (None,)))
        if self.values.size != self.grid.size:
            raise GridMismatchError(
                f"spectrum {self.name!r} has {counted(self.values.size, 'value')}, its grid {self.grid} has "
                f"{self.grid.size}; give one value per wavelength"
            )

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name!r}, {self.grid})"

    def at(self, wavelengths_nm: ArrayLike) -> NDArray[np.float64]:
        """Values at any wavelengths (nm), linear between knots and zero outside; same shape as the input."""
        points = real_numbers("wavelengths", wavelengths_nm)
        return np.interp(points, self.grid.wavelengths_nm, self.values, left=0.0, right=0.0)

    def resampled(self, grid: SpectralGrid, *, average: bool = False) -> Self:
        """The same spectrum on another grid.

        Point values by default; with ``average`` each knot takes the mean over its cell, which keeps the power of
        lines narrower than the new step.
        """
        require_kind("the grid", grid, SpectralGrid, "such as SpectralGrid([400, 550, 700])")
        if not average:
            return self._replaced(grid, self.at(grid.wavelengths_nm))
        return self._replaced(grid, self._cell_means(grid))

    def _cell_means(self, grid: SpectralGrid) -> NDArray[np.float64]:
        """Mean over the cell of each knot of ``grid``, exact, since the spectrum is linear between its knots."""
        knots, half = self.grid.wavelengths_nm, grid.cell_widths_nm / 2
        low, high = grid.wavelengths_nm - half, grid.wavelengths_nm + half
        positions = np.union1d(knots, np.clip(np.concatenate([low, high]), knots[0], knots[-1]))
        values = np.interp(positions, knots, self.values)
        area = np.concatenate([[0.0], np.cumsum(np.diff(positions) * (values[1:] + values[:-1]) / 2)])
        means = np.interp(high, positions, area) - np.interp(low, positions, area)
        return np.asarray(means / (2 * half))

    def scaled(self, factor: float) -> Self:
        """The same spectrum times ``factor``."""
        return self._replaced(self.grid, self.values * require_range("the factor", factor, -math.inf, math.inf))

    def _replaced(self, grid: SpectralGrid, values: NDArray[np.float64]) -> Self:
        return type(self)(self.name, grid, values, source=self.source)

    def require_grid(self, grid: SpectralGrid) -> None:
        """Raise GridMismatchError unless this spectrum is on ``grid``."""
        if not self.grid.same_as(grid):
            raise GridMismatchError(
                f"{type(self).__name__.lower()} {self.name!r} is on {self.grid}, expected {grid}; use .resampled(grid)"
            )


class Illuminant(Spectrum):
    """Relative spectral power of a light, per nm, never negative; its values are also called ``spd``."""

    __slots__ = ()

    def __post_init__(self) -> None:
        Spectrum.__post_init__(self)
        if self.values.min() < 0:
            worst = int(self.values.argmin())
            raise InvalidInputError(
                f"illuminant {self.name!r} is negative ({self.values[worst]:g}) at "
                f"{self.grid.wavelengths_nm[worst]:g} nm; a light's power is at least 0"
            )

    @property
    def spd(self) -> NDArray[np.float64]:
        """Spectral power distribution: the values."""
        return self.values


class Reflectance(Spectrum):
    """Share of light that a surface reflects, from 0 to 1 at every wavelength."""

    __slots__ = ()

    TOLERANCE = 1e-6
    """Tolerance of values outside [0, 1], for a solver's rounding, before they are refused."""

    def __post_init__(self) -> None:
        Spectrum.__post_init__(self)
        low, high = float(self.values.min()), float(self.values.max())
        if low < -self.TOLERANCE or high > 1 + self.TOLERANCE:
            raise InvalidInputError(
                f"reflectance {self.name!r} spans {low:g} to {high:g}; a passive surface reflects between 0 and 1"
            )
        object.__setattr__(self, "values", frozen_array(self.name, np.clip(self.values, 0.0, 1.0)))


SpectrumType = TypeVar("SpectrumType", bound=Spectrum)


def told_apart(spectra: Sequence[SpectrumType]) -> list[SpectrumType]:
    """The spectra, with numbers added to equal names: a list with two channels of one name would be ambiguous."""
    counts = Counter(spectrum.name for spectrum in spectra)
    taken = {name for name, count in counts.items() if count == 1}
    found: list[SpectrumType] = []
    for number, spectrum in enumerate(spectra, 1):
        tried, count = spectrum.name, number
        while counts[spectrum.name] > 1 and (tried == spectrum.name or tried in taken):
            tried, count = f"{spectrum.name} {count}", count + 1
        taken.add(tried)
        found.append(spectrum if tried == spectrum.name else replace(spectrum, name=tried))
    return found


def common_grid(spectra: Sequence[Spectrum], what: str) -> tuple[SpectralGrid, str]:
    """All wavelengths of the spectra in the range that all of them have, and a note where that range is narrower.

    Beyond its wavelengths a spectrum is 0, and there a measured surface would count as black. ``what`` has these
    wavelengths, for the note. Raises InvalidInputError if no range is in all spectra.
    """
    ranges = [(float(each.grid.wavelengths_nm[0]), float(each.grid.wavelengths_nm[-1])) for each in spectra]
    low, high = max(first for first, _ in ranges), min(last for _, last in ranges)
    each_range = zip(spectra, ranges, strict=True)
    stated = ", ".join(f"{spectrum.name!r} {first:g} to {last:g} nm" for spectrum, (first, last) in each_range)
    if low >= high:
        raise InvalidInputError(f"no wavelength is in all spectra ({stated}); measure them over a common range")
    if all(spectrum.grid.same_as(spectra[0].grid) for spectrum in spectra):
        return spectra[0].grid, ""
    knots = np.unique(np.concatenate([spectrum.grid.wavelengths_nm for spectrum in spectra]))
    note = f"{what} has {low:g} to {high:g} nm, the range that all spectra have ({stated})"
    return SpectralGrid(knots[(knots >= low) & (knots <= high)]), note if len(set(ranges)) > 1 else ""
