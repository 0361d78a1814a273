# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights of least variance for sets of wavelengths, under the condition that their means are given."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.linalg.blas import dsyrk

Array = NDArray[np.float64]

_MOST_COLUMNS = 64
_MISSING = 1e-6
"""Part of the trace that the low-rank part of a covariance may miss. The rest counts as unrelated between bins."""


def least_variance(
    covariance: Array, expected: Array, means: Array, sets: NDArray[np.int64], single: float, stratum: int = 1
) -> NDArray[np.float64]:
    """Give the weights (n_responses, shifts, steps, teeth) of least variance with the given mean in each bin.

    The variance is that of one sample, times ``single``, plus that of the mean over samples of a shift, one from each
    ``stratum`` successive steps, times the number of steps.

    Parameters
    ----------
    covariance
        (bins, bins), expected second moments of the radiance in bins.
    expected
        (n_responses, bins), expected products of the wanted integrals and the radiance.
    means
        (n_responses, bins), the mean of the weights of each bin over the shifts.
    sets
        (shifts, steps, teeth), bins of each set; each bin occurs once in every shift.
    single
        0 or more.
    stratum
        A divisor of the number of steps.
    """
    shifts, steps, teeth = sets.shape
    members = sets.reshape(shifts, -1)
    root = low_rank_root(covariance)
    rest = np.maximum(np.diag(covariance) - np.square(root).sum(axis=1), 1e-12 * np.trace(covariance) / len(covariance))
    # The variance is a quadratic form of the weights of a shift: blocks, one per stratum, plus a matrix of low rank.
    # Its inverse is that of the blocks minus another matrix of low rank (Woodbury).
    strata = sets.reshape(shifts, steps // stratum, stratum * teeth)
    # of each step, and of the differences between the steps of a stratum, of which the mean has one by chance
    alone = np.kron(np.eye(stratum), np.ones((teeth, teeth)))
    pattern = single * alone + stratum * (alone - 1.0 / stratum)
    blocks = pattern * covariance[strata[..., :, None], strata[..., None, :]]
    blocks[..., np.arange(stratum * teeth), np.arange(stratum * teeth)] += rest[strata]
    inverses = steps * _inverses(blocks)

    def by_blocks(columns: Array) -> Array:
        return np.asarray((inverses @ columns.reshape(*strata.shape, -1)).reshape(shifts, members.shape[1], -1))

    low = root[members]
    across = by_blocks(low)
    inner = np.eye(root.shape[1]) + np.swapaxes(low, 1, 2) @ across / steps
    across = across @ np.swapaxes(np.linalg.inv(np.linalg.cholesky(inner)), 1, 2) / np.sqrt(steps)

    def solved(columns: Array) -> Array:
        return by_blocks(columns) - across @ (np.swapaxes(across, 1, 2) @ columns)

    free = (single / steps + 1.0) * solved(np.moveaxis(expected[:, members], 0, -1))
    # Lagrange's multipliers of the condition, one per bin and response
    normal, scattered = np.zeros_like(covariance), np.empty((shifts, len(covariance), across.shape[2]))
    np.add.at(normal, (strata[..., :, None], strata[..., None, :]), inverses)
    sums, numbers = np.zeros((len(covariance), len(expected))), np.arange(shifts)[:, None]
    np.add.at(sums, members, free)
    scattered[numbers, members] = across
    columns = np.moveaxis(scattered, 0, 1).reshape(len(covariance), -1)
    # One half of the symmetric matrix is enough, in half of the time.
    normal = dsyrk(-1.0, columns.T, 1.0, normal.T, trans=1, lower=1)
    multipliers = cho_solve(cho_factor(normal, lower=True, overwrite_a=True), shifts * means.T - sums)
    weights = free + solved(multipliers[members])
    return np.moveaxis(weights, -1, 0).reshape(len(expected), shifts, steps, teeth)


def _inverses(blocks: Array) -> Array:
    """Give the inverses of small positive definite matrices (..., n, n), all at once: NumPy inverts one after another.

    Gauss and Jordan's elimination in place; positive definite matrices need no pivoting.
    """
    found = blocks.copy()
    for k in range(found.shape[-1]):
        pivot = 1.0 / found[..., k, k]
        row, column = found[..., k, :] * pivot[..., None], found[..., :, k].copy()
        row[..., k], column[..., k] = pivot, 0.0
        found[..., :, k] = 0.0
        found[..., k, :] = row
        found -= column[..., :, None] * row[..., None, :]
    return found


def low_rank_root(covariance: Array) -> Array:
    """Give columns (bins, n) whose outer products add up to most of ``covariance``: Cholesky's, largest pivot first."""
    left = np.diag(covariance).copy()
    total, columns = float(left.sum()), np.zeros((_MOST_COLUMNS, left.size))
    for number in range(_MOST_COLUMNS):
        pivot = int(left.argmax())
        if left.sum() <= _MISSING * total:
            return columns[:number].T
        column = covariance[pivot] - columns[:number, pivot] @ columns[:number]
        columns[number] = column / np.sqrt(left[pivot])
        left = np.maximum(left - columns[number] ** 2, 0.0)
    return columns.T
