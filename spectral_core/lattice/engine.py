# SPDX-License-Identifier: GPL-3.0-or-later
"""The progressive lattice as a ``scipy.stats.qmc`` engine, for SciPy, SALib and other users of such engines.

A separate module because it imports scipy.stats, which takes most of a second.
"""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from spectral_core.checks import require_kind, require_whole
from spectral_core.errors import InvalidInputError
from spectral_core.lattice.catalogue import sampling_lattice
from spectral_core.lattice.construction import Lattice
from spectral_core.lattice.fill.frame import MAX_POINTS
from spectral_core.lattice.fill.progressive import ProgressivePoints, progressive_fill
from spectral_core.lattice.fill.regions import unit_cube

_SEED_NAME = "rng" if "rng" in inspect.signature(qmc.QMCEngine.__init__).parameters else "seed"


class LatticeEngine(qmc.QMCEngine):
    """Points of a rotated lattice in the unit cube, in progressive order.

    The first ``points`` samples are exactly the lattice points in the cube, coarse levels first; further draws refine
    the lattice, and no sample ever moves. ``rng`` (or ``seed``, its name in SciPy before 1.15) is an integer, a
    Generator or None; ``reset`` returns to the same sequence. Unlike Sobol points these are made for separation, not
    for integration (see docs/lattice.md).

    Parameters
    ----------
    d
        Dimensions, 1 to 16.
    points
        Size of the first level.
    rate
        Factor of the number of points from level to level, 2 or 3.
    lattice
        The lattice, such as ``make_lattice(d, criterion="second_moment")``; that of the largest packing radius if None.
    scramble
        Whether rotation and offset are drawn from ``rng``. Without, they are the same in every engine.
    optimization
        As for every engine of SciPy.
    rng
        Integer, Generator or None.
    seed
        The name of ``rng`` before SciPy 1.15.
    """

    def __init__(
        self,
        d: int,
        *,
        points: int = 1024,
        rate: int = 2,
        lattice: Lattice | None = None,
        scramble: bool = True,
        optimization: Any = None,
        rng: Any = None,
        seed: Any = None,
    ) -> None:
        if rng is not None and seed is not None:
            raise InvalidInputError("both rng and seed are given; give one (seed is the older name)")
        points = require_whole("points", points, 1, MAX_POINTS)
        if lattice is not None:
            require_kind("lattice", lattice, Lattice, "make_lattice")
        self._region = unit_cube(d)
        given = rng if seed is None else seed
        if isinstance(given, np.random.RandomState):
            given = int(given.randint(2**31 - 1))
        super().__init__(d=d, optimization=optimization, **{_SEED_NAME: np.random.default_rng(given)})
        self._planned = points
        if lattice is not None and lattice.dimensions != d:
            raise InvalidInputError(f"the lattice has {lattice.dimensions} dimensions, the engine {d}")
        self._lattice = sampling_lattice(d, rate) if lattice is None else lattice
        self._scramble = bool(scramble)
        self._progressive: ProgressivePoints | None = None

    def _random(self, n: int = 1, *, workers: int = 1) -> NDArray[np.float64]:
        n = _whole_samples(n)
        end = self.num_generated + n
        current = self._progressive
        if current is None:
            drawn = int(self.rng.integers(2**62)) if self._scramble else 0
            current = progressive_fill(self._region, self._planned, lattice=self._lattice, seed=drawn)
        while len(current) < end:
            current = current.refine()
        self._progressive = current
        return np.array(current.points[self.num_generated : end])

    def reset(self) -> LatticeEngine:
        """Back to the first sample of the same sequence."""
        super().reset()
        self._progressive = None
        return self

    def fast_forward(self, n: int) -> LatticeEngine:
        """Skip ``n`` samples."""
        n = _whole_samples(n)
        self._random(n)
        self.num_generated += n
        return self


def _whole_samples(n: int) -> int:
    """``n``, if it is a whole number of at least 0; else InvalidInputError."""
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 0:
        raise InvalidInputError(f"n is {n!r}; expected a number of samples of at least 0")
    return int(n)
