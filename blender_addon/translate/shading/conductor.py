# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors of a metal that is given by its index of refraction and extinction."""

from __future__ import annotations

import numpy as np

from spectral_core.scene import Color, Paint


def conductor_colors(index: np.ndarray, extinction: np.ndarray) -> tuple[Paint, Paint]:
    """Colors facing and toward 82 degrees that stand for an index and extinction per channel."""

    def reflectance(cosine: float) -> np.ndarray:
        n2, k2, c2 = index**2, extinction**2, cosine**2
        total = n2 + k2
        across = (total - 2 * index * cosine + c2) / (total + 2 * index * cosine + c2)
        along = (total * c2 - 2 * index * cosine + 1) / (total * c2 + 2 * index * cosine + 1)
        return np.asarray((across + along) / 2)

    facing, edge = reflectance(1.0), reflectance(1 / 7)
    schlick = facing + (1 - facing) * (1 - 1 / 7) ** 5
    return Color(facing), Color(np.clip(edge / np.maximum(schlick, 1e-6), 0, 1))
