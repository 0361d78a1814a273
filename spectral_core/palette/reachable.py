# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors that one material can show under a light, given its exact colors under others.

The colors of a reflectance between 0 and 1 under one light, with exact colors under k other lights, are a convex set (a
section of a zonotope, projected). Its extent in a direction is a linear program, in closed form without exact colors;
its nearest color to a wanted one is a small quadratic program, whose multipliers identify the conflicting exact colors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linprog

from spectral_core.checks import frozen_array
from spectral_core.errors import InvalidInputError, SolveError
from spectral_core.spectra.color import RGB_FROM_XYZ, delta_e_2000, lab_from_linear_rgb, lab_jacobian_from_linear_rgb
from spectral_core.spectra.observer import normalized, xyz_from_product
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

Array = NDArray[np.float64]

EXACT = 1e-6
"""Linear RGB distance below which a wanted color counts as reachable."""
LAB_STEPS = 4
"""Gauss-Newton steps from the nearest color in linear RGB to the nearest in CIELAB."""
_RIDGE = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class NearestColor:
    """The reachable color (3,) nearest to a wanted one. ``reachable``: True if it equals the wanted one.

    ``delta_e_2000``: the distance between them. ``reflectance``: (n,), one with this color. ``in_the_way``: for each
    exact color, the rate of decrease of half the squared CIELAB distance if that color moves by one ΔE; the largest is
    the color to relax.
    """

    color: Array
    reachable: bool
    delta_e_2000: float
    reflectance: Array
    in_the_way: Array


