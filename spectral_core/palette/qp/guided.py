# SPDX-License-Identifier: GPL-3.0-or-later
"""The method of an edit: daqp for the spectra that changed, at the old free colors, and the walk from there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.active_set import ActiveSet
from spectral_core.palette.qp.backends import lone_spectrum

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

DENSE_LIMIT = 200
"""Samples of a spectrum from which piqp finds the active bounds sooner than dense factors do."""
FEW = 3
"""Samples of a changed spectrum that leave their bounds up to which the walk is sooner there than daqp."""


def guided(active: ActiveSet, begin: Array, free: Mask, changed: list[int] | None) -> bool:
    """The walk from the last answer; True if it reached an optimum.

    With the changed spectra at their optimum for the old colors, the start is again the optimum of a problem with
    another linear term, by the colors alone, and the walk from there is short: daqp passes the hundred breakpoints of
    one spectrum in the time of a few steps.

    Parameters
    ----------
    active
        Where the last answer and its eliminations are; holds the new optimum afterward.
    begin
        All unknowns of the last answer, within bounds.
    free
        Which of them were off their bounds.
    changed
        Blocks that differ from the last problem; None for all.
    """
    colors = begin[: active.colors]
    for k in range(len(active.arrow.spectra)) if changed is None else changed:
        at = slice(active.offsets[k], active.offsets[k + 1])
        # daqp factors densely; past the limit the walk itself is the faster way to the bounds.
        if at.stop - at.start >= DENSE_LIMIT:
            continue
        unkept = None if changed is None else active.unkept(k, colors)
        if unkept is not None and unkept <= FEW:
            continue
        spectrum = active.arrow.spectra[k]
        found = lone_spectrum(spectrum, active.lower[at], active.upper[at], colors, begin[at])
        if found is not None:
            begin, free = begin.copy(), free.copy()
            begin[at], free[at] = found
    return active.walk(begin, free)
