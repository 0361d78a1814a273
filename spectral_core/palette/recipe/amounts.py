# SPDX-License-Identifier: GPL-3.0-or-later
"""The amounts of colorants whose colors are nearest to wanted ones, with few colorants."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from spectral_core.palette.recipe.sets import Mixing
from spectral_core.spectra.color import lab_from_linear_rgb

if TYPE_CHECKING:
    from spectral_core.palette.recipe.material import Colorants

Array = NDArray[np.float64]
FINISHED, EXACT = 6, 1e-4
"""Sets of paints or filters that are optimized to the end, until one has a squared CIELAB distance below EXACT."""
TRACE = 1e-4
"""Share of the largest amount below which an amount is left out, unless a color needs it."""


def lab_of(matrix: Array, reflectance: Array) -> Array:
    """CIELAB (L, 3) under each light, relative to the light's white."""
    return lab_from_linear_rgb((matrix @ reflectance).reshape(-1, 3))


def best_amounts(colorants: Colorants, matrix: Array, wanted: Array, most: int) -> Array:
    """Amounts (k,) of the best set: of all sets of inks, which are few; of paints and filters as ``Mixing`` finds."""
    count, best = len(colorants.names), (np.inf, np.zeros(len(colorants.names)))
    if colorants.kind == "inks":
        everything = _fitted(colorants, matrix, wanted, tuple(range(count)))
        if np.count_nonzero(everything) <= most:
            return everything
        sets = list(itertools.combinations(range(count), most))
    else:
        paper = None if colorants.kind == "paints" else colorants.paper
        sets = Mixing.of(colorants.spectra, paper, colorants.most, matrix, wanted).best_sets(most, FINISHED)
    for chosen in sets:
        amounts = _fitted(colorants, matrix, wanted, chosen)
        error = float(np.sum((lab_of(matrix, colorants.reflectance(amounts)) - wanted) ** 2))
        best = min(best, (error, amounts), key=lambda each: each[0])
        if error < EXACT:
            break
    return best[1]


def _fitted(colorants: Colorants, matrix: Array, wanted: Array, chosen: tuple[int, ...]) -> Array:
    """Amounts of the chosen colorants alone, by bounded least squares in CIELAB from three starts."""
    count = len(colorants.names)

    def full(part: Array) -> Array:
        amounts = np.zeros(count)
        amounts[list(chosen)] = part
        return amounts

    def residual(part: Array) -> Array:
        # Shares of paint are scale free; a small weight on the sum 1 makes the answer unique.
        of_sum = [1e-3 * (part.sum() - 1)] if colorants.kind == "paints" else []
        return np.concatenate([(lab_of(matrix, colorants.reflectance(full(part))) - wanted).ravel(), of_sum])

    low = 1e-9 if colorants.kind == "paints" else 0.0
    starts = [np.full(len(chosen), 1 / len(chosen)), np.full(len(chosen), 0.1), np.linspace(0.6, 0.1, len(chosen))]
    found = [least_squares(residual, start, bounds=(low, colorants.most), x_scale=0.1) for start in starts]
    part = min(found, key=lambda answer: answer.cost).x
    if colorants.kind == "paints":
        part = part / part.sum()
    part = _without_traces(part, lambda fewer: float(np.sum(residual(fewer) ** 2)))
    return full(part / part.sum() if colorants.kind == "paints" else part)


def _without_traces(part: Array, error: Callable[[Array], float]) -> Array:
    """The amounts (k,) without those below TRACE of the largest, except what a color needs: a trace of black in white.

    ``error``: of amounts, the squared CIELAB distance.
    """
    limit = error(part) + EXACT
    for index in np.argsort(part):
        fewer = np.where(np.arange(part.size) == index, 0.0, part)
        if part[index] > TRACE * part.max() or error(fewer) > limit:
            break
        part = fewer
    return part
