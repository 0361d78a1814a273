# SPDX-License-Identifier: GPL-3.0-or-later
"""Fluorescent surfaces: light that is absorbed at one wavelength and sent out at a longer one (section 5.5.1).

A surface is diag(S) + Σ a_k em_k ex_kᵀ (Donaldson 1954): what it reflects, and amounts a of dyes with an excitation
spectrum ex (the share of light that a unit amount absorbs and sends out again) and an emission density em (its integral
is 1). That is linear in (S, a) for a known light and linear in the light for a known surface, so fluorescence is
designed by the same least squares as all else. Energy: at every wavelength S + Σ a_k ex_k <= 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import frozen_array, require_range
from spectral_core.errors import InvalidInputError
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import Observer, integration_points, linear_rgb_from_product, xyz_of
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid, Spectrum

Array = NDArray[np.float64]

ENERGY_SLACK = 1e-6
"""How far past 1 a solver's rounding may take the energy that a surface returns."""


@dataclass(frozen=True, slots=True, eq=False)
class FluorescentDye:
    """A dye. ``excitation``: at most 1; ``emission``: any scale, it is divided by its integral.

    Both on any grids. Emission must be at longer wavelengths than excitation, in the mean (Stokes).
    """

    name: str
    excitation: Spectrum
    emission: Spectrum

    def __post_init__(self) -> None:
        for word, spectrum in (("excitation", self.excitation), ("emission", self.emission)):
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
        """A dye with bell-shaped spectra around two wavelengths; ``widths_nm``: their standard deviations."""
        grid = grid or SpectralGrid.uniform(300, 830, 5)
        bells = [
            np.exp(-0.5 * ((grid.wavelengths_nm - center) / require_range("a width", width, 0.1, 1000, " nm")) ** 2)
            for center, width in zip((excitation_nm, emission_nm), widths_nm, strict=True)
        ]
        return cls(name, Spectrum("excitation", grid, bells[0]), Spectrum("emission", grid, bells[1]))

    def emission_density(self, wavelengths_nm: Array) -> Array:
        """Emission per nm at any wavelengths, its integral 1."""
        return self.emission.at(wavelengths_nm) / _integral(self.emission)

    def absorbed_power(self, light: Spectrum, grid: SpectralGrid) -> float:
        """∫ ex · E dλ for a unit amount, with the excitation as it is on ``grid``."""
        points, weights = integration_points(grid.wavelengths_nm, light.grid.wavelengths_nm)
        return float((self.excitation_at(points, grid) * weights) @ light.at(points))

    def emitted_rgb(self, viewer: Observer | None = None) -> Array:
        """Linear sRGB (3,) of the emission density: of one unit of absorbed power."""
        return RGB_FROM_XYZ @ xyz_of(self.emission, None, viewer) / _integral(self.emission)

    def excitation_on(self, grid: SpectralGrid) -> Array:
        """Excitation at the knots of a grid, (n,): what the design knows of it."""
        return self.excitation.at(grid.wavelengths_nm)

    def excitation_at(self, points: Array, grid: SpectralGrid) -> Array:
        """Excitation as the design knows it on ``grid``, at any wavelengths (nm)."""
        return np.interp(points, grid.wavelengths_nm, self.excitation_on(grid), left=0.0, right=0.0)


