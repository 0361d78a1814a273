# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of Possible? and the color that it offers, where exact cells leave few colors: by linear programs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.explain.inward import inward
from spectral_core.palette.reach.possible import possible_colors, section_linear_rgb
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.color import display_rgb_from_linear, lab_from_linear_rgb, linear_from_display_rgb
from spectral_core.spectra.observer import linear_rgb_from_product, normalized
from spectral_core.spectra.spectrum import SpectralGrid

GRID = SpectralGrid.uniform(400, 700, 10)


def table(exact: tuple[str, ...], shown: str, values: np.ndarray) -> tuple[PaletteProblem, np.ndarray]:
    """One material, exact under some lights with the colors of ``values``; and the matrices of all lights."""
    lights = [normalized(illuminant(name), luminance=2.0) for name in (*exact, shown)]
    matrices = np.stack([linear_rgb_from_product(light, GRID) for light in lights])
    row = (*(Cell.fixed(matrix @ values, exact=True) for matrix in matrices[:-1]), Cell.ignore())
    columns = tuple(PaletteLight(light) for light in lights)
    return PaletteProblem(GRID, columns, (PaletteReflectance("leaf"),), (row,)), matrices


def nearest_possible(color: np.ndarray, matrices: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The possible color whose largest channel of difference is least."""
    size = GRID.size
    own = np.block([[matrices[-1], -np.ones((3, 1))], [-matrices[-1], -np.ones((3, 1))]])
    held = matrices[:-1].reshape(-1, size)
    found = linprog(
        np.append(np.zeros(size), 1.0), A_ub=own, b_ub=np.append(color, -color),
        A_eq=np.column_stack([held, np.zeros(len(held))]), b_eq=held @ values,
        bounds=[(0, 1)] * size + [(0, None)], method="highs",
    )  # fmt: skip
    return matrices[-1] @ found.x[:-1]


@pytest.mark.parametrize(("exact", "shown"), [((), "D65"), (("D65", "A"), "FL2"), (("FL2",), "FL11")])
def test_no_color_is_drawn_that_is_visibly_outside(exact, shown) -> None:
    """The set beside exact cells is long and narrow: even directions drew it several times too wide."""
    values = reflectance("foliage").at(GRID.wavelengths_nm)
    asked, matrices = table(exact, shown, values)
    lightness = float(lab_from_linear_rgb(matrices[-1] @ values)[0])
    inside, colors = possible_colors(asked, (0, len(exact))).section(lightness, 96), section_linear_rgb(lightness, 96)
    drawn = colors[inside]
    assert len(drawn) > 5
    far = []
    for color in drawn[:: max(1, len(drawn) // 40)]:
        possible = nearest_possible(color, matrices, values)
        far.append(np.linalg.norm(lab_from_linear_rgb(color) - lab_from_linear_rgb(possible)))
    assert max(far) < 1.0


def in_single_precision(color: np.ndarray) -> np.ndarray:
    """A display color as Blender stores it, read back."""
    return linear_from_display_rgb(display_rgb_from_linear(color).astype(np.float32).astype(np.float64))


@pytest.mark.parametrize(("exact", "shown"), [(("D65",), "D60"), (("D65",), "HP1"), (("HP1",), "LPS")])
def test_an_exact_cell_can_have_the_offered_color_in_single_precision(exact, shown) -> None:
    """It was on the surface, and its rounding outside: the palette called it a conflict."""
    asked, _ = table(exact, shown, reflectance("orange").at(GRID.wavelengths_nm))
    cell = (0, len(exact))
    colors = possible_colors(asked, cell)
    for wanted in ([0.1, 0.8, 0.1], [0.7, 0.2, 0.6], [0.2, 0.3, 0.9]):
        nearest = colors.nearest(wanted)
        assert not nearest.reachable
        taken = inward(colors.reach, nearest.color, in_single_precision)
        assert np.linalg.norm(lab_from_linear_rgb(taken) - lab_from_linear_rgb(nearest.color)) < 0.2
        exactly = asked.with_cell(cell, Cell.fixed(in_single_precision(taken), exact=True))
        assert solve_palette(exactly, explain=False).status.usable
