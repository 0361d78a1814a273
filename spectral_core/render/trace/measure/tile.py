# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels of one kernel launch, and their running sums."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass
class Tile:
    """Pixels that are rendered together and their running sums."""

    first: int
    count: int
    sums: Any = None
    covered: Any = None
    bands: Any = None
    lost: Any = None
    """Samples per pixel whose radiance was NaN or Inf: they count as black."""
    light: Any = None
    """Shares of the light (pixels · rows · 3), if the integrator separates them."""
    samples: int = 0
    """Samples per pixel in the sums: a pass that is stopped leaves tiles with different numbers."""

    @property
    def lanes(self) -> int:
        """Lanes of its kernel, at least two: Dr.Jit takes numbers of a single lane for constants, and a loop that
        changes them is refused. The second lane of a single pixel does not count.
        """
        return max(self.count, 2)

    def mean(self, sums: Any) -> NDArray[np.float64]:
        """Mean of some of its sums, pixel after pixel; zeros before any sample."""
        return self.of_pixels(sums) / max(1, self.samples)

    def of_pixels(self, sums: Any) -> NDArray[np.float64]:
        """Some of its sums, pixel after pixel."""
        found = np.array(sums, dtype=np.float64)
        return found[..., : found.shape[-1] * self.count // self.lanes]
