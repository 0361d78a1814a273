# SPDX-License-Identifier: GPL-3.0-or-later
"""One reflectance, or mixture of spectra, with a given color under one light and nearest to another under a second."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.spectra.color import lab_from_linear_rgb, lab_jacobian_from_linear_rgb

Array = NDArray[np.float64]

LAB_STEPS = 20
"""Most Gauss-Newton steps toward the color that is nearest in CIELAB; two to four are usual."""
SHARES: Array = 0.5 ** np.arange(8.0)
"""Shares of a step that are tried."""
LEAST_GAIN = 1e-3
"""CIELAB distance by which a step must come nearer for another to follow."""
MET = 1e-4
"""CIELAB distance at which a wanted color is met."""


def nearest_weights(first: Array, second: Array, color: Array, wanted: Array) -> Array | None:
    """Weights (k,) in [0, 1] with exactly ``color`` under ``first`` (3, k), as near as possible to ``wanted`` in
    CIELAB.

    Gauss-Newton steps, each a small quadratic program; None if no weights have the color. A full step toward a color
    far away may pass the nearest one; all mixtures on its way have the color under ``first`` as well.
    """
    target, rows_first = lab_from_linear_rgb(wanted), np.ascontiguousarray(first)
    found = _projected(rows_first, second, color, (wanted, target))
    if found is None:
        return None
    distance = float(np.linalg.norm(lab_from_linear_rgb(second @ found) - target))
    for _ in range(LAB_STEPS):
        trial = None if distance < MET else _projected(rows_first, second, color, (second @ found, target))
        if trial is None:
            break
        tried = found + SHARES[:, None] * (trial - found)
        distances = np.linalg.norm(lab_from_linear_rgb(tried @ second.T) - target, axis=1)
        best = int(np.argmin(distances))
        gain = distance - float(distances[best])
        if gain <= 0:
            break
        found, distance = tried[best], float(distances[best])
        if gain < LEAST_GAIN:
            break
    return found


def _projected(rows_first: Array, second: Array, color: Array, aim: tuple[Array, Array]) -> Array | None:
    """Weights of the color nearest to a CIELAB color, linearized at a linear RGB color: ``aim`` is both, the latter
    first. None if no weights have ``color``.
    """
    import daqp

    here, target = aim
    count = rows_first.shape[1]
    upper, lower = np.concatenate([np.ones(count), color]), np.concatenate([np.zeros(count), color])
    sense = np.concatenate([np.zeros(count), np.full(3, 5)]).astype(np.int32)
    metric = lab_jacobian_from_linear_rgb(here)
    rows = metric @ second
    goal = metric @ here + target - lab_from_linear_rgb(here)
    hessian = rows.T @ rows
    hessian += 1e-8 * np.trace(hessian) * np.eye(count)
    found, _, status, _ = daqp.solve(hessian, -rows.T @ goal, rows_first, upper, lower, sense)
    return np.clip(found, 0.0, 1.0) if status in (1, 2) else None
