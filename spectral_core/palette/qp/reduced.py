# SPDX-License-Identifier: GPL-3.0-or-later
"""The method between active set and walk: Newton's method in the few free colors, daqp for each spectrum at them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.active_set import ActiveSet
from spectral_core.palette.qp.backends import lone_spectrum

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

DENSE_LIMIT = 200
"""Samples of a spectrum from which piqp finds the active bounds faster than dense factors do."""
REDUCED_STEPS = 12
"""Newton steps in the free colors before the walk is used; three to six are usual."""
OVERSHOT, HALVINGS = 0.5, 6
"""Slope at the end of a step, as a share of that at its beginning, from which the step is cut back; and how often."""
QUICK_STEPS = 2
"""Active-set steps after an edit of one spectrum that daqp has already solved; more rarely succeed."""


def guided(active: ActiveSet, begin: Array, free: Mask, changed: list[int] | None, *, walk: bool) -> bool:
    """The walk, after the changed spectra were solved at the old free colors.

    Such a point is again the optimum of a problem with another linear term, by the colors, and the walk from there is
    short: daqp passes the hundred breakpoints of one spectrum in the time of a few steps.

    Parameters
    ----------
    active
        Where the last answer and the factors are; holds the new optimum afterwards.
    begin
        All unknowns of the last answer, within bounds.
    free
        Which of them were off their bounds.
    changed
        Blocks that differ from the last problem; None for all.
    walk
        Whether the walk, the slowest gear, may be asked.

    Returns
    -------
    Whether it arrived at an optimum.
    """
    arrow = active.arrow
    begin, free = begin.copy(), free.copy()
    for k in range(len(arrow.spectra)) if changed is None else changed:
        at = slice(active.offsets[k], active.offsets[k + 1])
        # daqp factors densely; beyond the limit the walk itself is faster.
        if at.stop - at.start < DENSE_LIMIT:
            colors = begin[: active.colors]
            found = lone_spectrum(arrow.spectra[k], active.lower[at], active.upper[at], colors, begin[at])
            if found is not None:
                begin[at], free[at] = found
    active.begin(begin, free)
    return (
        active.settle(1 if changed is None else QUICK_STEPS) or _reduced(active) or (walk and active.walk(begin, free))
    )


def _reduced(active: ActiveSet) -> bool:
    """Newton's method in the free colors alone, with each spectrum at its optimum; True if it converged.

    The sum of squares with every spectrum at its optimum is a convex, piecewise quadratic function of the few free
    colors. A step solves the colors with the present bounds held; daqp then finds the bounds of those spectra that
    violate theirs at the new colors. If none does, that is the optimum. If a step is so long that the function rises
    steeply again, it is shortened to the zero of the slope, by the secant.
    """
    count = active.colors
    before, step, fall = np.zeros(count), np.zeros(count), 0.0
    for number in range(REDUCED_STEPS):
        # The last step's changes are stale: the spectra whose bounds changed at the colors that it found.
        colors = np.clip(active.goal[:count], active.lower[:count], active.upper[:count])
        if not _solved_at(active, colors):
            return False
        slope = active.slope(colors)
        reach = 1.0
        for _ in range(HALVINGS if number else 0):
            rise = float(slope @ step)
            # A step limited by color boxes, or one of rounding alone, need not decrease the function.
            if fall >= 0 or rise <= OVERSHOT * -fall:
                break
            # Secant for the zero of the slope between the ends of the step: the function is convex, so the zero lies
            # within.
            reach *= fall / (fall - rise)
            colors = before + reach * step
            if not _solved_at(active, colors):
                return False
            slope = active.slope(colors)
        # One active-set step also solves for the colors, which is the Newton step itself.
        if active.settle(1):
            return True
        before, step = colors, np.clip(active.goal[:count], active.lower[:count], active.upper[:count]) - colors
        fall = float(slope @ step)
    return False


def _solved_at(active: ActiveSet, colors: Array) -> bool:
    """Solve all spectra at given free colors; True if that was possible."""
    changing = active.unkept(colors)
    if not changing:
        return True
    begin, free = active.x.copy(), active.free.copy()
    for k in changing:
        at = slice(active.offsets[k], active.offsets[k + 1])
        if at.stop - at.start >= DENSE_LIMIT:
            return False
        found = lone_spectrum(active.arrow.spectra[k], active.lower[at], active.upper[at], colors, begin[at])
        if found is None:
            return False
        begin[at], free[at] = found
    active.begin(begin, free)
    return True
