# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral embedding (thesis 6.2.4) and clusters: rows of similar outcomes are near each other."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, require_range, require_whole
from spectral_core.errors import InvalidInputError, counted

Array = NDArray[np.float64]
Variant = Literal["cosine", "centered", "gaussian", "simplex"]
VARIANTS: tuple[Variant, ...] = ("cosine", "centered", "gaussian", "simplex")
MAX_ROWS = 8000
"""Rows of a dense affinity matrix: 512 MB."""


def spectral_embedding(
    features: ArrayLike, variant: Variant = "cosine", *, dimensions: int = 2, width: float | None = None
) -> Array:
    """Coordinates (m, dimensions): λₖ vₖ of the affinity, k from 2 (thesis 6.2.4).

    Parameters
    ----------
    features : (m, n), finite.
    variant : "cosine" spheres the rows, so that the affinity is their cosine similarity; "centered" subtracts the mean
        first, which gives Pearson's correlation, and keeps the first vector, which is then not the trivial one;
        "gaussian" takes exp(-d²/2σ²); "simplex" rescales non-negative rows to sum 1.
    dimensions : coordinates per row.
    width : σ of "gaussian"; the median distance by default.

    Returns
    -------
    Coordinates, the sign of each such that its largest entry in size is positive.
    """
    data = np.array(frozen_array("features", features, (None, None)))
    rows = len(data)
    if variant not in VARIANTS:
        raise InvalidInputError(f"the embedding is {variant!r}; expected one of {', '.join(VARIANTS)}")
    dimensions = require_whole("dimensions", dimensions, 1, MAX_ROWS)
    if width is not None:
        width = require_range("width", width, 1e-300, 1e300)
    if not dimensions + 2 <= rows <= MAX_ROWS:
        raise InvalidInputError(f"{counted(rows, 'row')} cannot be embedded; expected {dimensions + 2} to {MAX_ROWS:,}")
    first = 1
    if variant == "gaussian":
        affinity = _gaussian(data, width)
    else:
        if variant == "centered":
            data = data - data.mean(axis=0)
            first = 0
        elif variant == "simplex":
            if data.min() < 0:
                raise InvalidInputError("the simplex embedding needs features that are not negative")
            data = data / np.maximum(data.sum(axis=1, keepdims=True), 1e-300)
        # a row of zeros has no direction: it stays at the origin instead of dividing by zero
        lengths = np.linalg.norm(data, axis=1, keepdims=True)
        data = np.divide(data, lengths, out=np.zeros_like(data), where=lengths > 0)
        affinity = data @ data.T
    values, vectors = _leading(affinity, first + dimensions)
    chosen = vectors[:, first:] * values[first:]
    signs = np.sign(chosen[np.abs(chosen).argmax(axis=0), np.arange(chosen.shape[1])])
    return np.asarray(chosen * np.where(signs == 0, 1.0, signs))


def _gaussian(data: Array, width: float | None) -> Array:
    squares = np.square(data).sum(axis=1)
    distances = np.maximum(squares[:, None] + squares[None] - 2 * data @ data.T, 0.0)
    sigma_squared = float(np.median(distances[np.triu_indices(len(data), 1)])) if width is None else width**2
    return np.asarray(np.exp(-distances / (2 * max(sigma_squared, 1e-300))))


def _leading(affinity: Array, count: int) -> tuple[Array, Array]:
    """Largest eigenvalues, descending, and their vectors."""
    from scipy.linalg import eigh

    rows = len(affinity)
    if rows > 1500:
        from scipy.sparse.linalg import eigsh

        # Not ones: rows that are symmetrical around their mean have the eigenvalue 0 for them, and ARPACK refuses that.
        start = np.random.default_rng(0).normal(size=rows)
        values, vectors = eigsh(affinity, k=count, which="LA", v0=start)
    else:
        values, vectors = eigh(affinity, subset_by_index=[rows - count, rows - 1])
    order = np.argsort(values)[::-1]
    return values[order], vectors[:, order]


def cluster(features: ArrayLike, count: int) -> NDArray[Any]:
    """Cluster number of each row, 0 upwards, largest cluster first, by k-means from several starts.

    Parameters
    ----------
    features : (m, n).
    count : clusters, 1 to m.
    """
    data = np.array(frozen_array("features", features, (None, None)))
    different = len(np.unique(data, axis=0))
    if not 1 <= require_whole("the number of clusters", count, -1 << 31, 1 << 31) <= different:
        raise InvalidInputError(
            f"the number of clusters is {count}; expected 1 to {different}, since the {len(data)} rows have "
            f"{different} different sets of features"
        )
    from scipy.cluster.vq import ClusterError, kmeans2

    best: tuple[float, NDArray[Any]] | None = None
    for start in range(10):
        rng = np.random.default_rng([0, start])
        try:
            centers, found = kmeans2(data, count, minit="++", rng=rng, missing="raise") if count > 1 else (
                data.mean(axis=0)[None], np.zeros(len(data), int))  # fmt: skip
        except ClusterError:  # a cluster lost its rows to others
            continue
        cost = float(np.square(data - centers[found]).sum())
        if best is None or cost < best[0]:
            best = cost, found
    if best is None:
        raise InvalidInputError(
            f"the number of clusters is {count}, and so many were not found in {len(data)} rows; ask for fewer"
        )
    _, number, sizes = np.unique(best[1], return_inverse=True, return_counts=True)
    return np.argsort(np.argsort(-sizes, kind="stable"))[number]
