# SPDX-License-Identifier: GPL-3.0-or-later
"""One side of a palette as a stacked quadratic, and its roughness term."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.criteria import second_differences
from spectral_core.palette.assemble.view import Side, View
from spectral_core.palette.qp.quadratic import Quadratic
from spectral_core.spectra.spectrum import SpectralGrid

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Assembled:
    """The quadratic of a side, and the cells of its blocks and free colors."""

    side: Side
    items: tuple[int, ...]
    """Index of the light or reflectance of each block."""
    quadratic: Quadratic
    group_conditions: tuple[tuple[int, int], ...]
    """(group, condition) of each free color."""
    view: View


@lru_cache(maxsize=64)
def weighted_roughness(grid: SpectralGrid, operator: str, weight: float) -> tuple[Array, Array]:
    """ω_D D, and its square, of one spectrum."""
    rows = weight * second_differences(grid, operator)
    return rows, rows.T @ rows
