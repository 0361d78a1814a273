# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer functions to start from, fitted to a field's values and size."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from spectral_core.checks import require_kind, require_range
from spectral_core.errors import UnknownNameError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.fill_values import some_values, with_width, without_fill_values
from spectral_core.volume.gradient import gradient_magnitude
from spectral_core.volume.transfer import Material, TransferFunction

_WARM, _COOL, _PALE = (0.95, 0.45, 0.12), (0.15, 0.45, 0.85), (0.9, 0.88, 0.8)


def preset(name: str, volume: ScalarVolume, density: float = 1.0) -> TransferFunction:
    """The preset ``name`` (see ``PRESETS``) for ``volume``; ``density`` makes all of it thicker or thinner."""
    if name not in PRESETS:
        raise UnknownNameError.among("transfer function preset", name, PRESETS)
    require_kind("the volume", volume, ScalarVolume, "volume.files.read_volume(PATH)")
    return PRESETS[name](volume).scaled(require_range("density", density, 0.0, 1e30))


def _places(volume: ScalarVolume) -> tuple[np.ndarray, float]:
    """Data values at 0, 0.1 … 1 of the range without outliers, and one voxel's world length."""
    some = without_fill_values(some_values(volume.data))
    low, high = float(some[0]), float(np.percentile(some, 99.9))
    if high <= low:
        high = float(some[-1])
    low, high = with_width(low, high)
    return low + (high - low) * np.linspace(0, 1, 11), float(np.prod(volume.voxel_size) ** (1 / 3))


def wide(volume: ScalarVolume) -> TransferFunction:
    """Three overlapping, mostly transparent materials over the whole range."""
    v, voxel = _places(volume)
    return TransferFunction(
        (
            Material("haze", v[[1, 3, 5]], np.array([0, 0.02, 0]) / voxel, np.array(_WARM)),
            Material("body", v[[3, 6, 8]], np.array([0, 0.1, 0]) / voxel, np.array(_COOL)),
            Material("core", v[[6, 10]], np.array([0, 0.4]) / voxel, np.array(_PALE)),
        )
    )


def narrow(volume: ScalarVolume) -> TransferFunction:
    """Two isosurface-like shells, each two hundredths of the range wide."""
    v, voxel = _places(volume)
    half = 0.1 * (v[1] - v[0])
    return TransferFunction(
        (
            Material("outer", v[3] + half * np.array([-1, 0, 1]), np.array([0, 1.0, 0]) / voxel, np.array(_WARM)),
            Material("inner", v[6] + half * np.array([-1, 0, 1]), np.array([0, 3.0, 0]) / voxel, np.array(_COOL)),
        )
    )


def opaque(volume: ScalarVolume) -> TransferFunction:
    """Two solid materials, both nearly opaque."""
    v, voxel = _places(volume)
    return TransferFunction(
        (
            Material("skin", v[[2, 4, 6]], np.array([0, 0.6, 0]) / voxel, np.array(_WARM)),
            Material("solid", v[[4, 6, 10]], np.array([0, 3.0, 3.0]) / voxel, np.array(_COOL)),
        )
    )


def xray(volume: ScalarVolume) -> TransferFunction:
    """Light in proportion to the value, without absorption: a radiograph (thesis 5.4.4)."""
    v, voxel = _places(volume)
    reach = 0.5 * max(volume.shape) * voxel
    material = Material("x-ray", v[[1, 10]], np.zeros(2), np.array(_PALE), np.array([0.0, 1.0]) / reach, lit=False)
    return TransferFunction((material,))


def edges(volume: ScalarVolume) -> TransferFunction:
    """Two-dimensional: visible only where the value changes quickly, so boundaries are visible and interiors are
    not.
    """
    v, voxel = _places(volume)
    slopes = gradient_magnitude(volume).data
    # A small object in an empty field has a slope in less than a fiftieth of the voxels.
    steep = float(np.percentile(slopes, 98)) or float(np.percentile(slopes[slopes > 0], 50)) if slopes.any() else 1.0
    lower, upper = v[[0, 1, 5, 6]], v[[5, 6, 10]]
    fade: dict[str, Any] = {"gradient_values": np.array([0.2, 0.8]) * steep, "gradient_weights": np.array([0.0, 1.0])}
    return TransferFunction(
        (
            Material("soft edge", lower, np.array([0, 0.3, 0.3, 0]) / voxel, np.array(_WARM), **fade),
            Material("hard edge", upper, np.array([0, 1.0, 1.0]) / voxel, np.array(_COOL), **fade),
        )
    )


PRESETS: dict[str, Callable[[ScalarVolume], TransferFunction]] = {
    "wide": wide,
    "narrow": narrow,
    "opaque": opaque,
    "xray": xray,
    "edges": edges,
}