@dataclass(frozen=True, slots=True, eq=False)
class FluorescentSurface:
    """A reflectance on a grid with amounts (k,) of dyes. Raises InvalidInputError where it returns over 1."""

    name: str
    reflectance: Spectrum
    dyes: tuple[FluorescentDye, ...]
    amounts: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "amounts", frozen_array(f"amounts of {self.name!r}", self.amounts, (len(self.dyes),)))
        if self.amounts.min(initial=0.0) < 0:
            raise InvalidInputError(f"amounts of {self.name!r} are {self.amounts.tolist()}; expected at least 0")
        energy = self.returned_energy()
        worst = int(energy.argmax())
        if energy[worst] > 1 + ENERGY_SLACK:
            raise InvalidInputError(
                f"surface {self.name!r} returns {energy[worst]:.4f} of the light at "
                f"{self.grid.wavelengths_nm[worst]:g} nm, reflected and emitted; expected at most 1"
            )

    @property
    def grid(self) -> SpectralGrid:
        """The reflectance's grid."""
        return self.reflectance.grid

    def returned_energy(self) -> Array:
        """Share of the light at each knot that is reflected or sent out again, (n,)."""
        return self.reflectance.values + energy_per_amount(self.dyes, self.grid) @ self.amounts

    def bispectral_matrix(self) -> Array:
        """Donaldson matrix (n, n) on the grid: radiance at the knots from the light's power at the knots."""
        knots, widths = self.grid.wavelengths_nm, self.grid.cell_widths_nm
        matrix = np.diag(self.reflectance.values)
        for dye, amount in zip(self.dyes, self.amounts, strict=True):
            matrix = matrix + amount * np.outer(dye.emission_density(knots), dye.excitation_on(self.grid) * widths)
        return matrix

    def radiance(self, light: Spectrum, wavelengths_nm: Array) -> Array:
        """Reflected and emitted light at any wavelengths, per nm."""
        total = self.reflectance.at(wavelengths_nm) * light.at(wavelengths_nm)
        for dye, amount in zip(self.dyes, self.amounts, strict=True):
            total = total + amount * dye.absorbed_power(light, self.grid) * dye.emission_density(wavelengths_nm)
        return total

    def linear_rgb(self, light: Spectrum, viewer: Observer | None = None) -> Array:
        """Color (3,) under a light."""
        color: Array = RGB_FROM_XYZ @ xyz_of(light, self.reflectance, viewer)
        for dye, amount in zip(self.dyes, self.amounts, strict=True):
            color = color + amount * dye.absorbed_power(light, self.grid) * dye.emitted_rgb(viewer)
        return color


def energy_per_amount(dyes: Sequence[FluorescentDye], grid: SpectralGrid) -> Array:
    """(n, k): share of light at each knot that a unit amount of each dye sends out again."""
    columns = [dye.excitation_on(grid) for dye in dyes]
    return np.stack(columns, axis=1) if columns else np.zeros((grid.size, 0))


def color_from_surface(
    light: Spectrum, dyes: Sequence[FluorescentDye], grid: SpectralGrid, viewer: Observer | None = None
) -> Array:
    """Criterion block for the surface side: (3, n + k), linear RGB from reflectance values and amounts of dyes."""
    emitted = [dye.emitted_rgb(viewer) * dye.absorbed_power(light, grid) for dye in dyes]
    return np.concatenate([linear_rgb_from_product(light, grid, viewer), *(e[:, None] for e in emitted)], axis=1)


def color_from_light(surface: FluorescentSurface, grid: SpectralGrid, viewer: Observer | None = None) -> Array:
    """Criterion block for the light side: (3, n), linear RGB from a light's values on ``grid``; diag(E) becomes D."""
    matrix = linear_rgb_from_product(surface.reflectance, grid, viewer)
    points, weights = integration_points(grid.wavelengths_nm, surface.grid.wavelengths_nm)
    for dye, amount in zip(surface.dyes, surface.amounts, strict=True):
        excited = grid.against_hats(points, dye.excitation_at(points, surface.grid) * weights)[0]
        matrix = matrix + amount * np.outer(dye.emitted_rgb(viewer), excited)
    return matrix


def energy_rows(dyes: Sequence[FluorescentDye], grid: SpectralGrid) -> Array:
    """(n, n + k): energy returned at each knot from reflectance values and amounts; to be held at most 1."""
    return np.concatenate([np.eye(grid.size), energy_per_amount(dyes, grid)], axis=1)


def led(peak_nm: float, *, power: float = 1.0, width_nm: float = 8.0) -> Illuminant:
    """A bell-shaped LED of a given radiant power; ``width_nm``: its standard deviation. For tests of fluorescence."""
    grid = SpectralGrid.uniform(300, 830, 1)
    bell = np.exp(-0.5 * ((grid.wavelengths_nm - peak_nm) / width_nm) ** 2)
    return Illuminant(f"{peak_nm:g} nm LED", grid, power * bell / bell.sum(), source="Gaussian")


def _mean_wavelength(spectrum: Spectrum) -> float:
    points, weights = integration_points(spectrum.grid.wavelengths_nm)
    values = spectrum.at(points) * weights
    return float(points @ values / values.sum())


def _integral(spectrum: Spectrum) -> float:
    points, weights = integration_points(spectrum.grid.wavelengths_nm)
    return float(spectrum.at(points) @ weights)
