# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights within [0, 1] whose colors are nearest to wanted ones in CIELAB, for many texels at a time.

CIELAB is linearized at the present answer, and the resulting quadratic program is solved inside the box. With as many
spectra as colors, every color has one answer without bounds, and few bounds are active: the program is then solved in
the multipliers of the bounds (Hildreth 1957), which settle in a few sweeps. Otherwise, and if they do not settle, it is
solved in the weights.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.spectra.color import WHITE_XYZ, XYZ_FROM_RGB

Array = NDArray[np.float64]
Texels = NDArray[np.float32]

BLOCK = 16384
"""Texels that advance together: enough that NumPy's overhead per call is negligible."""
MULTIPLIER_STEPS, MULTIPLIER_SWEEPS = 6, 5
WEIGHT_STEPS, WEIGHT_SWEEPS = 40, 10
SETTLED = np.float32(5e-4)
"""Change of the weights in one step below which a texel is left as it is."""
LARGEST_CONDITION = 1e3
"""Of the matrix from weights to colors, beyond which its inverse is not used in single precision."""
_EDGE = np.float32(216 / 24389)
_SLOPE = np.float32(24389 / 27 / 116)
_LAB_FROM_F: Array = np.array([[0, 116, 0], [500, -500, 0], [0, 200, -200]], dtype=np.float64)


