# SPDX-License-Identifier: GPL-3.0-or-later
"""Units of length in headers that state one for each axis."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError

METERS = {
    "m": 1.0, "cm": 1e-2, "mm": 1e-3, "µm": 1e-6, "um": 1e-6, "nm": 1e-9, "pm": 1e-12, "Å": 1e-10, "inch": 0.0254,
    "meter": 1.0, "centimeter": 1e-2, "millimeter": 1e-3, "micron": 1e-6, "micrometer": 1e-6, "nanometer": 1e-9,
}  # fmt: skip
"""Length of each unit in meters; plurals are accepted too."""


def unit_factors(units: Sequence[str], source: str) -> NDArray[np.float64]:
    """Factors that convert a length in each unit into the unit of the first; raises FileFormatError for units that
    differ and are not all known.
    """
    names = [unit.strip().replace("\u03bc", "µ").replace("\\u00B5", "µ") for unit in units]
    if len(set(names)) == 1:
        return np.ones(len(names))
    meters = [METERS.get(name, METERS.get(name.lower().removesuffix("s"), math.nan)) for name in names]
    if not np.isfinite(meters).all():
        raise FileFormatError(
            f"{source} voxel sizes in the units {', '.join(unit or 'none' for unit in names)}; expected one unit for "
            f"all axes, or lengths among {', '.join(METERS)}"
        )
    return np.array(meters) / meters[0]
