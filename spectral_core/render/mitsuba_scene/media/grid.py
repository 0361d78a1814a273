# SPDX-License-Identifier: GPL-3.0-or-later
"""The grid of a medium that varies, with bounds of its extinction."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.trace.media.grids import GridRow
from spectral_core.scene.medium_grid import MediumGrid

Array = NDArray[Any]

EMISSION_POINTS = 16.0
"""Mean number of points at which emission is read along the grid's diagonal, where it is strongest: it is summed at
collisions, and a medium that only emits has none of its own.
"""
FAINTEST = 0.05
"""Least share of that number where anything emits."""


def slots_of(grid: MediumGrid) -> tuple[Array | None, Array | None, Array | None]:
    """Scattering, absorption and emission."""
    return grid.scattering, grid.absorption, grid.emission


def grid_row(
    grid: MediumGrid, largest: tuple[float, float], tints: tuple[Any, Any, Any] | None, *, emits: bool
) -> GridRow:
    """The grid for the renderer; ``largest``: scattering and absorption of any wavelength where the factors are 1;
    ``emits``: True if the medium emits light.
    """
    bounds = np.zeros(grid.shape, np.float32)
    for values, most in zip(slots_of(grid), largest, strict=False):
        bounds += most if values is None else np.float32(most) * _size(values)
    if emits:
        brightness = np.ones(grid.shape) if grid.emission is None else _size(grid.emission)
        brightest = float(brightness.max())
        if brightest > 0:
            corners = grid.world_from_index[:3, :3] * np.array(grid.shape)
            share = np.where(brightness > 0, np.maximum(brightness / brightest, FAINTEST), 0.0)
            bounds += np.float32(EMISSION_POINTS / np.linalg.norm(corners.sum(axis=1))) * share.astype(np.float32)
    return GridRow(slots_of(grid), np.linalg.inv(grid.world_from_index), bounds, tints)


def _size(values: Array) -> Array:
    """Bound of a factor or color over wavelengths: its gray part, and its other parts, whose spectra may overlap."""
    return values if values.ndim == 3 else values.sum(axis=3) - 2 * values.min(axis=3)
