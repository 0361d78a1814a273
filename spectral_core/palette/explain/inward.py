# SPDX-License-Identifier: GPL-3.0-or-later
"""A possible color that is possible with the digits with which it is stored, too.

The color that is nearest to an impossible one is on the surface of the possible ones. Where it is stored with fewer
digits, as in Blender, it may be outside of them by more than an exact cell allows.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from spectral_core.palette.assemble.equations import equation_of
from spectral_core.palette.assemble.limits import OPEN, Limits
from spectral_core.palette.design.decided import HELD
from spectral_core.palette.design.linear_programs import LARGE, TOLERANCES
from spectral_core.palette.reach.reachable import CellReach
from spectral_core.spectra.color import display_rgb_from_linear, linear_from_display_rgb

Array = NDArray[np.float64]

SHARES = 1e-6, 1e-5, 1e-4, 1e-3
"""Shares of the way to the middle of the possible colors that are tried; the largest is about a tenth of a ΔE."""
OUTLINE = 8
"""Extreme colors whose mean is the middle."""


def inward(reach: CellReach, color: Array, stored: Callable[[Array], Array]) -> Array:
    """The possible color (3,), linear sRGB, moved inward until ``stored`` of it is possible beside the exact cells.

    ``stored`` returns a color as it is read back. The color itself if no such color is found, as under a lamp of one
    line, whose colors are a line themselves.
    """
    if _miss(reach, stored(color)) <= HELD / 2:
        return color
    middle = reach.outline(OUTLINE).mean(axis=0)
    if np.isfinite(middle).all():
        for share in SHARES:
            moved = np.asarray(color + share * (middle - color))
            if _miss(reach, stored(moved)) <= HELD / 2:
                return moved
    return color


def in_single_precision(color: Array) -> Array:
    """A color (3,), linear sRGB, as it is read back from a target in Blender: a color of the display in single
    precision, of a linear color in single precision.
    """
    kept = np.asarray(color, dtype=np.float32).astype(np.float64)
    return linear_from_display_rgb(display_rgb_from_linear(kept).astype(np.float32).astype(np.float64))


def _miss(reach: CellReach, color: Array) -> float:
    """Least miss, in linear RGB, of the worst of a color and the equations beside it."""
    limits = Limits(reach.matrix.shape[1], reach.bounds, [*reach.equations, equation_of(reach.matrix, color)])
    low, high = limits.lower[limits.size :], limits.upper[limits.size :]
    scale = LARGE / max(float(np.abs(limits.rows).max()), 1e-300)
    rows = np.column_stack([np.concatenate([limits.rows, -limits.rows]), np.full(2 * len(low), -1.0 / scale)])
    ends = np.concatenate([high, -low])
    closed = ends < OPEN
    answer = linprog(
        np.append(np.zeros(limits.size), 1.0), A_ub=scale * rows[closed], b_ub=scale * ends[closed],
        bounds=[reach.bounds] * limits.size + [(0.0, None)], method="highs", options=TOLERANCES,
    )  # fmt: skip
    return np.inf if answer.x is None else float(answer.x[-1]) / scale
