# SPDX-License-Identifier: GPL-3.0-or-later
"""How many local searches for distinct colors begin, and at which spectra."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.distinct.cells import distinct_pairs, least_difference
from spectral_core.palette.problem import PaletteProblem
from spectral_core.palette.solution import PaletteSolution

Array = NDArray[np.float64]

APART = 1.0
"""ΔE2000 from which distinct cells count as different at all."""
DIRECTIONS = 6
"""Usual number of searches that begin along random directions of color."""
SPECTRA = 6
"""Searches for two cells that begin at random spectra, too: directions lead both colors to corners of what is possible,
where one may have to be elsewhere. With two cells a search is short.
"""
VALUES = 4, 12
"""Least number of random values between which a random spectrum is a line, and the one that it stays below."""


def usual_starts(problem: PaletteProblem, warm: PaletteSolution | None) -> int:
    """Number of searches along directions: none if an earlier solution is a start."""
    return DIRECTIONS if warm is None or _coincide(problem, warm) else 0


def _coincide(problem: PaletteProblem, warm: PaletteSolution) -> bool:
    """True if an earlier solution cannot be a start: its shape differs, or its distinct colors are still equal."""
    shape = (len(problem.reflectances), len(problem.lights), 3)
    return warm.actual_linear_rgb.shape != shape or least_difference(replace(warm, problem=problem)) < APART


def searches_from_spectra(problem: PaletteProblem, starts: int) -> int:
    """Number of searches that begin at random spectra, beside a number of ``starts`` along directions."""
    cells = {cell for pair in distinct_pairs(problem) for cell in pair}
    return SPECTRA if starts >= DIRECTIONS and len(cells) == 2 else 0


def random_spectra(sizes: Sequence[int], rng: np.random.Generator) -> Array:
    """Smooth spectra between 0 and 1 with these numbers of samples, one behind the other."""
    drawn = []
    for size in sizes:
        values = rng.random(rng.integers(*VALUES))
        drawn.append(np.interp(np.linspace(0.0, len(values) - 1.0, size), np.arange(len(values)), values))
    return np.concatenate(drawn)
