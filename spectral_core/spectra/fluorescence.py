# SPDX-License-Identifier: GPL-3.0-or-later
"""Fluorescent dyes: excitation and emission spectra, and the limit of the returned light.

A surface with dyes is diag(S) + Σ a_k em_k ex_kᵀ (Donaldson 1954): its reflectance, and amounts a of dyes with an
excitation spectrum ex (the share of the power at a wavelength that a unit amount absorbs and emits again) and an
emission density em (its integral is 1). No photon becomes two (the quantum yield is at most 1), and no power is gained.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_kind, require_range, require_text
from spectral_core.errors import InvalidInputError
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import Observer, integration_points, xyz_of
from spectral_core.spectra.spectrum import EXCITING_NM, LAST_NM, SpectralGrid, Spectrum

Array = NDArray[np.float64]

ENERGY_SLACK = 1e-6
"""Tolerance above 1, for a solver's rounding, on the light that a surface returns."""

NARROW_BELL_NM = 10.0
"""Standard deviation of a dye's bell below which knots of 5 nm do not show it."""


@dataclass(frozen=True, slots=True, eq=False)
class FluorescentDye:
    """A dye. ``excitation``: at most 1; ``emission``: any scale, it is divided by its integral.

    Both on any grids. Emission must be at longer wavelengths than excitation, in the mean (Stokes).
    """

    name: str
    excitation: Spectrum
    emission: Spectrum

    def __post_init__(self) -> None:
        require_text("the name of a dye", self.name)
        for word, spectrum in (("excitation", self.excitation), ("emission", self.emission)):
            require_kind(f"{word} of dye {self.name!r}", spectrum, Spectrum, "spectra.files.read_spectra(PATH)[0]")
            if spectrum.values.min() < 0 or spectrum.values.max() <= 0:
                raise InvalidInputError(
                    f"{word} of dye {self.name!r} spans {spectrum.values.min():g} to {spectrum.values.max():g}; "
                    "expected values of at least 0, and some above"
                )
        if self.excitation.values.max() > 1:
            raise InvalidInputError(
                f"excitation of dye {self.name!r} reaches {self.excitation.values.max():g}; it is a share of light, so "
                "at most 1"
            )
        means = [_mean_wavelength(spectrum) for spectrum in (self.excitation, self.emission)]
        if means[1] <= means[0]:
            raise InvalidInputError(
                f"dye {self.name!r} is excited around {means[0]:.0f} nm and emits around {means[1]:.0f} nm; emission "
                "is at longer wavelengths, so exchange the two"
            )

    @classmethod
    def gaussian(
        cls,
        name: str,
        excitation_nm: float,
        emission_nm: float,
        *,
        widths_nm: tuple[float, float] = (20.0, 20.0),
        grid: SpectralGrid | None = None,
    ) -> FluorescentDye:
        """A dye with bell-shaped spectra around two wavelengths; ``widths_nm``: their standard deviations.

        ``grid``: of both; None for 5 nm, and closer knots within a bell that is narrow.
        """
        if not isinstance(widths_nm, tuple | list) or len(widths_nm) != 2:
            raise InvalidInputError(f"widths_nm is {widths_nm}; expected two numbers, of excitation and of emission")
        bells = []
        for kind, center, width in zip(
            ("excitation", "emission"), (excitation_nm, emission_nm), widths_nm, strict=True
        ):
            width = require_range("a width", width, 0.1, 1000, " nm")
            center = require_range(f"the {kind} of dye {name!r}", center, 1.0, 1e5, " nm")
            own = _grid_of_bell(center, width) if grid is None else grid
            require_kind("the grid of a dye", own, SpectralGrid)
            bells.append(Spectrum(kind, own, np.exp(-0.5 * ((own.wavelengths_nm - center) / width) ** 2)))
        return cls(name, *bells)

    @property
    def emission_mean_nm(self) -> float:
        """Mean wavelength of the emitted power."""
        return _mean_wavelength(self.emission)

    @property
    def emission_area(self) -> float:
        """Integral of the emission as it is given, in its own unit times nm."""
        return _integral(self.emission)

    def emission_density(self, wavelengths_nm: Array) -> Array:
        """Emission per nm at any wavelengths, its integral 1."""
        return self.emission.at(wavelengths_nm) / self.emission_area

    def absorbed_power(self, light: Spectrum, grid: SpectralGrid) -> float:
        """∫ ex · E dλ for a unit amount, with the excitation as it is on ``grid``."""
        points, weights = integration_points(grid.wavelengths_nm, light.grid.wavelengths_nm)
        return float((self.excitation_at(points, grid) * weights) @ light.at(points))

    def emitted_rgb(self, viewer: Observer | None = None) -> Array:
        """Linear sRGB (3,) of the emission density: of one unit of absorbed power."""
        return RGB_FROM_XYZ @ xyz_of(self.emission, None, viewer) / self.emission_area

    def excitation_on(self, grid: SpectralGrid) -> Array:
        """Excitation at the knots of a grid, (n,), as the design uses it."""
        return self.excitation.at(grid.wavelengths_nm)

    def excitation_at(self, points: Array, grid: SpectralGrid) -> Array:
        """Excitation on the design's ``grid``, evaluated at any wavelengths (nm)."""
        return np.interp(points, grid.wavelengths_nm, self.excitation_on(grid), left=0.0, right=0.0)


