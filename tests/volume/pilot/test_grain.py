# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of steps look like fine grain: rays of neighboring pixels begin their steps at different phases."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping
from spectral_core.volume.march.dither import EDGE, blue_noise
from spectral_core.volume.march.march_input import REFERENCE
from spectral_core.volume.plan import plan
from spectral_core.volume.presets import preset
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.samples import sample_volume
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View

pytest.importorskip("drjit")


def in_display(linear: np.ndarray) -> np.ndarray:
    """Levels of 0 to 255 of an sRGB display."""
    x = np.clip(linear, 0.0, 1.0)
    return 255 * np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055)


def bands(renderer: VolumeRenderer, transfer: TransferFunction, stepping: Stepping) -> tuple[float, float]:
    """Largest mean error over 5 × 5 pixels, and the root mean square error of pixels, in levels of a display."""
    view = replace(View.around(renderer.volume), width=160, height=160)
    wanted = renderer.render(view, transfer, Stepping("error", "preintegrated", 0.05), limits=REFERENCE).picture()
    error = in_display(renderer.render(view, transfer, stepping).picture()) - in_display(wanted)
    return float(np.abs(ndimage.uniform_filter(error, (5, 5, 1))).max()), float(error.std())


def test_errors_of_uniform_steps_have_no_bands() -> None:
    """Steps that all begin at the border of the field gave bands of 1.9 levels at the same error of single pixels."""
    volume = sample_volume("gaussians")
    band, single = bands(VolumeRenderer(volume), preset("wide", volume), Stepping("uniform", "midpoint", 2.5))
    assert 0.1 < single < 0.5
    assert band < 1.5


def test_fog_is_not_planned_with_one_or_two_steps_per_ray() -> None:
    """Two steps per ray reached 42 dB, with bands of 12 levels."""
    x, y, z = np.meshgrid(*(np.linspace(-1, 1, 48),) * 3, indexing="ij")
    density = np.exp(-2.5 * (x * x + y * y + z * z)) * (
        1 + 0.15 * np.sin(5 * x + 1) * np.cos(4 * y) * np.sin(3 * z + 2)
    )
    volume = ScalarVolume("fog", density.astype(np.float32))
    fog = Material("fog", np.array([0.02, 0.5, 1.1]), np.array([0.0, 0.4, 3.0]), np.ones(3))
    core = Material("core", np.array([0.6, 0.9]), np.array([0.0, 2.0]), np.array([0.1, 0.2, 0.9]))
    transfer, renderer = TransferFunction((fog, core)), VolumeRenderer(volume)
    made = plan(renderer, replace(View.around(volume), width=160, height=160), transfer, 42.0)
    assert made.stepping.rule != "uniform" or made.stepping.scale <= 4.0
    band, _ = bands(renderer, transfer, made.stepping)
    assert band < 4.0


def test_every_phase_occurs_once_and_neighbors_differ() -> None:
    noise = blue_noise()
    np.testing.assert_allclose(np.sort(noise.ravel()), (np.arange(EDGE**2) + 0.5) / EDGE**2, rtol=1e-6)
    even = ndimage.uniform_filter(noise, 5, mode="wrap").std()
    shuffled = np.random.default_rng(1).permutation(noise.ravel()).reshape(noise.shape)
    assert even < 0.5 * ndimage.uniform_filter(shuffled, 5, mode="wrap").std()
    for share in (0.1, 0.3, 0.7):  # the pixels of lesser phases are spread evenly over the pattern
        counts = (noise < share).reshape(4, EDGE // 4, 4, EDGE // 4).sum(axis=(1, 3)) / (EDGE / 4) ** 2
        assert np.abs(counts - share).max() < 0.06
