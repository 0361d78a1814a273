# SPDX-License-Identifier: GPL-3.0-or-later
"""Designs of m points in the unit cube as functions of (n, m, seed); None if impossible."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from spectral_core import lattice
from spectral_core.lattice.construction import Lattice
from spectral_core.lattice.fill.frame import random_rotation

Points = NDArray[np.float64] | None


def _random(n: int, m: int, seed: int) -> Points:
    return np.random.default_rng(seed).random((m, n))


def _sobol(n: int, m: int, seed: int) -> Points:
    from scipy.stats import qmc

    return np.asarray(qmc.Sobol(n, seed=np.random.default_rng(seed)).random(m))


def _halton(n: int, m: int, seed: int) -> Points:
    from scipy.stats import qmc

    return np.asarray(qmc.Halton(n, seed=np.random.default_rng(seed)).random(m))


def _latin(n: int, m: int, seed: int) -> Points:
    from scipy.stats import qmc

    return np.asarray(qmc.LatinHypercube(n, seed=np.random.default_rng(seed)).random(m))


def _latin_optimised(n: int, m: int, seed: int) -> Points:
    from scipy.stats import qmc

    if m > 256:  # minutes beyond
        return None
    engine = qmc.LatinHypercube(n, optimization="random-cd", seed=np.random.default_rng(seed))
    return np.asarray(engine.random(m))


def _poisson(n: int, m: int, seed: int) -> Points:
    """Poisson disk samples with the radius that dart throwing reaches in the cube; their number is not controlled."""
    from scipy.stats import qmc

    if n > 3 or m > 256:  # SciPy's grid of cells grows with the power n, and so does the time
        return None
    radius = {2: 0.80, 3: 0.84}[n] * m ** (-1.0 / n)
    return np.asarray(qmc.PoissonDisk(n, radius=radius, seed=np.random.default_rng(seed)).fill_space()[:m])


def _r_sequence(n: int, m: int, seed: int) -> Points:
    """Roberts' generalised golden ratio sequence, randomly shifted."""
    ratio = 2.0
    for _ in range(60):
        ratio = (1.0 + ratio) ** (1.0 / (n + 1))
    steps = (1.0 / ratio) ** np.arange(1, n + 1)
    return np.asarray((np.random.default_rng(seed).random(n) + np.arange(1, m + 1)[:, None] * steps) % 1.0)


def _korobov(n: int, m: int, seed: int) -> Points:
    """Rank-1 lattice of Korobov form whose generator is the best packing of 60 drawn ones."""
    from scipy.spatial import KDTree

    rng = np.random.default_rng(seed)
    best: tuple[float, NDArray[np.float64]] | None = None
    shift = rng.random(n)
    for generator in rng.choice(np.arange(2, m), min(60, m - 2), replace=False):
        vector = np.array([pow(int(generator), j, m) for j in range(n)])
        points = (np.arange(m)[:, None] * vector % m / m + shift) % 1.0
        nearest = float(KDTree(points, boxsize=1.0).query(points, k=2)[0][:, 1].min())
        if best is None or nearest > best[0]:
            best = nearest, points
    return None if best is None else best[1]


def _grid(n: int, m: int, seed: int) -> Points:
    """Full factorial of cell middles, where m is a power of n."""
    levels = round(m ** (1.0 / n))
    if levels**n != m:
        return None
    middles = (np.arange(levels) + 0.5) / levels
    return np.stack(np.meshgrid(*[middles] * n, indexing="ij"), axis=-1).reshape(-1, n)


def _best_known(n: int, m: int, seed: int) -> Points:
    """The densest known lattice (D10+ for 10), rotated, exactly m points; it has no levels of rate 2 or 3."""
    basis = lattice.best_known(n)
    return None if basis is None else _any_lattice(basis, m, seed)


def _turned_grid(n: int, m: int, seed: int) -> Points:
    return _any_lattice(np.eye(n), m, seed)


def _any_lattice(basis: NDArray[np.float64], m: int, seed: int) -> Points:
    """Exactly m points of a lattice with a given basis, which replaces the generator of a ready one."""
    from dataclasses import replace

    ready = lattice.make_lattice(len(basis), 2)
    other = replace(ready, generator=basis)
    rotation = random_rotation(len(basis), np.random.default_rng([seed, 1]))
    frame, k = lattice.fill_exactly(other, lattice.unit_cube(len(basis)), m, seed=seed, rotation=rotation)
    return np.asarray(frame.origin + frame.spacing * (k @ (rotation @ basis).T))


def _ours(rate: int, criterion: str) -> Callable[[int, int, int], Points]:
    def design(n: int, m: int, seed: int) -> Points:
        chosen: Lattice = lattice.make_lattice(n, rate, criterion=criterion)
        return lattice.progressive_fill(lattice.unit_cube(n), m, lattice=chosen, seed=seed).points

    return design


def _ours_latin(n: int, m: int, seed: int) -> Points:
    return lattice.latinized(lattice.progressive_fill(lattice.unit_cube(n), m, seed=seed).points)


DESIGNS: dict[str, Callable[[int, int, int], Points]] = {
    "random": _random,
    "Sobol, scrambled": _sobol,
    "Halton, scrambled": _halton,
    "Latin hypercube": _latin,
    "Latin hypercube, random-cd": _latin_optimised,
    "Poisson disk": _poisson,
    "R-sequence": _r_sequence,
    "rank-1 Korobov, maximin": _korobov,
    "Cartesian, aligned": _grid,
    "Cartesian, rotated": _turned_grid,
    "densest known lattice, rotated": _best_known,
    "ours, rate 2, packing": _ours(2, "packing"),
    "ours, rate 3, packing": _ours(3, "packing"),
    "ours, rate 2, second moment": _ours(2, "second_moment"),
    "ours, rate 2, packing, latinized": _ours_latin,
}
PROGRESSIVE = ("Sobol, scrambled", "Halton, scrambled", "R-sequence", "ours, rate 2, packing", "ours, rate 3, packing",
               "ours, rate 2, second moment")  # fmt: skip
"""Designs of which a prefix is meant to be used."""
