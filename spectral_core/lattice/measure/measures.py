# SPDX-License-Identifier: GPL-3.0-or-later
"""Evenness of points in the unit cube: distances, projections, discrepancy; and Latin projections.

Lengths are in units of m^(-1/n), the edge of the cube of volume 1/m, so that designs of any size compare: for an
unbounded lattice ``separation`` is its packing radius and ``mean_square`` its second moment.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, require_range, require_whole
from spectral_core.errors import InvalidInputError

Matrix = NDArray[np.float64]
MOST_PAIRED = 20_000
"""Most points whose discrepancy is computed, from all their pairs: a hundred thousand take minutes."""


@dataclass(frozen=True)
class Evenness:
    """Measures of m points in the unit cube; see the fields."""

    points: int
    separation: float
    """Half the least distance of two points, times m^(1/n); larger is better."""
    fill_distance: float
    """Largest distance from a position of the cube to its nearest point (sampled, corners included), times m^(1/n)."""
    mean_square: float
    """Mean squared distance to the nearest point, per dimension, times m^(2/n)."""
    discrepancy: float
    """Centered L2 discrepancy (its square root; SciPy's ``discrepancy`` returns the square); NaN above MOST_PAIRED."""
    gap_1d: float
    """Largest gap of the values on one axis, worst axis, times m; 1 is perfect."""
    fill_2d: float
    """Largest distance to the nearest point in the projection on two axes, worst pair, times m^(1/2)."""


def evenness(points: ArrayLike, *, samples: int = 16384, seed: int = 0) -> Evenness:
    """All measures of points (m, n) in the unit cube, m at least 2; ``samples`` positions are probed for distances."""
    given = _in_unit_cube(points)
    samples = require_whole("samples", samples, 1, 1 << 24)
    m, n = given.shape
    from scipy.spatial import KDTree
    from scipy.stats import qmc

    sobol = qmc.Sobol(n, seed=np.random.default_rng(seed))
    probes = sobol.random(1 << max(4, int(np.ceil(np.log2(samples)))))
    corners = ((np.arange(2 ** min(n, 12))[:, None] >> np.arange(n)) & 1).astype(np.float64)
    tree = KDTree(given)
    at_probes = tree.query(probes)[0]
    farthest = max(float(at_probes.max()), float(tree.query(corners)[0].max()))
    return Evenness(
        points=m,
        separation=separation(given),
        fill_distance=farthest * m ** (1.0 / n),
        mean_square=float((at_probes**2).mean()) / n * m ** (2.0 / n),
        discrepancy=float(np.sqrt(qmc.discrepancy(given, method="CD"))) if m <= MOST_PAIRED else float("nan"),
        gap_1d=worst_gap(given),
        fill_2d=_fill_2d(given),
    )


def separation(points: ArrayLike, *, volume: float = 1.0) -> float:
    """Half the least distance of two points (m, n), times (m / volume)^(1/n); 0 for repeated points."""
    from scipy.spatial import KDTree

    given = frozen_array("points", points, (None, None))
    volume = require_range("volume", volume, 1e-300, 1e300)
    m, n = given.shape
    if m < 2 or n < 1:
        raise InvalidInputError(f"points has shape {given.shape}; expected at least 2 points of at least 1 dimension")
    nearest = KDTree(given).query(given, k=2)[0][:, 1].min()
    return float(0.5 * nearest * (m / volume) ** (1.0 / n))


def prefix_separations(points: ArrayLike, *, volume: float = 1.0) -> Matrix:
    """Separation of every prefix of 2, 3, ..., m points, (m - 1,), in units of that prefix's own spacing."""
    given = frozen_array("points", points, (None, None))
    volume = require_range("volume", volume, 1e-300, 1e300)
    m, n = given.shape
    if n < 1:
        raise InvalidInputError(f"points has shape {given.shape}; expected points of at least 1 dimension")
    nearest = np.empty(max(m - 1, 0))
    for i in range(1, m):
        away = given[:i] - given[i]
        nearest[i - 1] = np.einsum("ij,ij->i", away, away).min()
    counts = np.arange(2, m + 1)
    return np.asarray(0.5 * np.sqrt(np.minimum.accumulate(nearest)) * (counts / volume) ** (1.0 / n))


def latinized(points: ArrayLike, low: ArrayLike | None = None, high: ArrayLike | None = None) -> Matrix:
    """Points of a box moved to perfect one-dimensional projections: each value becomes that of its rank, (m, n).

    Drawback: separation drops by some percent, points no longer form a lattice, and a refinement does not keep them
    (latinize at the finest planned level and use prefixes). Boxes only, unit cube by default. Discrepancy improves.
    """
    given = frozen_array("points", points, (None, None))
    m, n = given.shape
    lower = np.zeros(n) if low is None else frozen_array("low", low, (n,))
    upper = np.ones(n) if high is None else frozen_array("high", high, (n,))
    if not (upper > lower).all():
        raise InvalidInputError("the box to latinize in has low >= high on an axis; expected low < high")
    outside = (given < lower) | (given > upper)
    if outside.any():
        raise InvalidInputError(f"{int(outside.any(axis=1).sum())} of {m} points lie outside the box to latinize in")
    ranks = np.argsort(np.argsort(given, axis=0, kind="stable"), axis=0, kind="stable")
    share = (ranks + 0.5) / max(m, 1)
    # The width of a box may be no double where both of its ends are.
    moved = lower * (1.0 - share) + upper * share
    return np.asarray(moved, dtype=np.float64)


def worst_gap(points: Matrix) -> float:
    """Largest gap of the values on one axis, worst axis, times m, of points (m, n) in the unit cube; 1 is perfect."""
    ordered = np.sort(points, axis=0)
    padded = np.concatenate([-ordered[:1], ordered, 2.0 - ordered[-1:]])  # mirrored, so a margin counts twice
    return float(np.diff(padded, axis=0).max() * len(points))


def _fill_2d(points: Matrix) -> float:
    from scipy.spatial import KDTree

    m, n = points.shape
    if n < 2:
        return float("nan")
    edge = np.linspace(0.0, 1.0, 65)
    positions = np.stack(np.meshgrid(edge, edge), axis=-1).reshape(-1, 2)
    return float(
        max(KDTree(points[:, pair]).query(positions)[0].max() for pair in combinations(range(n), 2)) * np.sqrt(m)
    )


def _in_unit_cube(points: ArrayLike) -> Matrix:
    given = frozen_array("points", points, (None, None))
    if len(given) < 2 or given.shape[1] < 1:
        raise InvalidInputError(f"points has shape {given.shape}; expected at least 2 points of at least 1 dimension")
    if given.min() < 0.0 or given.max() > 1.0:
        raise InvalidInputError(f"points reach from {given.min():.4g} to {given.max():.4g}; expected the unit cube")
    return given