class NearestInBox:
    """``color_from_weights``: (3L, K), linear RGB under each light. ``importance``: (L,), of each picture's colors."""

    def __init__(self, color_from_weights: Array, importance: tuple[float, ...]) -> None:
        ratio_from_rgb = np.kron(np.eye(len(importance)), XYZ_FROM_RGB / WHITE_XYZ[:, None])
        ratio_from_weights = ratio_from_rgb @ color_from_weights
        rows, count = ratio_from_weights.shape
        self.ratio_from_rgb = ratio_from_rgb.astype(np.float32)
        self.ratio_from_weights = ratio_from_weights.astype(np.float32)
        self.invertible = rows == count and bool(np.linalg.cond(ratio_from_weights) < LARGEST_CONDITION)
        """True if every color has exactly one answer without bounds."""
        lab_from_f = [np.sqrt(weight) * _LAB_FROM_F for weight in importance]
        self.lab_from_f = np.stack(lab_from_f).astype(np.float32)
        if self.invertible:
            self.weights_from_ratio = np.linalg.inv(ratio_from_weights).astype(np.float32)
            inverses = [np.linalg.inv(each) for each in lab_from_f]
            self.f_roots = [np.linalg.cholesky(each @ each.T).T.astype(np.float32) for each in inverses]

    def solve(self, wanted: Texels, start: Texels) -> Texels:
        """Weights (K, m) for linear RGB ``wanted`` (3L, m), from ``start`` (K, m) on."""
        weights = np.clip(start, 0.0, 1.0)
        for first in range(0, wanted.shape[1], BLOCK):
            block = slice(first, first + BLOCK)
            self._solve_block(wanted[:, block], weights[:, block])
        return weights

    def _solve_block(self, wanted: Texels, weights: Texels) -> None:
        target = _f(self.ratio_from_rgb @ wanted)[0]
        still = np.arange(wanted.shape[1])
        if self.invertible:
            still = self._by_multipliers(target, weights, still)
        for _ in range(WEIGHT_STEPS):
            if not still.size:
                break
            now = weights[:, still]
            moved = self._step_in_weights(now, target[:, still])
            weights[:, still] = moved
            still = still[np.abs(moved - now).max(axis=0) > SETTLED]

    def _by_multipliers(self, target: Texels, weights: Texels, still: NDArray[np.intp]) -> NDArray[np.intp]:
        """Improve ``weights`` in place; returns the texels that did not settle."""
        multipliers = np.zeros_like(weights)
        for _ in range(MULTIPLIER_STEPS):
            now = weights[:, still]
            moved = self._step_in_multipliers(now, target, multipliers)
            weights[:, still] = np.clip(moved, 0.0, 1.0)
            # A weight outside its bounds shows that the multipliers have not settled.
            left = np.flatnonzero(np.abs(moved - now).max(axis=0) > SETTLED)
            still, target, multipliers = still[left], target[:, left], multipliers[:, left]
            if not left.size:
                break
        return still

    def _step_in_multipliers(self, weights: Texels, target: Texels, multipliers: Texels) -> Texels:
        """One step; ``multipliers`` (K, m) of the bounds are changed in place, positive at 1 and negative at 0."""
        f, slope = _f(self.ratio_from_weights @ weights)
        widths = 1 / slope
        free = weights + self.weights_from_ratio @ (widths * (target - f))
        covariance = self._covariance(widths)
        for k, multiplier in enumerate(multipliers):
            free -= covariance[k] * multiplier
        for _ in range(MULTIPLIER_SWEEPS):
            for k, multiplier in enumerate(multipliers):
                variance = covariance[k, k]
                alone = free[k] + variance * multiplier
                alone -= np.clip(alone, 0.0, 1.0)
                alone /= variance
                free -= covariance[k] * (alone - multiplier)
                multipliers[k] = alone
        return free

    def _covariance(self, widths: Texels) -> Texels:
        """Inverse Hessian (K, K, m) of half the squared CIELAB distance; ``widths``: (3L, m), dratio/df."""
        rows = len(widths)
        roots = np.empty((rows, *widths.shape), dtype=np.float32)
        for k, root in enumerate(roots):
            scaled = self.weights_from_ratio[k][:, None] * widths
            for light, f_root in enumerate(self.f_roots):
                part = slice(3 * light, 3 * light + 3)
                np.matmul(f_root, scaled[part], out=root[part])
        covariance = np.empty_like(roots)
        for k in range(rows):
            for other in range(k + 1):
                np.einsum("im,im->m", roots[k], roots[other], out=covariance[k, other])
                covariance[other, k] = covariance[k, other]
        return covariance

    def _step_in_weights(self, weights: Texels, target: Texels) -> Texels:
        """One step, by descent over one weight after another."""
        f, slope = _f(self.ratio_from_weights @ weights)
        lights, count = len(self.lab_from_f), len(weights)
        scaled = slope[:, None, :] * self.ratio_from_weights[:, :, None]
        jacobian = np.matmul(self.lab_from_f, scaled.reshape(lights, 3, -1)).reshape(3 * lights, count, -1)
        missed = np.matmul(self.lab_from_f, (f - target).reshape(lights, 3, -1)).reshape(3 * lights, -1)
        hessian = np.einsum("ckm,cjm->kjm", jacobian, jacobian)
        # A tenth of a percent of damping: with more spectra than colors the Hessian is singular.
        diagonal = np.einsum("kkm->km", hessian)
        diagonal += 1e-3 * diagonal.mean(axis=0) + 1e-6
        gradient = np.einsum("ckm,cm->km", jacobian, missed)
        found, inverse = weights.copy(), 1 / diagonal
        for _ in range(WEIGHT_SWEEPS):
            for k in range(count):
                moved = np.clip(found[k] - gradient[k] * inverse[k], 0.0, 1.0)
                gradient += hessian[k] * (moved - found[k])
                found[k] = moved
        return found


def _f(ratio: Texels) -> tuple[Texels, Texels]:
    """The cube root of CIELAB with its line near black, of XYZ over white (3L, m), and its slope."""
    # exp(log / 3) takes a quarter of the time of cbrt in single precision.
    root = np.exp(np.log(np.maximum(ratio, _EDGE)) * np.float32(1 / 3))
    above = ratio > _EDGE
    f = np.where(above, root, _SLOPE * ratio + np.float32(16 / 116))
    return f, np.where(above, np.float32(1 / 3) / (root * root), _SLOPE)
