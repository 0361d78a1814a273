# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors that one material can show under a light, given its exact colors under others.

The colors of a reflectance between 0 and 1 under one light, with exact colors under k other lights, are a convex set (a
section of a zonotope, projected). Its extent in a direction is a linear program, in closed form without exact colors;
its nearest color to a wanted one is a small quadratic program, whose multipliers identify the conflicting exact colors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, require_kind, require_whole
from spectral_core.errors import InvalidInputError, SolveError
from spectral_core.palette.assemble.equations import Equation, equation_of
from spectral_core.palette.assemble.limits import Limits
from spectral_core.palette.assemble.programs import EXACT, Programs
from spectral_core.palette.given import color_ends, light_and_color, require_bounds, sequence_of
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb, lab_jacobian_from_linear_rgb, whitened
from spectral_core.spectra.observer import Observer, linear_rgb_from_product, normalized
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

Array = NDArray[np.float64]

SAME = 0.05  # CIELAB distance below which the ways from two colors count as one
LAB_STEPS = 20
"""Most Gauss-Newton steps from the nearest color in linear RGB to the nearest in CIELAB; two to four are usual."""
STARTS = 1.0, 0.3, 0.1, 0.03, 0.01, 0.0
"""The steps begin from the nearest colors, in linear RGB, to these shares of the wanted one: CIELAB has several minima
along the colors of one spectral line.
"""
SHARES = 0.5 ** np.arange(12.0)
"""Shares of a step that are tried."""
_RIDGES = 1e-9, 1e-10, 1e-11, 1e-12, 1e-13
_GAIN = 1e-4  # share of a squared distance that a further program must be able to gain


