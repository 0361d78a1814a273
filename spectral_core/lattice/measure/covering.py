# SPDX-License-Identifier: GPL-3.0-or-later
"""Scales S chosen for covering: the least largest distance from any position to its nearest point.

The covering radius is the maximum of many smooth functions. It is therefore minimized without derivatives, by simplex
steps (Nelder and Mead) from many starts. Up to n = 6 it is computed from the exact Voronoi vertices. For larger n it is
estimated by the mean of the largest sampled distances; the result is then neither exact nor proven to be the best.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_whole
from spectral_core.lattice.classes import LatticeClass
from spectral_core.lattice.construction import MAX_LOG_SCALE, build_lattice
from spectral_core.lattice.measure.figures import covering_radius
from spectral_core.lattice.measure.voronoi import MAX_VERTEX_DIMENSIONS, voronoi_cell
from spectral_core.lattice.optimization import Search, cell_samples
from spectral_core.lattice.reduction import closest_vectors

Vector = NDArray[np.float64]

_SAMPLES = 4096
_FAR = 40


def optimize_covering(
    lattice_class: LatticeClass, *, starts: int = 6, seed: int = 0, initial: Vector | None = None, steps: int = 120
) -> Search:
    """Scales of the least covering radius found from ``starts`` random starts; ``initial``, if given, is the first.

    Bounded work: ``steps`` evaluations per start; n to 12. ``value`` is exact to n = 6, a lower bound of the radius
    beyond (``figures.covering_radius``).
    """
    from scipy.optimize import minimize

    require_whole("starts", starts, 1, 1 << 31)
    require_whole("steps", steps, 1, 1 << 31)
    sizes = lattice_class.polynomial.block_sizes
    points = cell_samples(lattice_class.polynomial.dimensions, _SAMPLES, seed)
    rng = np.random.default_rng(seed)
    found = []
    for start in range(starts if len(sizes) > 1 else 1):
        given = start == 0 and initial is not None
        free = np.asarray(initial)[:-1] if given and initial is not None else rng.uniform(-4.0, 4.0, len(sizes) - 1)
        if len(free):
            answer = minimize(
                lambda x: _radius(lattice_class, _full(x, sizes), points),
                free,
                method="Nelder-Mead",
                options={"maxfev": steps, "xatol": 1e-7, "fatol": 1e-10, "initial_simplex": _simplex(free)},
            )
            found.append((float(answer.fun), _full(answer.x, sizes)))
        else:
            found.append((_radius(lattice_class, np.zeros(len(sizes)), points), np.zeros(len(sizes))))
    best = min(found, key=lambda one: one[0])
    lattice = build_lattice(lattice_class, best[1], criterion="covering")
    hits = sum(value < best[0] * (1.0 + 1e-6) for value, _ in found)
    return Search(lattice, covering_radius(lattice.generator).lower, starts, hits, 0.0)


def _full(free: Vector, sizes: NDArray[np.int64]) -> Vector:
    """All log scales from all but the last: Σ size · log w = 0."""
    return np.append(free, -(sizes[:-1] @ free) / sizes[-1])


def _simplex(free: Vector) -> Vector:
    return np.concatenate([free[None], free + 0.15 * np.eye(len(free))])


def _radius(lattice_class: LatticeClass, logs: Vector, points: Vector) -> float:
    """Covering radius to n = 6; beyond, the mean of the largest sampled distances (smoother than the largest)."""
    if np.abs(logs).max() > MAX_LOG_SCALE - 1.0:
        return 1e3
    lattice = build_lattice(lattice_class, logs)
    if lattice.dimensions <= MAX_VERTEX_DIMENSIONS:
        return voronoi_cell(lattice.generator).covering_radius
    coordinates = points @ np.rint(np.linalg.inv(lattice.basis_change.astype(np.float64))).T
    _, squared = closest_vectors(lattice.reduced, (coordinates - np.floor(coordinates)) @ lattice.reduced.T)
    return float(np.sqrt(np.sort(squared)[-_FAR:].mean()))
