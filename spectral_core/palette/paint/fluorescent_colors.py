# SPDX-License-Identifier: GPL-3.0-or-later
"""Color matrices of a fluorescent palette: all integrals that stay the same while its spectra are designed.

On the palette's grid the color is linear in the light, and linear in the reflectance and the amounts of dyes. Dyes add
their emitted color times the power that they absorb.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.kernel import color_kernel
from spectral_core.palette.problem import PaletteProblem
from spectral_core.spectra.fluorescence import FluorescentDye, share_between_knots
from spectral_core.spectra.observer import integration_points, observer

Array = NDArray[np.float64]


class FluorescentColors:
    """Matrices of cells. ``dyes``: those of each reflectance; ``light``, ``surface`` None: the given one."""

    def __init__(self, problem: PaletteProblem, dyes: Sequence[Sequence[FluorescentDye]]) -> None:
        grid = problem.grid
        self._kernel, viewer = color_kernel(grid, problem.observers), observer(problem.observers[0])
        points, weights = integration_points(grid.wavelengths_nm)
        self.shares = [share_between_knots(own, grid.wavelengths_nm) for own in dyes]
        """Per reflectance (n, k): share of the light that a unit amount of each dye returns at most."""
        self._emitted = [np.array([dye.emitted_rgb(viewer) for dye in own]).reshape(-1, 3) for own in dyes]
        excited = [
            [grid.against_hats(points, dye.excitation_at(points, grid) * weights)[0] for dye in own] for own in dyes
        ]
        self._excited = [np.array(own).reshape(-1, grid.size) for own in excited]
        given = [None if light.free else light.spectrum for light in problem.lights]
        self._of_light = [None if light is None else self._kernel.matrix_of(light)[0] for light in given]
        self._absorbed = [
            [np.zeros(len(own)) if light is None else np.array([dye.absorbed_power(light, grid) for dye in own])
             for light in given]
            for own in dyes
        ]  # fmt: skip
        measured = [item.spectrum for item in problem.reflectances]
        self._of_surface = [None if each is None else self._kernel.matrix_of(each)[0] for each in measured]
        self._of_both = {
            (i, j): self._kernel.color_of(light, each)[0]
            for i, each in enumerate(measured)
            for j, light in enumerate(given)
            if each is not None and light is not None
        }

    def by_surface(self, i: int, j: int, light: Array | None) -> Array:
        """(3, n + k): color from the reflectance and the amounts of dyes of row i under a light of column j."""
        fixed = self._of_light[j]
        matrix = self._kernel.matrices(_known(light)[None])[0, 0] if fixed is None else fixed
        absorbed = self._absorbed[i][j] if fixed is not None else self._excited[i] @ _known(light)
        return np.concatenate([matrix, (self._emitted[i] * absorbed[:, None]).T], axis=1)

    def by_light(self, i: int, surface: Array | None) -> Array:
        """(3, n): color from a light on the grid; ``surface``: reflectance and amounts (n + k,) of row i."""
        fixed = self._of_surface[i]
        if fixed is not None:
            return fixed
        n = self._kernel.grid.size
        values = _known(surface)
        own = self._kernel.matrices(values[None, :n])[0, 0]
        return np.asarray(own + (self._emitted[i] * values[n:, None]).T @ self._excited[i])

    def color(self, i: int, j: int, light: Array | None, surface: Array | None) -> Array:
        """Linear RGB (3,) of a cell."""
        if surface is not None:
            return np.asarray(self.by_surface(i, j, light) @ surface)
        return np.asarray(self._of_both[i, j] if light is None else self.by_light(i, None) @ light)


def _known(values: Array | None) -> Array:
    """The values of a spectrum that is designed."""
    assert values is not None
    return values