@dataclass(frozen=True, slots=True, eq=False)
class NearestColor:
    """The reachable color (3,) nearest to a wanted one in CIELAB. ``reachable``: True if it equals the wanted one.

    ``delta_e_2000``: the difference between them, which another reachable color may have smaller.
    ``reflectance``: (n,), one with this color.
    ``in_the_way``: for each exact color, then each light that follows, the rate of decrease of half the squared CIELAB
    distance if that color moves by one ΔE; the largest is the color to relax.
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
    exact : pairs of another light and the linear sRGB (3,) that the material has there exactly, or the least and the
        greatest (2, 3).
    scale : luminance of a perfect white under every light; None if the lights are as bright as they are given.
    follows : other lights under which the material has exactly the color that it has under ``light``.
    bounds : least and greatest reflectance; infinite where there is none.
    viewer : the observer who sees all these colors; None for the standard one.

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
        bounds: tuple[float, float] = (0.0, 1.0),
        viewer: Observer | None = None,
    ) -> None:
        require_bounds("the bounds of a reflectance", bounds)
        require_kind("the grid of a reflectance", grid, SpectralGrid, "such as design_grid()")
        exact = [light_and_color(pair) for pair in sequence_of("exact", exact)]
        follows = sequence_of("follows", follows)
        for each in (light, *(other for other, _ in exact), *follows):
            require_kind("a light", each, Illuminant)
        matrix = _rgb_rows(light, grid, scale, viewer)
        held = [equation_of(_rgb_rows(other, grid, scale, viewer), color_ends(color)) for other, color in exact]
        shown = [_rgb_rows(other, grid, scale, viewer) for other in follows]
        self._prepare(grid, matrix, held + [equation_of(own - matrix, np.zeros(3), own) for own in shown], bounds, ())

    @classmethod
    def beside(
        cls,
        grid: SpectralGrid,
        matrix: Array,
        held: Sequence[Equation],
        bounds: tuple[float, float] = (0.0, 1.0),
        energy: Sequence[Equation] = (),
    ) -> Self:
        """The colors ``matrix`` (3, n) @ unknowns beside equations. The first of the n unknowns are the reflectance on
        ``grid``; others are amounts of dyes, and those of further materials. ``energy``: equations that are no colors,
        as that dyed materials return at most all light. Raises InvalidInputError if the equations have no solution.
        """
        found = object.__new__(cls)
        found._prepare(grid, matrix, held, bounds, energy)
        return found

    def _prepare(
        self,
        grid: SpectralGrid,
        matrix: Array,
        held: Sequence[Equation],
        bounds: tuple[float, float],
        energy: Sequence[Equation],
    ) -> None:
        self.grid, self.bounds, self.matrix, self._held = grid, bounds, matrix, len(held)
        self.equations = (*held, *energy)
        self._limits = Limits(matrix.shape[1], bounds, self.equations)
        self._programs = Programs(self._limits, grid.size)
        if len(held) and self._programs.any_point is None:
            colors = (
                "the exact color; relax it"
                if len(held) == 1
                else f"the {len(held)} exact colors together; relax one of them"
            )
            raise InvalidInputError(f"no reflectance between {bounds[0]:g} and {bounds[1]:g} has {colors}")

    def extent(self, direction: ArrayLike) -> tuple[float, Array]:
        """Largest ``direction · color`` over all reachable colors, and a color (3,) that attains it; infinite where
        nothing bounds it.
        """
        toward = frozen_array("a direction of colors", direction, (3,))
        gradient = toward @ self.matrix
        if not self._limits.count and np.isfinite(self.bounds).all():
            # Each wavelength reflects the most or the least: the extreme colors of an object (Schrödinger 1920).
            color = self.matrix @ np.where(gradient > 0, self.bounds[1], self.bounds[0])
            return float(toward @ color), color
        found = self._limits.extreme(gradient)
        if found is None:
            raise SolveError("the exact colors of this material cannot be met together")
        if not np.isfinite(found).all():
            return np.inf, np.where(toward == 0, 0.0, np.copysign(np.inf, toward))
        color = self.matrix @ found
        return float(toward @ color), color

    def outline(self, count: int = 64) -> Array:
        """Extreme colors (count, 3) in directions spread evenly over the sphere."""
        count = require_whole("the number of extreme colors", count, 1, 100_000)
        return np.array([self.extent(direction)[1] for direction in even_directions(count)])

    def nearest(self, wanted: ArrayLike) -> NearestColor:
        """Find the reachable color that is nearest to ``wanted`` (3,), linear sRGB, in CIELAB."""
        target = frozen_array("wanted color", wanted, (3,))
        # Whitened, so that the ridge moves no color, also under a lamp of one line, whose colors are nearly a line.
        reflectance, _ = self._projected(whitened(self.matrix), target)
        color = self.matrix @ reflectance
        slope = np.zeros(self._held)
        reachable = bool(np.abs(color - target).max() <= EXACT)
        target_lab = lab_from_linear_rgb(target)
        lab = lab_from_linear_rgb(color)
        if not reachable:
            found: list[tuple[float, Array, Array]] = []
            passed: list[Array] = []
            for share in STARTS:
                found += self._nearest_in_lab(self._projected(np.eye(3), share * target), target_lab, passed)
            _, reflectance, multipliers = min(found, key=lambda each: each[0])
            color = self.matrix @ reflectance
            lab = lab_from_linear_rgb(color)
            # A multiplier is per unit of linear RGB; the Jacobian at the color converts it to ΔE.
            held = (self._limits.shown @ reflectance).reshape(-1, 3)[: self._held]
            metrics = lab_jacobian_from_linear_rgb(held) if len(held) else np.empty((0, 3, 3))
            forces = multipliers.reshape(-1, 3)[: self._held]
            per_delta_e = [np.linalg.solve(m.T, y) for m, y in zip(metrics, forces, strict=True)]
            slope = np.array([float(np.linalg.norm(vector)) for vector in per_delta_e])
            reachable = bool(np.abs(color - target).max() <= EXACT)
        own = reflectance[: self.grid.size]
        return NearestColor(color, reachable, float(delta_e_2000(lab, target_lab)), own, slope)

    def _nearest_in_lab(
        self, start: tuple[Array, Array], target_lab: Array, passed: list[Array]
    ) -> list[tuple[float, Array, Array]]:
        """From a reflectance and its multipliers to those of a nearest color in CIELAB; first its distance. Nothing if
        it comes to one of the CIELAB colors that earlier calls passed, to which it adds its own.

        CIELAB is linearized at the present color. A full step may pass the minimum; all colors on the way to it are
        reachable as well, because the set is convex.
        """
        reflectance, multipliers = start
        color = self.matrix @ reflectance
        lab = lab_from_linear_rgb(color)
        distance = float(np.linalg.norm(lab - target_lab))
        earlier = np.array(passed).reshape(-1, 3)
        for _ in range(LAB_STEPS):
            if np.linalg.norm(earlier - lab, axis=1).min(initial=np.inf) < SAME:
                return []  # Most starts lead to the same color: half of all programs would find it once more.
            passed.append(lab)
            metric = lab_jacobian_from_linear_rgb(color)
            trial, forces = self._projected(metric, color + np.linalg.solve(metric, target_lab - lab))
            way = self.matrix @ trial - color
            labs = lab_from_linear_rgb(color + SHARES[:, None] * way)
            distances = np.linalg.norm(labs - target_lab, axis=1)
            best = int(np.argmin(distances))
            if not distances[best] < distance:
                break
            distance, multipliers, lab = float(distances[best]), forces, labs[best]
            reflectance = reflectance + SHARES[best] * (trial - reflectance)
            color = color + SHARES[best] * way
            if SHARES[best] * np.abs(way).max() < EXACT:
                break
        return [(distance, reflectance, multipliers)]

    def _projected(self, metric: Array, target: Array) -> tuple[Array, Array]:
        """Reflectance (n,) of the least |metric (M r - target)|², and the multipliers of the exact colors.

        A ridge makes the program strictly convex, but holds back what the light hardly shows beside the exact colors:
        further programs hold the reflectance to the last one, by less.
        """
        rows, wanted = metric @ self.matrix, metric @ target
        size = float(np.trace(rows @ rows.T))
        reflectance, multipliers = self._programs.solved(rows, wanted, _RIDGES[0] * size, np.zeros(self._limits.size))
        for ridge in _RIDGES[1:]:
            cost = np.sum((rows @ reflectance - wanted) ** 2)
            # what the last ridge weighed
            gain = 10.0 * ridge * size * self._limits.size * max(np.abs(self.bounds)) ** 2
            if np.abs(self.matrix @ reflectance - target).max() < 0.1 * EXACT or gain < _GAIN * cost:
                break
            further = self._programs.solved(rows, wanted, ridge * size, reflectance)
            if not np.sum((rows @ further[0] - wanted) ** 2) < cost:
                break
            reflectance, multipliers = further
        return reflectance, multipliers


def even_directions(count: int) -> Array:
    """Unit vectors (count, 3), spread evenly over the sphere: a Fibonacci spiral."""
    z = 1 - (2 * np.arange(count) + 1) / count
    angle, around = np.pi * (1 + 5**0.5) * np.arange(count), np.sqrt(1 - z**2)
    return np.stack([around * np.cos(angle), around * np.sin(angle), z], axis=1)


def _rgb_rows(light: Illuminant, grid: SpectralGrid, scale: float | None, viewer: Observer | None) -> Array:
    """Matrix (3, n) from a reflectance to linear sRGB under a light of luminance ``scale``; None: unscaled."""
    return linear_rgb_from_product(light if scale is None else normalized(light, viewer, scale), grid, viewer)