def share_per_amount(dyes: Sequence[FluorescentDye], wavelengths_nm: Array, grid: SpectralGrid | None = None) -> Array:
    """(n, k): the larger of the shares of photons and of power at each wavelength that a unit amount emits again.

    A photon that is absorbed at λ and emitted around λ' keeps λ / λ' of its power, so the limit on photons is reached
    first. ``grid``: that of a design, on which the excitation is linear; None for the dye's own.
    """
    columns = [
        (dye.excitation.at(wavelengths_nm) if grid is None else dye.excitation_at(wavelengths_nm, grid))
        * np.maximum(1.0, dye.emission_mean_nm / wavelengths_nm)
        for dye in dyes
    ]
    return np.stack(columns, axis=1) if columns else np.zeros((len(wavelengths_nm), 0))


def share_between_knots(dyes: Sequence[FluorescentDye], knots_nm: Array) -> Array:
    """(n, k): shares at the knots whose linear interpolation is at least ``share_per_amount`` at every wavelength
    between them, where the excitation is linear between the knots.

    Where the excitation rises steeply, the share of photons between two knots exceeds the line between its ends.
    """
    low, high = knots_nm[:-1], knots_nm[1:]
    columns = [np.zeros((len(knots_nm), 0))]
    for dye in dyes:
        mean, taken = dye.emission_mean_nm, dye.excitation.at(knots_nm)
        ends = taken * np.maximum(1.0, mean / knots_nm)
        slope, line = np.diff(taken) / (high - low), np.diff(ends) / (high - low)
        # Below the mean the share is mean · (level / λ + slope): farthest from the line where their slopes are equal.
        level = taken[:-1] - slope * low
        with np.errstate(divide="ignore", invalid="ignore"):
            flat = np.sqrt(-mean * level / line)
        above = np.zeros(len(low))
        for nm in (np.clip(np.nan_to_num(flat), low, high), np.clip(mean, low, high)):
            share = (level + slope * nm) * np.maximum(1.0, mean / nm)
            above = np.maximum(above, share - ends[:-1] - line * (nm - low))
        columns.append((ends + np.maximum(np.append(above, 0.0), np.append(0.0, above)))[:, None])
    return np.concatenate(columns, axis=1)


def require_energy(name: str, wavelengths_nm: Array, reflected: Array, sent_out: Array) -> None:
    """Raise InvalidInputError if reflected light and ``share_per_amount @ amounts``, both (n,), exceed 1."""
    total = reflected + sent_out
    worst = int(np.argmax(total))
    if total[worst] > 1 + ENERGY_SLACK:
        room = max(1.0 - float(reflected[worst]), 0.0) / max(float(sent_out[worst]), 1e-300)
        raise InvalidInputError(
            f"surface {name!r} returns {total[worst]:.4f} of the light at {wavelengths_nm[worst]:g} nm, reflected and "
            "emitted by its dyes (counted in photons, as a quantum yield of at most 1 requires); expected at most 1: "
            f"multiply the amounts of its dyes by {np.floor(room * 1e3) / 1e3:g}, or darken it there"
        )


def _grid_of_bell(center_nm: float, width_nm: float) -> SpectralGrid:
    """A grid of 5 nm, with closer knots around the middle of a bell whose standard deviation is below two steps."""
    knots = np.arange(EXCITING_NM, LAST_NM + 1, 5.0)
    if width_nm < NARROW_BELL_NM:
        near = center_nm + width_nm * np.linspace(-5.0, 5.0, 41)
        knots = np.union1d(knots, near[(near > knots[0]) & (near < knots[-1])])
    return SpectralGrid(knots)


def _mean_wavelength(spectrum: Spectrum) -> float:
    points, weights = integration_points(spectrum.grid.wavelengths_nm)
    values = spectrum.at(points) * weights
    return float(points @ values / values.sum())


def _integral(spectrum: Spectrum) -> float:
    points, weights = integration_points(spectrum.grid.wavelengths_nm)
    return float(spectrum.at(points) @ weights)
