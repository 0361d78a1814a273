# SPDX-License-Identifier: GPL-3.0-or-later
"""Colored media and volumes for the comparison of RGB with spectra: what they let pass, and what they scatter.

A coefficient is upsampled, not the transmittance: exp(-σ d) of three channels and of wavelengths differ, the more, the
deeper light goes. Each part is compared as a surface of that color would be.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.plan import bounds
from spectral_core.scene import Color, Material, ScatteringMedium, Scene
from spectral_core.spectra.upsample import upsampled

Array = NDArray[np.float64]

DEEPEST, HALVINGS = 8.0, 7
"""Largest optical depth of the strongest channel that is compared, and the number of depths, each half of the last."""
GRAY = 1e-6
"""Difference of channels below which a medium has no color."""


def varies_in_color(medium: ScatteringMedium) -> bool:
    """True if the voxels of a medium have colors of their own."""
    return medium.grid is not None and any(values.ndim == 4 for values in medium.grid.given)


def media_surfaces(scene: Scene, materials: list[Material]) -> list[tuple[Array, Any, bool]]:
    """What the media of ``materials`` and of the world let pass at several depths, and what they scatter: as RGB
    transport has it, and by wavelength. None of it is measured.
    """
    found = [(each.medium, bounds.optical_depth(scene, each)) for each in materials if each.medium is not None]
    if scene.world.medium is not None:
        found.append((scene.world.medium, DEEPEST))
    return [part for medium, depth in found if depth > 0 for part in _parts(medium, min(depth, DEEPEST))]


def lit_colors(scene: Scene) -> list[Color]:
    """Colors with which sampled volumes reflect the light of the scene, those of transfer functions in linear RGB."""
    lit = (
        material for volume in scene.volumes if volume.lighting != "even" and volume.transfer.wavelengths_nm is None
        for material in volume.transfer.materials if material.lit
    )  # fmt: skip
    return [Color(np.asarray(material.color, dtype=np.float64)) for material in lit]


def _parts(medium: ScatteringMedium, depth: float) -> Iterator[tuple[Array, Any, bool]]:
    if not isinstance(medium.extinction, Color):
        return  # gray; a spectrum is not compared, and a color that varies is rendered gray
    rgb = np.maximum(medium.extinction.linear_rgb, 0.0)
    largest = float(rgb.max())
    if np.ptp(rgb) < GRAY * max(largest, 1.0):
        return
    for halving in range(HALVINGS):
        far = depth / (largest * 2**halving)
        yield np.exp(-far * rgb), (lambda points, far=far: np.exp(-far * _extinction(rgb, points))), False
    if isinstance(medium.color, Color) and np.any(medium.color.linear_rgb > 0):
        albedo = np.clip(medium.color.linear_rgb, 0.0, 1.0)
        share = min(depth, 1.0) / largest  # no more of the light meets the medium
        yield share * albedo * rgb, lambda points: share * upsampled(albedo, points) * _extinction(rgb, points), False


def _extinction(rgb: Array, points: Array) -> Array:
    """Coefficient by wavelength, as spectral transport has it of a color that may exceed 1."""
    size = max(float(rgb.max()), 1.0)
    return np.asarray(upsampled(rgb / size, points) * size)
