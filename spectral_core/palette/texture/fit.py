# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights of every texel: exact where the wanted colors can be reached, nearest in CIELAB where they cannot.

Most texels are solved by one matrix product. Those whose weights leave [0, 1] take Gauss-Newton steps in CIELAB, each
solved by coordinate descent inside the box. Texels are handled in tiles, so memory does not grow with the picture.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.spectra.color import WHITE_XYZ, XYZ_FROM_RGB

Array = NDArray[np.float64]
Texels = NDArray[np.float32]

TILE = 1 << 16
"""Texels per tile; of those, ``BLOCK`` at a time are iterated, so that the working set stays in the cache."""
BLOCK = 4096
NEWTON_STEPS = 4
SWEEPS = 10
_EDGE = np.float32(216 / 24389)
_SLOPE = np.float32(24389 / 27 / 116)
_LAB_FROM_F = np.array([[0, 116, 0], [500, -500, 0], [0, 200, -200]], dtype=np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class Fitter:
    """Solver of texels. ``color_from_weights``: (3L, K), linear RGB under each light.

    ``importance``: (L,), weighs the color differences of each picture where not all can be met. ``corner_weights``:
    (8^L, K), weights within [0, 1] of the corners of the mapped display colors, where all of them can be reached; with
    more spectra than colors (K > 3L) their multilinear interpolation is exact and inside the box at every texel.
    """

    color_from_weights: Array
    importance: tuple[float, ...]
    corner_weights: Array | None = None

    def __post_init__(self) -> None:
        rows = self.color_from_weights.shape[0]
        if rows != 3 * len(self.importance) or min(self.importance) <= 0:
            raise InvalidInputError(
                f"{len(self.importance)} importances {self.importance} for {rows // 3} lights; give one positive "
                "number per light"
            )

    def solve(
        self, wanted: NDArray[np.float32], progress: Callable[[float], None] | None = None, threads: int = 2
    ) -> tuple[Texels, int]:
        """Find the weights of texels.

        Parameters
        ----------
        wanted : (3L, m) float32, linear RGB of each texel under each light, relative to the light's white.
        progress : called with the share done, from 0 to 1, after each tile.
        threads : tiles solved at a time.

        Returns
        -------
        weights (K, m) float32 within [0, 1], and the count of texels whose first answer left [0, 1].
        """
        count = wanted.shape[1]
        weights = np.empty((self.color_from_weights.shape[1], count), dtype=np.float32)
        tiles = [slice(start, min(start + TILE, count)) for start in range(0, count, TILE)]
        iterated = 0
        with ThreadPoolExecutor(threads) as pool:
            jobs = [pool.submit(self._tile, wanted[:, tile], weights[:, tile]) for tile in tiles]
            for number, job in enumerate(jobs, 1):
                iterated += job.result()
                if progress is not None:
                    progress(number / len(jobs))
        return weights, iterated

    def _tile(self, wanted: Texels, weights: Texels) -> int:
        """Solve one tile into ``weights``; returns the count of texels whose first answer left [0, 1]."""
        rows, count = self.color_from_weights.shape
        weights_from_color = np.linalg.pinv(self.color_from_weights).astype(np.float32)
        if rows == count:
            weights[:] = weights_from_color @ wanted
        elif self.corner_weights is not None:
            weights[:] = self._between_corners(wanted)
        else:
            # The least-norm answer is taken about the gray of each texel, which is inside the box for every texel.
            gray = np.clip(wanted.mean(axis=0), 0.0, 1.0)
            weights[:] = weights_from_color @ (wanted - gray) + gray
        outside = np.flatnonzero(((weights < 0) | (weights > 1)).any(axis=0))
        for start in range(0, len(outside), BLOCK):
            chosen = outside[start : start + BLOCK]
            weights[:, chosen] = self._nearest(wanted[:, chosen], weights[:, chosen])
        return len(outside)

    def _between_corners(self, wanted: Texels) -> Texels:
        """Multilinear interpolation (K, m) of the corners' weights; it reproduces affine functions of the color."""
        assert self.corner_weights is not None
        colors = self.corner_weights[[0, -1]] @ self.color_from_weights.T
        low, high = colors[0].astype(np.float32)[:, None], colors[1].astype(np.float32)[:, None]
        share = np.clip((wanted - low) / (high - low), 0.0, 1.0)
        # The first axis of the color varies slowest in the order of the corners, so it is contracted last.
        values = self.corner_weights.T.astype(np.float32)[:, :, None]
        for axis in reversed(range(len(share))):
            even, odd = values[:, ::2], values[:, 1::2]
            values = even + (odd - even) * share[axis]
        return np.clip(values[:, 0], 0.0, 1.0)

    def _nearest(self, wanted: Texels, start: Texels) -> Texels:
        """Weights (K, m) within the box that are nearest to ``wanted`` (3L, m) in CIELAB."""
        xyz_ratio_from_rgb = np.kron(np.eye(len(self.importance)), XYZ_FROM_RGB / WHITE_XYZ[:, None])
        ratio_from_weights = (xyz_ratio_from_rgb @ self.color_from_weights).astype(np.float32)
        scale = np.repeat(np.sqrt(np.array(self.importance, dtype=np.float32)), 3)[:, None]
        target = _lab(xyz_ratio_from_rgb.astype(np.float32) @ wanted)[0] * scale
        weights = np.clip(start, 0.0, 1.0)
        for _ in range(NEWTON_STEPS):
            lab, slope = _lab(ratio_from_weights @ weights)
            jacobian = _jacobian(slope, ratio_from_weights) * scale[:, None, :]
            hessian = np.einsum("ckm,cjm->kjm", jacobian, jacobian, optimize=True)
            # A tenth of a percent of damping: a black texel has a nearly singular Jacobian.
            diagonal = np.einsum("kkm->km", hessian)
            diagonal += 1e-3 * diagonal.mean(axis=0) + 1e-6
            gradient = np.einsum("ckm,cm->km", jacobian, lab * scale - target)
            weights = _box_descent(weights, gradient, hessian)
        return weights


def _lab(ratio: Texels) -> tuple[Texels, Texels]:
    """CIELAB (3L, m) of XYZ over white (3L, m), and the slope of its cube root."""
    root = np.cbrt(np.maximum(ratio, _EDGE))
    above = ratio > _EDGE
    f = np.where(above, root, _SLOPE * ratio + np.float32(16 / 116))
    slope = np.where(above, 1 / (3 * root * root), _SLOPE)
    lights = ratio.shape[0] // 3
    lab = np.einsum("ab,lbm->lam", _LAB_FROM_F, f.reshape(lights, 3, -1)).reshape(ratio.shape)
    lab[::3] -= 16
    return lab, slope


def _jacobian(slope: Texels, ratio_from_weights: Texels) -> Texels:
    """dLab/dweights (3L, K, m)."""
    lights, count = slope.shape[0] // 3, ratio_from_weights.shape[1]
    scaled = slope[:, None, :] * ratio_from_weights[:, :, None]
    jacobian = np.einsum("ab,lbkm->lakm", _LAB_FROM_F, scaled.reshape(lights, 3, count, -1), optimize=True)
    return jacobian.reshape(slope.shape[0], count, -1)


def _box_descent(weights: Texels, gradient: Texels, hessian: Texels) -> Texels:
    """Minimize the quadratic model over [0, 1]^K by sweeps over its coordinates; all texels advance together."""
    weights = weights.copy()
    inverse = 1 / np.einsum("kkm->km", hessian)
    for _ in range(SWEEPS):
        for k in range(len(weights)):
            moved = np.clip(weights[k] - gradient[k] * inverse[k], 0.0, 1.0)
            change = moved - weights[k]
            weights[k] = moved
            gradient += hessian[k] * change
    return weights
