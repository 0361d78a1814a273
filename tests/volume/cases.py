# SPDX-License-Identifier: GPL-3.0-or-later
"""Small fields, functions and comparisons that the volume tests share."""

from __future__ import annotations

import numpy as np

from benchmarks.volume.checks.oracle import march_oracle
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping, VolumeImage
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View


def blob(size: int = 24, dtype: type = np.uint8, name: str = "blob") -> ScalarVolume:
    """A soft ball off the center, values 0 to 200."""
    x, y, z = np.meshgrid(*[np.linspace(-1, 1, size)] * 3, indexing="ij")
    ball = 200 * np.exp(-3 * ((x - 0.1) ** 2 + (1.2 * y) ** 2 + z**2))
    return ScalarVolume(name, np.asfortranarray(ball.astype(dtype)))


def two_tents(scale: float = 1.0) -> TransferFunction:
    """Two materials, red and blue, over values 20 to 200."""
    return TransferFunction(
        (
            Material("red", [20, 70, 120], np.array([0, 0.2, 0]) * scale, [0.9, 0.2, 0.1]),
            Material("blue", [90, 150, 200], np.array([0, 0.4, 0.5]) * scale, [0.1, 0.3, 0.9]),
        )
    )


def against_oracle(
    volume: ScalarVolume, transfer: TransferFunction, view: View, stepping: Stepping, oracle_step: float = 0.02
) -> tuple[float, float, VolumeImage]:
    """(relative error of the amounts, greatest error of the transmittance, image): fast march against NumPy's."""
    image = VolumeRenderer(volume).render(view, transfer, stepping, counts=True)
    begin = -np.inf if view.fov_deg is None else 0.0
    exact = march_oracle(volume, transfer, view.rays_world(), oracle_step, begin)
    amounts = exact.amounts.reshape(image.amounts.shape)
    assert np.isfinite(image.amounts).all() and np.isfinite(image.transmittance).all()
    scale = np.linalg.norm(amounts)
    error = np.linalg.norm(image.amounts - amounts) / scale if scale else float(np.abs(image.amounts).max())
    away = np.abs(image.transmittance - exact.transmittance.reshape(image.transmittance.shape)).max()
    return float(error), float(away), image


def across(volume: ScalarVolume, pixels: int = 1, **rest: object) -> View:
    """An orthographic camera along +x through the center of the field."""
    middle = volume.corners_world.mean(axis=0)
    width = float(np.ptp(volume.corners_world[:, 1]))
    away = middle - np.array([2.0 * float(np.ptp(volume.corners_world[:, 0])), 0.0, 0.0])
    return View.looking(away, middle, width=pixels, height=pixels, fov_deg=None, ortho_width=width, **rest)
