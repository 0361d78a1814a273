# SPDX-License-Identifier: GPL-3.0-or-later
"""Possible? of fluorescent materials: compared with linear programs in reflectances and amounts, and with a design."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from spectral_core.errors import InvalidInputError
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.palette.paint.fluorescence import led
from spectral_core.palette.paint.fluorescent_design import solve_fluorescent
from spectral_core.palette.reach.possible import possible_colors
from spectral_core.spectra.catalogue import color_matching_functions, illuminant
from spectral_core.spectra.color import RGB_FROM_XYZ, lab_from_linear_rgb
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import SpectralGrid

GRID = SpectralGrid.uniform(360, 740, 20)
LIGHTS = [normalized(illuminant("D65"), luminance=2.0), normalized(led(405), luminance=0.05)]
DYE = FluorescentDye.gaussian("green", 405, 530)
FINE = np.linspace(300, 830, 10601)
CMFS = np.stack([np.interp(FINE, color_matching_functions("cie_1931_2deg")[0], each, left=0, right=0)
                 for each in color_matching_functions("cie_1931_2deg")[1]])  # fmt: skip
POWERS = [np.interp(FINE, light.grid.wavelengths_nm, light.values, left=0, right=0) for light in LIGHTS]
HATS = np.stack([np.interp(FINE, GRID.wavelengths_nm, each, left=0, right=0) for each in np.eye(GRID.size)])
BELL = np.exp(-0.5 * ((FINE - 405) / 20) ** 2)
TAKEN = np.interp(FINE, GRID.wavelengths_nm, np.interp(GRID.wavelengths_nm, FINE, BELL), left=0, right=0)
SENT = np.exp(-0.5 * ((FINE - 530) / 20) ** 2)
STEP = FINE[1] - FINE[0]
SHOWN = [np.hstack([RGB_FROM_XYZ @ (CMFS * power) @ HATS.T * STEP,
                    (RGB_FROM_XYZ @ CMFS @ (SENT / SENT.sum()) * (TAKEN @ power) * STEP)[:, None]])
         for power in POWERS]  # fmt: skip
"""(3, n + 1): from a reflectance and an amount of the dye to the color under each light."""
GRAY = SHOWN[0][:, :-1] @ np.full(GRID.size, 0.25)
VIVID = (0.05, 0.9, 0.15)
"""Under the violet LED only a dye shows it."""


def palette(*cells) -> PaletteProblem:
    items = tuple(PaletteReflectance(f"paint {number}") for number in range(len(cells)))
    return PaletteProblem(GRID, tuple(map(PaletteLight, LIGHTS)), items, cells)


ALONE = palette((Cell.fixed(GRAY, exact=True), Cell.fixed(VIVID)))
TWINS = palette((Cell.free(), Cell.fixed(VIVID)), (Cell.same_as((0, 0), exact=True), Cell.black(exact=True)))


def extent(problem: PaletteProblem, direction: np.ndarray, dyed: bool) -> float:
    """Farthest color of cell (0, 1) by one program; the returned photons are limited at many wavelengths."""
    size, count = GRID.size + 1, len(problem.reflectances)
    held, ends = np.zeros((0, size * count)), np.zeros(0)
    if problem is ALONE:
        held, ends = SHOWN[0], GRAY
    else:
        plain = SHOWN[0] * np.append(np.ones(size - 1), 0)
        dark = np.hstack([np.zeros((3, size)), SHOWN[1] * np.append(np.ones(size - 1), 0)])
        held, ends = np.vstack([np.hstack([SHOWN[0], -plain]), dark]), np.zeros(6)
    inside = (GRID.wavelengths_nm[0] <= FINE) & (GRID.wavelengths_nm[-1] >= FINE)
    photons = TAKEN * np.maximum(1.0, DYE.emission_mean_nm / FINE)
    energy = np.hstack([HATS.T, photons[:, None]])[inside][::20]
    energy = np.hstack([energy, np.zeros((len(energy), size * (count - 1)))])
    amounts = [(0, None if dyed else 0)] + [(0, 0)] * (count - 1)
    bounds = [pair for amount in amounts for pair in [(0, 1)] * (size - 1) + [amount]]
    toward = np.concatenate([direction @ SHOWN[1], np.zeros(size * (count - 1))])
    answer = linprog(-toward, A_ub=energy, b_ub=np.ones(len(energy)), A_eq=held, b_eq=ends, bounds=bounds)
    assert answer.status == 0
    return float(-answer.fun)


@pytest.mark.parametrize("problem", [ALONE, TWINS], ids=["an exact color", "a metamer without the dye"])
def test_the_colors_of_a_dyed_material_reach_as_far_as_linear_programs_find(problem: PaletteProblem) -> None:
    plain, dyed = possible_colors(problem, (0, 1)), possible_colors(problem, (0, 1), dyes={0: [DYE]})
    for direction in np.random.default_rng(7).normal(size=(5, 3)):
        assert plain.reach.extent(direction)[0] == pytest.approx(extent(problem, direction, dyed=False), abs=2e-4)
        # The design limits the returned light a little more strictly between its samples.
        assert dyed.reach.extent(direction)[0] == pytest.approx(
            extent(problem, direction, dyed=True), rel=0.01, abs=2e-4
        )


def test_a_color_that_a_design_with_dyes_shows_is_possible() -> None:
    """It was called impossible, with a nearest color far away."""
    designed = solve_fluorescent(ALONE, {0: [DYE]})
    shown = designed.actual_linear_rgb[0, 1]
    colors = possible_colors(ALONE, (0, 1), dyes={0: [DYE]})
    assert colors.nearest(shown).reachable
    near, wanted = lab_from_linear_rgb(colors.nearest(VIVID).color), lab_from_linear_rgb(np.array(VIVID))
    assert np.linalg.norm(near - wanted) <= np.linalg.norm(lab_from_linear_rgb(shown) - wanted) + 0.01
    assert possible_colors(ALONE, (0, 1)).nearest(shown).delta_e_2000 > 10
    assert colors.alone(VIVID) <= colors.without((0, 0), VIVID) + 1e-6


def test_conflicts_name_cells_not_the_limit_of_energy() -> None:
    colors = possible_colors(ALONE, (0, 1), dyes={0: [DYE]})
    found = colors.nearest((0.9, 0.1, 0.1))
    assert not found.reachable
    assert [cell for cell, _ in colors.in_the_way(found)] == [(0, 0)]


def test_dyes_beside_other_bounds_are_refused() -> None:
    wide = PaletteProblem(GRID, ALONE.lights, ALONE.reflectances, ALONE.cells, reflectance_bounds=(-np.inf, np.inf))
    with pytest.raises(InvalidInputError, match="beside dyes they are from 0 to 1"):
        possible_colors(wide, (0, 1), dyes={0: [DYE]})
