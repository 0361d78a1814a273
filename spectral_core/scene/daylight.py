# SPDX-License-Identifier: GPL-3.0-or-later
"""The sky of Preetham, Shirley and Smits 1999, "A practical analytic model for daylight", at Blender's scale."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def preetham(turbidity: float, sun: Array, directions: Array) -> Array:
    """XYZ (..., 3) of the sky along unit directions (..., 3), ``sun`` the one toward the sun."""
    t = turbidity
    theta_sun = float(np.arccos(np.clip(sun[2], -1, 1)))
    rows: dict[str, Any] = {
        "Y": (0.1787 * t - 1.463, -0.3554 * t + 0.4275, -0.0227 * t + 5.3251, 0.1206 * t - 2.5771, -0.067 * t + 0.3703),
        "x": (-0.0193 * t - 0.2592, -0.0665 * t + 0.0008, -0.0004 * t + 0.2125, -0.0641 * t - 0.8989,
              -0.0033 * t + 0.0452),
        "y": (-0.0167 * t - 0.2608, -0.095 * t + 0.0092, -0.0079 * t + 0.2102, -0.0441 * t - 1.6537,
              -0.0109 * t + 0.0529),
    }  # fmt: skip
    chi = (4 / 9 - t / 120) * (np.pi - 2 * theta_sun)
    powers = theta_sun ** np.array([3.0, 2.0, 1.0, 0.0])
    matrices = {"x": [[0.00166, -0.00375, 0.00209, 0], [-0.02903, 0.06377, -0.03202, 0.00394],
                      [0.11693, -0.21196, 0.06052, 0.25886]],
                "y": [[0.00275, -0.0061, 0.00317, 0], [-0.04214, 0.0897, -0.04153, 0.00516],
                      [0.15346, -0.26756, 0.0667, 0.26688]]}  # fmt: skip
    zenith = {name: float(np.array([t * t, t, 1.0]) @ np.array(m) @ powers) for name, m in matrices.items()}
    zenith["Y"] = ((4.0453 * t - 4.971) * np.tan(chi) - 0.2155 * t + 2.4192) * 0.06
    theta = np.minimum(np.arccos(np.clip(directions[..., 2], -1, 1)), np.pi / 2 - 0.001)
    gamma = np.arccos(np.clip(directions @ sun, -1, 1))

    def perez(row: tuple[float, ...], theta: Any, gamma: Any) -> Any:
        a, b, c, d, e = row
        return (1 + a * np.exp(b / np.cos(theta))) * (1 + c * np.exp(d * gamma) + e * np.cos(gamma) ** 2)

    found = {n: zenith[n] * perez(row, theta, gamma) / perez(row, 0.0, theta_sun) for n, row in rows.items()}
    scale = found["Y"] / np.where(found["y"] == 0, 1, found["y"])
    return np.stack([found["x"] * scale, found["Y"], (1 - found["x"] - found["y"]) * scale], axis=-1)