class CellReach:
    """Colors that a material can show under one light.

    Parameters
    ----------
    light : the light under which the colors are seen.
    grid : knots of the reflectance, n.
    exact : pairs of another light and the linear sRGB (3,) that the material has there exactly.
    scale : luminance of a perfect white under every light; None if the lights are as bright as they are given.
    follows : other lights under which the material has exactly the color that it has under ``light``.

    Raises
    ------
    InvalidInputError : no reflectance has all exact colors.
    """

    def __init__(
        self,
        light: Illuminant,
        grid: SpectralGrid,
        exact: Sequence[tuple[Illuminant, ArrayLike]] = (),
        scale: float | None = 1.0,
        follows: Sequence[Illuminant] = (),
    ) -> None:
        self.grid = grid
        self.matrix = _rgb_rows(light, grid, scale)
        held = [_rgb_rows(other, grid, scale) for other, _ in exact]
        held += [_rgb_rows(other, grid, scale) - self.matrix for other in follows]
        self._held = np.concatenate([np.zeros((0, grid.size)), *held])
        colors = [frozen_array("exact color", color, (3,)) for _, color in exact]
        self._exact = len(colors)
        colors += [np.zeros(3) for _ in follows]
        self._colors = np.concatenate([np.empty(0), *colors])
        # Reflectances lie in [0, 1], and the exact colors are equalities (sense 5 in DAQP).
        knots = grid.size
        self._upper = np.concatenate([np.ones(knots), self._colors])
        self._lower = np.concatenate([np.zeros(knots), self._colors])
        self._sense = np.concatenate([np.zeros(knots), np.full(self._colors.size, 5)]).astype(np.int32)
        if exact and self._extreme(np.zeros(3)) is None:
            raise InvalidInputError(
                f"no reflectance between 0 and 1 has the {len(exact)} exact colors together; relax one of them"
            )

    def extent(self, direction: ArrayLike) -> tuple[float, Array]:
        """Largest ``direction · color`` over all reachable colors, and a color (3,) that attains it."""
        toward = np.asarray(direction, dtype=np.float64)
        if not len(self._held):
            # Each wavelength reflects all or nothing: the extreme colors of an object (Schrödinger 1920).
            color = self.matrix @ (toward @ self.matrix > 0)
            return float(toward @ color), color
        found = self._extreme(toward)
        if found is None:
            raise SolveError("the exact colors of this material cannot be met together")
        color = self.matrix @ found
        return float(toward @ color), color

    def outline(self, count: int = 64) -> Array:
        """Extreme colors (count, 3) in directions spread evenly over the sphere (a Fibonacci spiral)."""
        z = 1 - (2 * np.arange(count) + 1) / count
        angle = np.pi * (1 + 5**0.5) * np.arange(count)
        around = np.sqrt(1 - z**2)
        directions = np.stack([around * np.cos(angle), around * np.sin(angle), z], axis=1)
        return np.array([self.extent(direction)[1] for direction in directions])

    def nearest(self, wanted: ArrayLike) -> NearestColor:
        """Find the reachable color that is nearest to ``wanted`` (3,), linear sRGB, in CIELAB."""
        target = frozen_array("wanted color", wanted, (3,))
        reflectance, _ = self._projected(np.eye(3), target)
        color = self.matrix @ reflectance
        slope = np.zeros(self._exact)
        reachable = bool(np.abs(color - target).max() <= EXACT)
        target_lab = lab_from_linear_rgb(target)
        lab = lab_from_linear_rgb(color)
        if not reachable:
            multipliers = np.zeros(len(self._colors))
            least = np.inf
            here, lab_here = color, lab
            # CIELAB is linearized at the present answer. A full step may pass the minimum, so the best is kept.
            for _ in range(LAB_STEPS):
                metric = lab_jacobian_from_linear_rgb(here)
                trial, forces = self._projected(metric, here + np.linalg.solve(metric, target_lab - lab_here))
                before, here = here, self.matrix @ trial
                lab_here = lab_from_linear_rgb(here)
                distance = float(np.linalg.norm(lab_here - target_lab))
                if distance < least:
                    least, reflectance, multipliers, color, lab = distance, trial, forces, here, lab_here
                if np.abs(here - before).max() < EXACT:
                    break
            colors = self._colors.reshape(-1, 3)[: self._exact]
            held = lab_jacobian_from_linear_rgb(colors) if len(slope) else np.empty((0, 3, 3))
            # A multiplier is per unit of linear RGB; the Jacobian at the color converts it to ΔE.
            per_delta_e = [np.linalg.solve(m.T, y) for m, y in zip(held, multipliers.reshape(-1, 3), strict=False)]
            slope = np.array([float(np.linalg.norm(vector)) for vector in per_delta_e])
            reachable = bool(np.abs(color - target).max() <= EXACT)
        return NearestColor(color, reachable, float(delta_e_2000(lab, target_lab)), reflectance, slope)

    def _projected(self, metric: Array, target: Array) -> tuple[Array, Array]:
        """Reflectance (n,) of the least |metric (M r - target)|², and the multipliers of the exact colors."""
        import daqp

        rows = metric @ self.matrix
        size = float(np.trace(rows @ rows.T))
        # The ridge makes the program strictly convex; it moves a color by less than EXACT.
        hessian = rows.T @ rows + _RIDGE * size * np.eye(self.grid.size)
        linear = -rows.T @ (metric @ target)
        # The solver writes into the senses, so it gets a copy.
        found, _, status, info = daqp.solve(hessian, linear, self._held, self._upper, self._lower, self._sense.copy())
        if status not in (1, 2):
            raise SolveError(f"the nearest reachable color was not found (status {status}); loosen the exact colors")
        multipliers = np.asarray(info["lam"], dtype=np.float64)[self.grid.size :]
        return np.clip(found, 0.0, 1.0), multipliers

    def _extreme(self, direction: Array) -> Array | None:
        """Reflectance (n,) that reaches farthest in ``direction`` with the exact colors; None if there is none."""
        answer = linprog(
            -(direction @ self.matrix), A_eq=self._held, b_eq=self._colors, bounds=(0.0, 1.0), method="highs-ds"
        )
        return np.asarray(answer.x) if answer.status == 0 else None


def _rgb_rows(light: Illuminant, grid: SpectralGrid, scale: float | None) -> Array:
    """Matrix (3, n) from a reflectance to linear sRGB under a light of luminance ``scale``; None: unscaled."""
    return RGB_FROM_XYZ @ xyz_from_product(light if scale is None else normalized(light, luminance=scale), grid)
