# SPDX-License-Identifier: GPL-3.0-or-later
"""Fluorescent surfaces: light that is absorbed at one wavelength and emitted at a longer one (section 5.5.1).

A surface is diag(S) + Σ a_k em_k ex_kᵀ (Donaldson 1954): its reflectance, and amounts a of dyes with an excitation
spectrum ex (the share of light that a unit amount absorbs and emits again) and an emission density em (its integral is
1). That is linear in (S, a) for a known light and linear in the light for a known surface, so fluorescence is designed
by the same least squares. At every wavelength, at most as much light leaves as arrived, in photons and in power.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import frozen_array, read_only_when_copied, require_kind, require_range, require_text
from spectral_core.errors import InvalidInputError
from spectral_core.palette.assemble.equations import Dyed
from spectral_core.palette.cell import LARGEST
from spectral_core.palette.given import sequence_of
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.fluorescence import (
    FluorescentDye,
    require_energy,
    share_between_knots,
    share_per_amount,
)
from spectral_core.spectra.observer import Observer, integration_points, linear_rgb_from_product, xyz_of
from spectral_core.spectra.spectrum import LAST_NM, Illuminant, SpectralGrid, Spectrum

Array = NDArray[np.float64]

BETWEEN = 8
"""Wavelengths per step of the grid at which the returned light is checked."""


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class FluorescentSurface:
    """A reflectance on a grid with amounts (k,) of dyes. Raises InvalidInputError if it returns more than 1."""

    name: str
    reflectance: Spectrum
    dyes: tuple[FluorescentDye, ...]
    amounts: Array

    def __post_init__(self) -> None:
        require_text("the name of a fluorescent surface", self.name)
        require_kind(f"the reflectance of {self.name!r}", self.reflectance, Spectrum)
        object.__setattr__(self, "dyes", sequence_of(f"the dyes of {self.name!r}", self.dyes))
        for dye in self.dyes:
            require_kind(f"a dye of {self.name!r}", dye, FluorescentDye)
        object.__setattr__(self, "amounts", frozen_array(f"amounts of {self.name!r}", self.amounts, (len(self.dyes),)))
        if self.amounts.min(initial=0.0) < 0:
            raise InvalidInputError(f"amounts of {self.name!r} are {self.amounts.tolist()}; expected at least 0")
        steps = np.linspace(0.0, 1.0, BETWEEN, endpoint=False)
        knots = self.grid.wavelengths_nm
        nm = np.append((knots[:-1, None] + np.diff(knots)[:, None] * steps).ravel(), knots[-1])
        sent_out = share_per_amount(self.dyes, nm, self.grid) @ self.amounts
        require_energy(self.name, nm, self.reflectance.at(nm), sent_out)

    @property
    def grid(self) -> SpectralGrid:
        """The reflectance's grid."""
        return self.reflectance.grid

    def returned_share(self) -> Array:
        """Share of the light around each knot that is returned at most, in photons or in power, the larger of both:
        (n,). Between two knots it is at most what the line between them shows.
        """
        return self.reflectance.values + share_between_knots(self.dyes, self.grid.wavelengths_nm) @ self.amounts

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


def color_from_surface(
    light: Spectrum, dyes: Sequence[FluorescentDye], grid: SpectralGrid, viewer: Observer | None = None
) -> Array:
    """Criterion block for the surface side: (3, n + k), linear RGB from reflectance values and amounts of dyes."""
    emitted = [dye.emitted_rgb(viewer) * dye.absorbed_power(light, grid) for dye in dyes]
    return np.concatenate([linear_rgb_from_product(light, grid, viewer), *(e[:, None] for e in emitted)], axis=1)


def dyed_colors(
    lights: Sequence[Spectrum], dyes: Sequence[FluorescentDye], grid: SpectralGrid, viewer: Observer | None = None
) -> Dyed:
    """Colors of the dyes of a surface under lights, each with the largest amount that it can have alone."""
    returned = share_between_knots(dyes, grid.wavelengths_nm)
    most = returned.max(axis=0)
    # A dye that absorbs outside of the grid shows nothing, whatever its amount.
    amounts = np.where(most > 0, 1.0 / np.where(most > 0, most, 1.0), 0.0)
    colors = [color_from_surface(light, dyes, grid, viewer)[:, grid.size :] for light in lights]
    return Dyed(np.stack(colors) * amounts, returned * amounts)


def color_from_light(surface: FluorescentSurface, grid: SpectralGrid, viewer: Observer | None = None) -> Array:
    """Criterion block for the light side: (3, n), linear RGB from a light's values on ``grid``; diag(E) becomes D."""
    matrix = linear_rgb_from_product(surface.reflectance, grid, viewer)
    points, weights = integration_points(grid.wavelengths_nm, surface.grid.wavelengths_nm)
    for dye, amount in zip(surface.dyes, surface.amounts, strict=True):
        excited = grid.against_hats(points, dye.excitation_at(points, surface.grid) * weights)[0]
        matrix = matrix + amount * np.outer(dye.emitted_rgb(viewer), excited)
    return matrix


def led(peak_nm: float, *, power: float = 1.0, width_nm: float = 8.0) -> Illuminant:
    """A bell-shaped LED of a given radiant power; ``width_nm``: its standard deviation. For tests of fluorescence."""
    grid = SpectralGrid.uniform(300, LAST_NM, 1)
    peak_nm = require_range("the peak of an LED", peak_nm, 300.0, LAST_NM, " nm")
    width_nm = require_range("the width of an LED", width_nm, 0.1, 1000.0, " nm")
    power = require_range("the power of an LED", power, 0.0, LARGEST)
    bell = np.exp(-0.5 * ((grid.wavelengths_nm - peak_nm) / width_nm) ** 2)
    return Illuminant(f"{peak_nm:g} nm LED", grid, power * bell / bell.sum(), source="Gaussian")
