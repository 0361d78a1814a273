# SPDX-License-Identifier: GPL-3.0-or-later
"""Sets of a few paints or filters that come near to wanted colors, all sets of one size at a time.

The absorption of a mixture is linear in the amounts: K/S of paints (Kubelka and Munk), optical density of filters. So
the colors of thousands of sets, with their slopes, are a few array operations, and all of them are improved together by
damped Gauss-Newton steps (Levenberg 1944). All pairs are tried; then the best sets grow by one colorant at a time.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.paint.mixtures import absorption_from_reflectance
from spectral_core.spectra.color import lab_from_linear_rgb, lab_jacobian_from_linear_rgb

Array = NDArray[np.float64]
Set = tuple[int, ...]

KEPT = 60
"""Sets of one size that grow by a colorant."""
STEPS = 12
"""Steps of each set: enough to compare sets; the best ones are optimized to the end later."""
WHITEST = 1 - 1e-9
"""Reflectance below which its slope by K/S is finite."""


@dataclass(frozen=True, slots=True, eq=False)
class Mixing:
    """``absorption``: (k, n), K/S of paints or densities of filters; ``paper``: (n,), None for paints, whose amounts
    are shares of their sum; ``most``: largest amount; ``matrix``: (3L, n), to linear sRGB; ``wanted``: (L, 3), CIELAB.
    """

    absorption: Array
    paper: Array | None
    most: float
    matrix: Array
    wanted: Array

    @classmethod
    def of(cls, spectra: Array, paper: Array | None, most: float, matrix: Array, wanted: Array) -> Self:
        """Paints with reflectances ``spectra`` (k, n), or filters with these transmittances in front of ``paper``."""
        # Light passes a filter twice.
        absorption = absorption_from_reflectance(spectra) if paper is None else -2.0 * np.log(spectra)
        return cls(np.asarray(absorption), paper, most, matrix, wanted)

    def best_sets(self, size: int, count: int) -> list[Set]:
        """The ``count`` sets of up to ``size`` colorants that come nearest to the wanted colors, the best first."""
        colorants = range(len(self.absorption))
        sets: list[Set] = list(itertools.combinations(colorants, min(size, 2)))
        while True:
            errors = self._errors(sets)
            order = np.argsort(errors, kind="stable")
            if len(sets[0]) == size:
                return [sets[k] for k in order[:count]]
            grown = {tuple(sorted({*sets[k], more})) for k in order[:KEPT] for more in colorants if more not in sets[k]}
            sets = sorted(grown)

    def _errors(self, sets: Sequence[Set]) -> Array:
        """Squared distance of each set in CIELAB, after some steps from equal amounts."""
        own = self.absorption[np.array(sets)]
        size = own.shape[1]
        amounts = np.full(own.shape[:2], 1.0 / size)
        missed, slopes = self._missed(amounts, own)
        errors, damping = (missed**2).sum(axis=1), np.full(len(sets), 1e-2)
        for _ in range(STEPS):
            gradient = np.einsum("mck,mc->mk", slopes, missed)
            held = ((amounts <= 0) & (gradient > 0)) | ((amounts >= self.most) & (gradient < 0))
            slopes = np.where(held[:, None, :], 0.0, slopes)
            normal = np.einsum("mck,mcj->mkj", slopes, slopes)
            scale = np.einsum("mkk->mk", normal)
            normal += (
                np.eye(size) * (damping[:, None] * scale + 1e-12 * (1 + scale.max(axis=1, keepdims=True)))[:, :, None]
            )
            step = np.linalg.solve(normal, np.where(held, 0.0, gradient)[:, :, None])[:, :, 0]
            trial = np.clip(amounts - step, 0.0, self.most)
            if self.paper is None:
                total = trial.sum(axis=1, keepdims=True)
                trial = np.where(total > 0, trial / np.where(total > 0, total, 1.0), amounts)
            further, sloped = self._missed(trial, own)
            found = (further**2).sum(axis=1)
            better = found < errors
            amounts, errors = np.where(better[:, None], trial, amounts), np.where(better, found, errors)
            missed = np.where(better[:, None], further, missed)
            slopes = np.where(better[:, None, None], sloped, slopes)
            damping = np.clip(np.where(better, damping / 5, damping * 5), 1e-6, 1e6)
        return errors

    def _missed(self, amounts: Array, own: Array) -> tuple[Array, Array]:
        """Differences in CIELAB (m, 3L) of m sets, and their slopes by the amounts (m, 3L, k)."""
        total = np.einsum("mk,mkn->mn", amounts, own)
        if self.paper is None:
            shown = 1 / (1 + total + np.sqrt(total * (total + 2)))
            slope = -2 * shown**2 / (1 - np.minimum(shown, WHITEST) ** 2)
            own = own - total[:, None, :]  # amounts are divided by their sum
        else:
            shown = self.paper * np.exp(-total)
            slope = -shown
        rgb = (shown @ self.matrix.T).reshape(len(amounts), -1, 3)
        by_rgb = lab_jacobian_from_linear_rgb(rgb)
        by_amount = ((own * slope[:, None, :]) @ self.matrix.T).reshape(*own.shape[:2], -1, 3)
        slopes = np.einsum("mlcd,mkld->mlck", by_rgb, by_amount)
        missed = lab_from_linear_rgb(rgb) - self.wanted
        return missed.reshape(len(amounts), -1), slopes.reshape(len(amounts), -1, own.shape[1])
