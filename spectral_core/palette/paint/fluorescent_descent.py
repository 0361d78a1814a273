# SPDX-License-Identifier: GPL-3.0-or-later
"""Descent over the designed lights of a fluorescent palette, by variable projection (Golub and Pereyra 1973).

With the best surfaces for each choice of lights, the sum of squares is a function of the lights alone. Its gradient is
the partial one at these surfaces (the envelope theorem), so that L-BFGS-B within the bounds of the lights reaches in
tens of evaluations what takes thousands of rounds of one side after the other.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.requests import Requests
from spectral_core.palette.assemble.side import COLOR_NORM
from spectral_core.palette.design.lights import MEMORY
from spectral_core.palette.design.rounds import Budget
from spectral_core.palette.paint.fluorescent_spectra import FluorescentSpectra
from spectral_core.palette.problem import CellIndex

Array = NDArray[np.float64]

STALLED = 1e-12
"""Relative fall of the sum of squares in one iteration below which L-BFGS-B stops."""
SHARE = 0.7
"""Share of the time budget for the descent; the rounds after it settle the palette."""


class _OutOfTime(Exception):
    """Raised inside L-BFGS-B at the end of its share of the time."""


def descended(design: FluorescentSpectra, budget: Budget) -> int:
    """Move the lights of ``design`` downhill, with the best surfaces for them; the number of evaluations.

    Nothing happens if an exact cell restricts the lights, or if only one side is designed.
    """
    from scipy.optimize import minimize

    items = design.free_items("lights")
    if not items or not design.free_items("reflectances") or _is_restricted(design.requests):
        return 0
    begin = np.concatenate(_lights(design))
    unit = max(float(np.abs(begin).mean()), 1e-12)
    floor = budget.left * (1.0 - SHARE)
    size, best, evaluations, took = None, (np.inf, begin), 0, 0.0

    def phi(scaled: Array) -> tuple[float, Array]:
        nonlocal size, best, evaluations, took
        before = budget.left
        if before <= floor + took and evaluations:
            raise _OutOfTime
        evaluations += 1
        _place(design, items, unit * scaled)
        design.half_round("reflectances")
        objective, gradient = objective_by_lights(design)
        if objective < best[0]:
            best = objective, unit * scaled
        took = before - budget.left
        # L-BFGS-B compares decreases below 1 with 1: the objective is divided by its first value.
        size = max(objective, 1e-300) if size is None else size
        return objective / size, unit / size * gradient

    low, high = design.problem.light_bounds
    options = {"maxcor": MEMORY, "ftol": STALLED, "gtol": 0.0, "maxiter": 10_000, "maxfun": 10_000}
    with suppress(_OutOfTime):
        limits = [(low / unit, high / unit)] * begin.size
        minimize(phi, begin / unit, jac=True, method="L-BFGS-B", bounds=limits, options=options)
    _place(design, items, best[1])
    return evaluations


def objective_by_lights(design: FluorescentSpectra) -> tuple[float, Array]:
    """Half the sum of squares of all criteria at the present spectra, and its gradient by the designed lights."""
    shown = design.colors()
    items, n = design.free_items("lights"), design.problem.grid.size
    gradients = {j: np.zeros(n) for j in items}
    total = 0.0

    def add(cell: CellIndex, color: Array, weight: float) -> None:
        nonlocal total
        left, own = shown[cell] - color, weight**2 / COLOR_NORM**2
        total += 0.5 * own * float(left @ left)
        if cell[1] in gradients:
            gradients[cell[1]] += own * (left @ design.color_matrix("lights", cell))

    for target in design.requests.targets:
        add(target.cell, target.color, target.weight)
    for group in design.requests.groups:
        own = np.array(group.weights) ** 2
        common = np.average([shown[cell] for cell in group.members], axis=0, weights=own if own.any() else None)
        for cell, weight in zip(group.members, group.weights, strict=True):
            add(cell, np.clip(common, *group.box), weight)
    for surface in (each[:n] for each in design.surfaces if each is not None):
        total += 0.5 * float(surface @ design.roughness("reflectances")[1] @ surface)
    for j, light in zip(items, _lights(design), strict=True):
        rough = design.roughness("lights")[1] @ light
        total += 0.5 * float(light @ rough)
        gradients[j] += rough
    return total, np.concatenate([gradients[j] for j in items])


def _is_restricted(requests: Requests) -> bool:
    """True if any cell is exact: its multiplier is not part of the gradient above."""
    return any(target.exact for target in requests.targets) or any(any(group.exact) for group in requests.groups)


def _lights(design: FluorescentSpectra) -> list[Array]:
    """The designed lights."""
    return [values for values in design.lights if values is not None]


def _place(design: FluorescentSpectra, items: list[int], values: Array) -> None:
    for item, light in zip(items, np.split(values, len(items)), strict=True):
        design.lights[item] = light
