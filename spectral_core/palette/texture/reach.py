# SPDX-License-Identifier: GPL-3.0-or-later
"""The colors that one reflectance can show under several lights at once, decided by linear programming.

A reflectance between 0 and 1 has the colors ``M r`` with ``M`` of shape (3L, n) for L lights. The set of all of them,
{M r : 0 <= r <= 1}, is a zonotope. It is convex, so it contains every pair of display colors exactly if it contains the
pairs of cube corners: 64 linear programs for two lights decide for all pictures.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.optimize import linprog

from spectral_core.checks import frozen_array, real_numbers, require_range
from spectral_core.errors import InvalidInputError, SolveError
from spectral_core.palette.given import require_each, sequence_of
from spectral_core.spectra.color import RGB_FROM_XYZ, WHITE_XYZ
from spectral_core.spectra.observer import Observer, xyz_from_product
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

Array = NDArray[np.float64]

TEXTURE_GRID = SpectralGrid.uniform(380, 780, 5)
"""Knots of the spectra of a texture: fine enough for lamps of 10 nm width."""


def stimulus_matrix(
    lights: Sequence[Illuminant], grid: SpectralGrid = TEXTURE_GRID, viewer: Observer | None = None
) -> Array:
    """Matrix (3L, n) from a reflectance to its linear sRGB colors under L lights, each relative to its light's white.

    The perfect reflector has the color (1, 1, 1) under every light, as CIELAB adapts to the white.

    Parameters
    ----------
    lights : L illuminants, on any grids.
    grid : n knots of the reflectance.
    viewer : observer; the CIE 1931 2° observer where None.

    Raises
    ------
    InvalidInputError : no light is given, or one gives the observer no luminance.
    """
    lights = sequence_of("lights", lights)
    require_each("lights", lights, Illuminant, "an Illuminant, such as catalogue.illuminant('D65')")
    if not lights:
        raise InvalidInputError("a stimulus matrix needs at least one light; got none")
    rows = []
    for light in lights:
        xyz = xyz_from_product(light, grid, viewer)
        white = xyz.sum(axis=1)
        if not white.min() > 1e-4 * white.max():  # also catches a light without power
            raise InvalidInputError(
                f"light {light.name!r} has the white XYZ {white.tolist()} on {grid}; all three must be above "
                "1/10,000 of the largest, so give it power over the whole visible range"
            )
        rows.append(RGB_FROM_XYZ @ (xyz * (WHITE_XYZ / white)[:, None]))
    return np.concatenate(rows)


@dataclass(frozen=True, slots=True, eq=False)
class ScaledReach:
    """Largest scales s at which ``floor + s * color`` can be reached, for k wanted colors.

    ``scales``: (k,), 0 where only the gray of the floor can be reached. ``reflectances``: (k, n), one that does it.
    ``multipliers``: (k, 3L), how fast the scale grows with each coordinate of the color: the conflict, in numbers.
    """

    scales: Array
    reflectances: Array
    multipliers: Array


def reachable_scales(matrix: ArrayLike, colors: ArrayLike, floor: float) -> ScaledReach:
    """Find for each wanted color the largest reachable scale from the gray ``floor``.

    Solves k independent linear programs, max s subject to M r - s c = floor * M 1, 0 <= r <= 1, as one sparse program.

    Parameters
    ----------
    matrix : (m, n), from ``stimulus_matrix`` (its rows sum to 1) or from a basis.
    colors : (k, m) directions c; a display color per light, each from 0 to 1.
    floor : gray in [0, 1) that every color is added to.

    Raises
    ------
    SolveError : the linear program fails.
    """
    stimuli = frozen_array("matrix", matrix, (None, None))
    wanted = frozen_array("colors", np.atleast_2d(real_numbers("colors", colors)), (None, len(stimuli)))
    require_range("floor", floor, 0.0, 0.999)
    count, (rows, knots) = len(wanted), stimuli.shape
    block = sparse.csc_matrix(stimuli)
    equations = sparse.hstack(
        [sparse.block_diag([block] * count), sparse.block_diag([-color[:, None] for color in wanted])], format="csc"
    )
    given = np.tile(floor * stimuli.sum(axis=1), count)
    costs = np.concatenate([np.zeros(count * knots), -np.ones(count)])
    bounds = np.concatenate([np.tile([0.0, 1.0], (count * knots, 1)), np.tile([0.0, 1.0 - floor], (count, 1))])
    answer = linprog(costs, A_eq=equations, b_eq=given, bounds=bounds, method="highs-ds")
    if answer.status != 0:
        raise SolveError(f"the linear program of reachable colors failed: {answer.message}")
    return ScaledReach(
        answer.x[count * knots :],
        answer.x[: count * knots].reshape(count, knots),
        answer.eqlin.marginals.reshape(count, rows),
    )


def corner_colors(lights: int) -> Array:
    """Corners (8^L - 1, 3L) of the cubes of display colors of L lights, without the one that is all black."""
    corners = np.array(list(itertools.product((0.0, 1.0), repeat=3 * lights)))
    return corners[1:]


@dataclass(frozen=True, slots=True, eq=False)
class ReachableContrast:
    """Contrast of every combination of pictures under given lights.

    ``floor`` b and ``slope`` s: every display color v of every picture can be shown as b + s v. ``contrast``: (b + s) /
    b. ``limiting_colors``: (L, 3), the combination of colors that limits it.
    """

    floor: float
    slope: float
    limiting_colors: Array

    @property
    def contrast(self) -> float:
        """Ratio of the lightest to the darkest gray; infinite for floor 0."""
        return float("inf") if self.floor == 0 else (self.floor + self.slope) / self.floor


def reachable_contrast(lights: Sequence[Illuminant], floor: float = 0.05) -> ReachableContrast:
    """Contrast that unrelated pictures can have under ``lights``, before any texel is solved.

    Parameters
    ----------
    lights : one light per picture, 1 to 3.
    floor : linear gray of the darkest color, 0 to 0.999.
    """
    lights = sequence_of("lights", lights)
    if not 1 <= len(lights) <= 3:
        raise InvalidInputError(f"reachable contrast is decided for 1 to 3 lights; got {len(lights)}")
    corners = corner_colors(len(lights))
    scales = reachable_scales(stimulus_matrix(lights), corners, floor).scales
    hardest = int(scales.argmin())
    return ReachableContrast(floor, float(scales[hardest]), frozen_array("corner", corners[hardest].reshape(-1, 3)))
