# SPDX-License-Identifier: GPL-3.0-or-later
"""Perceptual matches of a single side, whose metric depends on the colors that the palette shows."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.presets import design_grid
from spectral_core.palette.qp.quadratic import least_in_box
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import lab_jacobian_from_linear_rgb
from spectral_core.spectra.observer import linear_rgb_from_product, normalized
from spectral_core.spectra.spectrum import SpectralGrid


def perceptual(lamps, cells, grid, **settings):
    lights = tuple(PaletteLight(normalized(illuminant(name))) for name in lamps)
    materials = tuple(PaletteReflectance(f"material {i}") for i in range(len(cells)))
    return PaletteProblem(grid, lights, materials, cells, match="perceptual", **settings)


@pytest.mark.parametrize(
    ("lamps", "box"),
    [
        (("D65", "A"), ((0.04, 0.48, 0.0), (0.22, 0.63, 0.16))),
        (("A", "D65"), ((0.3, 0.3, 0.3), (0.6, 0.6, 0.6))),
        (("LPS", "A"), ((0.3, 0.3, 0.3), (0.6, 0.6, 0.6))),
    ],
)
def test_a_box_beside_black_settles(lamps, box):
    """The metric was that of the shown color: dark, it weighed so much that the next color was in the box, and back.
    Such palettes were still improving, and "Solve again to continue" gave the same answer.
    """
    from scipy.optimize import lsq_linear

    grid = design_grid()
    problem = perceptual(lamps, ((Cell.free(box), Cell.black()),), grid, smoothness=0.0)
    solution = solve_palette(problem, explain=False)
    assert solution.status.trusted
    # The optimum with the metrics at the colors that are wanted, by another method: over the reflectance, and a color
    # in the box.
    shown, black = solution.actual_linear_rgb[0], np.zeros(3)
    slopes = lab_jacobian_from_linear_rgb([np.clip(shown[0], *box), black])
    rows = [linear_rgb_from_product(light.spectrum, grid) for light in problem.lights]
    system = np.block([[slopes[0] @ rows[0], -slopes[0]], [slopes[1] @ rows[1], np.zeros((3, 3))]])
    ends = [np.append(np.full(grid.size, end), box[int(end)]) for end in (0.0, 1.0)]
    best = lsq_linear(system, np.zeros(6), ends, tol=1e-13).cost
    nearest = lsq_linear(slopes[0], slopes[0] @ shown[0], box, tol=1e-13).cost
    assert nearest + np.sum((slopes[1] @ shown[1]) ** 2) / 2 <= best * (1 + 1e-4)


def test_shared_colors_settle_in_few_rounds():
    """Rounds that begin where the last one ended took 26 here; elsewhere they came back to the same two colors."""
    orange = (1.11, 0.31, -0.09), (1.22, 0.39, 0.22)
    cells = ((Cell.free(), Cell.constant((0, 0)), Cell.free(orange)),)
    problem = perceptual(("LED-V1", "D50", "HP1"), cells, SpectralGrid.uniform(400, 700, 10), smoothness=1e-3)
    solution = solve_palette(problem, explain=False)
    assert solution.status.trusted
    assert solution.rounds <= 20


def test_the_best_color_in_a_box_does_not_depend_on_the_weights_of_other_colors():
    """Beside exact cells the curvature of a soft color is 1e-10: it was anywhere in its box, by up to 1.4, and palettes
    counted as optimal that could still lose a thousandth of their sum of squares.
    """
    from scipy.optimize import lsq_linear

    metric = np.array([[1.0, 0.9, 0.2], [0.1, 1.0, 0.8], [0.3, 0.2, 1.0]])
    low, high = np.array([0.2, 0.1, 0.3]), np.array([0.9, 0.4, 0.5])
    for weight in (1.0, 1e5, 1e10):
        hessian, linear = np.zeros((6, 6)), np.zeros(6)
        hessian[:3, :3], linear[:3] = weight * metric.T @ metric, weight * metric.T @ metric @ [0.5, 0.6, 0.7]
        hessian[3:, 3:], linear[3:] = 0.3 * metric.T @ metric, 0.3 * metric.T @ metric @ [1.4, -0.1, 0.9]
        ends = np.append(np.full(3, -np.inf), low), np.append(np.full(3, np.inf), high)
        found = least_in_box(hessian, linear, *ends, np.zeros(6))
        expected = lsq_linear(metric, metric @ [1.4, -0.1, 0.9], (low, high), tol=1e-14).x
        np.testing.assert_allclose(found, [0.5, 0.6, 0.7, *expected], atol=1e-6)
