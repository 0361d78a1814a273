# SPDX-License-Identifier: GPL-3.0-or-later
"""Designed dyes return no more photons than arrive, at every wavelength, and no renderer needs to reduce them."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, presets
from spectral_core.palette.paint.fluorescence import FluorescentSurface, led
from spectral_core.palette.paint.fluorescent_design import solve_fluorescent
from spectral_core.scene import Fluorescent
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import Reflectance, SpectralGrid, Spectrum


def photons_returned(surface: FluorescentSurface) -> np.ndarray:
    """Photons out for each photon in, at steps of 0.1 nm, by sums: of the design's excitation, linear on its grid."""
    knots = surface.grid.wavelengths_nm
    nm = np.arange(knots[0], knots[-1], 0.1)
    total = np.interp(nm, knots, surface.reflectance.values)
    for dye, amount in zip(surface.dyes, surface.amounts, strict=True):
        own = dye.emission.grid.wavelengths_nm
        fine = np.arange(own[0], own[-1], 0.1)
        sent = np.interp(fine, own, dye.emission.values)
        taken = np.interp(knots, dye.excitation.grid.wavelengths_nm, dye.excitation.values, left=0, right=0)
        total += amount * np.interp(nm, knots, taken) * (fine @ sent) / sent.sum() / nm
    return total


def as_rendered(surface: FluorescentSurface) -> tuple[FluorescentDye, ...]:
    """The dyes at the wavelengths of the design, as the translation of a Blender scene makes them."""
    grid = surface.grid
    return tuple(FluorescentDye(d.name, Spectrum("x", grid, d.excitation_on(grid)), d.emission) for d in surface.dyes)


def test_a_designed_dye_is_rendered_with_its_own_amount() -> None:
    """Beside a reflectance of 1 the excitation was 1e-20, of which no share fits: F12 showed no dye."""
    solution = solve_fluorescent(presets.hidden_mark(), {1: [FluorescentDye.gaussian("green", 400, 530)]})
    surface = solution.surfaces[1]
    assert surface.amounts[0] > 0.1
    assert surface.reflectance.values.max() > 1 - 1e-9
    assert Fluorescent.largest_share(surface.reflectance, as_rendered(surface), tuple(surface.amounts)) == 1.0
    Fluorescent(surface.reflectance, as_rendered(surface), tuple(surface.amounts))


@pytest.mark.parametrize("step_nm", [10.0, 20.0])
def test_no_photon_is_gained_between_two_knots(step_nm: float) -> None:
    """Up to 0.9 % were: the share of photons is no line between knots where the excitation rises steeply."""
    grid = SpectralGrid.uniform(360, 740, step_nm)
    lights = (PaletteLight(led(410)), PaletteLight(normalized(illuminant("D65"))))
    cells = ((Cell.fixed((0.0, 9.0, 0.0)), Cell.fixed((0.9, 0.95, 0.6))),)
    problem = PaletteProblem(grid, lights, (PaletteReflectance("paint"),), cells)
    dyes = [FluorescentDye.gaussian(f"{taken}", taken, 540, widths_nm=(8.0, 15.0)) for taken in (400, 425)]
    solution = solve_fluorescent(problem, {0: dyes})
    (surface,) = solution.surfaces
    assert surface.amounts.max() > 0.1
    returned = photons_returned(surface)
    assert 0.98 < returned.max() < 1 + 1e-7
    assert solution.largest_returned_share == pytest.approx(1.0, abs=1e-9)
    assert Fluorescent.largest_share(surface.reflectance, as_rendered(surface), tuple(surface.amounts)) == 1.0


def test_a_surface_that_returns_too_much_between_knots_is_refused() -> None:
    grid = SpectralGrid.uniform(360, 740, 20)
    taken = np.where(grid.wavelengths_nm == 420, 1.0, 0.0)
    emission = Spectrum("emission", SpectralGrid(np.array([520.0, 560.0])), np.ones(2))
    dye = FluorescentDye("steep", Spectrum("excitation", grid, taken), emission)
    reflected = np.where(grid.wavelengths_nm == 400, 1.0, 0.0)
    amounts = np.array([420 / 540])  # all photons at the knot of 420 nm
    with pytest.raises(InvalidInputError, match=r"returns 1\.0\d+ of the light at 4\d+"):
        FluorescentSurface("paint", Reflectance("paint", grid, reflected), (dye,), amounts)


def test_reduced_dyes_are_accepted() -> None:
    color = Reflectance("gray", SpectralGrid(np.array([300.0, 830.0])), np.array([0.5, 0.5]))
    dye = FluorescentDye.gaussian("green", 400, 530)
    share = Fluorescent.largest_share(color, (dye,), (0.8,))
    assert 0.3 < share < 0.6
    Fluorescent(color, (dye,), (0.8 * share,))
