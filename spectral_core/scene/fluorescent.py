# SPDX-License-Identifier: GPL-3.0-or-later
"""A diffuse surface with fluorescent dyes, which emit part of the light at other wavelengths; and closures that scatter
nothing: light passes, goes on elsewhere, or ends.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_declared, require_kind, require_range
from spectral_core.errors import InvalidInputError, counted
from spectral_core.scene.paint import Color, Paint, gray, require_paint
from spectral_core.scene.shading.program import Computed
from spectral_core.spectra.fluorescence import ENERGY_SLACK, FluorescentDye, require_energy, share_per_amount
from spectral_core.spectra.spectrum import EXCITING_NM, LAST_NM, Spectrum
from spectral_core.spectra.upsample import upsampled

Array = NDArray[np.float64]

EXCITED_NM: Array = np.arange(EXCITING_NM, LAST_NM + 1, dtype=np.float64)
"""Wavelengths at which light can excite dyes: ultraviolet from 300 nm on, and all traced wavelengths."""
EXCITED_NM.setflags(write=False)


@dataclass(frozen=True, slots=True, eq=False)
class Fluorescent:
    """Lambertian reflection of ``color``, and Lambertian emission of ``dyes``, each with its amount (0 or more).

    Light of wavelength λ is absorbed by ``amount · excitation(λ)`` of its power and emitted with the dye's emission
    density. Raises InvalidInputError if a color or spectrum and the dyes return more photons, or more power, than
    arrive: the quantum yield is at most 1. A texture's colors are not checked.
    """

    color: Paint = field(default_factory=lambda: gray(0.5))
    dyes: tuple[FluorescentDye, ...] = ()
    amounts: tuple[float, ...] = ()
    normal: Computed | None = None

    def __post_init__(self) -> None:
        require_paint("the color of a fluorescent surface", self.color)
        require_declared(self)
        if len(self.amounts) != len(self.dyes):
            raise InvalidInputError(
                f"a fluorescent surface has {counted(len(self.dyes), 'dye')} and "
                f"{counted(len(self.amounts), 'amount')}; give one per dye"
            )
        for dye, amount in zip(self.dyes, self.amounts, strict=True):
            require_kind("a dye of a fluorescent surface", dye, FluorescentDye)
            require_range(f"the amount of dye {dye.name!r}", amount, 0.0, 1e6)
        nm = _checked_nm(self.color, self.dyes)
        sent_out = share_per_amount(self.dyes, nm) @ np.asarray(self.amounts, dtype=np.float64)
        name = self.color.name if isinstance(self.color, Spectrum) else "fluorescent"
        require_energy(name, nm, self.reflected(nm), sent_out)

    @classmethod
    def largest_share(cls, color: Paint, dyes: tuple[FluorescentDye, ...], amounts: tuple[float, ...]) -> float:
        """Largest factor, at most 1, on amounts of dyes for which a surface of ``color`` returns no more than
        arrives.
        """
        nm = _checked_nm(color, dyes)
        sent_out = share_per_amount(dyes, nm) @ np.asarray(amounts, dtype=np.float64)
        room = np.maximum(1.0 - cls(color).reflected(nm), 0.0)
        # Designed dyes use all the room that there is, and rounding must not count: beside a reflectance of 1 the
        # excitation of a dye is often 1e-20, of which no share would fit.
        excess = sent_out > room + ENERGY_SLACK
        return float(np.min((room[excess] + ENERGY_SLACK / 2) / sent_out[excess], initial=1.0))

    @property
    def checks_energy(self) -> bool:
        """True if the color is one that ``require_energy`` can check."""
        return isinstance(self.color, (Color, Spectrum))

    def reflected(self, wavelengths_nm: Array) -> Array:
        """Reflectance at any wavelengths, as it is rendered; zeros for a texture, whose reflectance varies."""
        if isinstance(self.color, Spectrum):
            return self.color.at(wavelengths_nm)
        if isinstance(self.color, Color):
            rgb = np.clip(self.color.linear_rgb, 0.0, 1.0)
            return np.full(wavelengths_nm.shape, float(rgb[0])) if np.ptp(rgb) == 0 else upsampled(rgb, wavelengths_nm)
        return np.zeros(wavelengths_nm.shape)

    def sent_out(self, light: Spectrum, wavelengths_nm: Array) -> Array:
        """Emission of the dyes at any wavelengths under a light, per nm, in the unit of reflected light."""
        total = np.zeros(wavelengths_nm.shape)
        for dye, amount in zip(self.dyes, self.amounts, strict=True):
            power = dye.absorbed_power(light, dye.excitation.grid)
            total = total + amount * power * dye.emission_density(wavelengths_nm)
        return total


def _checked_nm(color: Paint, dyes: tuple[FluorescentDye, ...]) -> Array:
    """Wavelengths at which energy is checked: whole nm, and the knots of narrower spectra."""
    spectra = [dye.excitation for dye in dyes] + ([color] if isinstance(color, Spectrum) else [])
    knots = np.concatenate([EXCITED_NM, *(spectrum.grid.wavelengths_nm for spectrum in spectra)])
    return np.unique(knots[(knots >= EXCITED_NM[0]) & (knots <= EXCITED_NM[-1])])


@dataclass(frozen=True, slots=True, eq=False)
class Transparent:
    """Transmits light without refraction, times ``color``."""

    color: Paint = field(default_factory=lambda: gray(1.0))

    def __post_init__(self) -> None:
        require_paint("Transparent color", self.color)
        require_declared(self)


@dataclass(frozen=True, slots=True, eq=False)
class Holdout:
    """Emits and scatters nothing; where the camera sees it, the picture is transparent."""


@dataclass(frozen=True, slots=True, eq=False)
class RayPortal:
    """Rays continue elsewhere, times ``color``: from ``position`` along ``direction`` in the world.

    Without a position they start at the point that they hit; without a direction, or with one of length 0, they keep
    theirs.
    """

    color: Paint = field(default_factory=lambda: gray(1.0))
    position: Computed | None = None
    direction: Computed | None = None

    def __post_init__(self) -> None:
        require_paint("RayPortal color", self.color)
        require_declared(self)
