# SPDX-License-Identifier: GPL-3.0-or-later
"""Sample fields against their definitions, stated here voxel by voxel or as solids with sharp edges."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spectral_core.errors import UnknownNameError
from spectral_core.volume.samples import SAMPLES, engine, gaussians, noise, sample_volume, shells


@pytest.mark.parametrize("name", list(SAMPLES))
def test_sample_fields_have_the_requested_size_and_unit_spacing(name: str) -> None:
    volume = sample_volume(name, 6)
    assert volume.shape == (6, 6, 6) and volume.name == name
    np.testing.assert_array_equal(volume.world_from_index, np.eye(4))
    assert volume.data.flags.f_contiguous
    assert sample_volume(name, 1).shape == (1, 1, 1)
    with pytest.raises(UnknownNameError, match="sample volume"):
        sample_volume(name + "x")


def test_a_field_of_one_voxel_is_that_of_the_center() -> None:
    assert sample_volume("marschner-lobb", 1).data[0, 0, 0] == pytest.approx((1 + 0.25 * 2) / 2.5)
    assert sample_volume("marschner-lobb").shape == (64, 64, 64)


def test_gaussians_are_fourteen_blobs() -> None:
    """Centers, widths and heights in the order of the generator with seed 7."""
    size = 11
    rng = np.random.default_rng(7)
    blobs = [(*rng.uniform(-0.65, 0.65, 3), rng.uniform(0.08, 0.3), rng.uniform(0.4, 1.0)) for _ in range(14)]
    places = [(i / 5 - 1, j / 5 - 1, k / 5 - 1) for i in range(size) for j in range(size) for k in range(size)]
    expected = np.array(
        [sum(h * math.exp(-(math.dist(at, (a, b, c)) ** 2) / (2 * w * w)) for a, b, c, w, h in blobs) for at in places]
    )
    np.testing.assert_allclose(gaussians(size).ravel("C"), expected / expected.max(), atol=2e-6)


def test_shells_rise_at_three_radii_and_ripple_between() -> None:
    """Each voxel by the logistic function of its distance in voxels; half a level of rounding."""
    size = 21
    field = shells(size).astype(float)
    for i, j, k in np.random.default_rng(0).integers(0, size, (400, 3)):
        x, y, z = (np.array([i, j, k]) / 10) - 1
        radius = math.sqrt(x * x + 1.44 * y * y + z * z)
        level = sum(
            rise / (1 + math.exp(min(50.0, max(-50.0, (radius - at) * size / 1.2))))
            for at, rise in ((0.85, 0.3), (0.6, 0.35), (0.3, 0.25))
        )
        if level > 0.05:
            level += 0.04 * math.sin(5 * x) * math.cos(4 * y) * math.sin(3 * z + 1)
        assert abs(field[i, j, k] - 255 * level) <= 0.51


def test_noise_is_white_and_spans_all_bytes() -> None:
    field = noise(24)
    assert (field.min(), field.max()) == (0, 255)
    assert np.array_equal(field, noise(24)) and abs(field.mean() - 127.5) < 2
    spectrum = np.abs(np.fft.fftn(field - field.mean())) ** 2 / field.size
    assert spectrum.mean() == pytest.approx(255 * 257 / 12, rel=0.03)
    counts = np.bincount(field.ravel(), minlength=256)
    assert counts.min() > 20 and counts.max() < 100


def solids(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """2 in a liner or pipe, 1 in the housing, 0 outside: the engine as solids with sharp edges."""

    def tube(a: float, b: float, radius: float, low: float, high: float) -> np.ndarray:
        return (np.hypot(x - a, y - b) < radius) & (z > low) & (z < high)

    def along_x(c: float, height: float, radius: float) -> np.ndarray:
        return (np.hypot(y - c, z - height) < radius) & (np.abs(x) < 0.86)

    housing = (np.abs(x) < 0.78) & (np.abs(y) < 0.46) & (z > -0.65) & (z < 0.45)
    housing |= (np.abs(x) < 0.6) & (np.abs(y) < 0.62) & (z > -0.65) & (z < -0.35)
    hard = np.zeros(housing.shape, bool)
    for a in (-0.5, 0.0, 0.5):
        housing &= ~tube(a, 0, 0.17, -0.4, 0.9)
        hard |= tube(a, 0, 0.21, -0.4, 0.52) & ~tube(a, 0, 0.16, -0.5, 0.9)
        hard |= tube(a + 0.12, 0.32, 0.05, 0.2, 0.75)
    for c in (-0.34, 0.34):
        housing &= ~along_x(c, -0.35, 0.08)
        hard |= along_x(c, -0.35, 0.09) & ~along_x(c, -0.35, 0.055)
    return np.where(hard, 2, np.where(housing, 1, 0))


def test_the_engine_has_its_solids_and_its_haze() -> None:
    """Away from edges each voxel has the value of its solid, within seven deviations of the noise."""
    size = 80
    line = np.linspace(-1, 1, size)
    x, y, z = np.meshgrid(line, line, line, indexing="ij")
    kind = solids(x, y, z)
    inner = np.ones(kind.shape, bool)
    for corner in np.ndindex(2, 2, 2):
        moved = (2 * np.array(corner) - 1) * 1.01 / size
        inner &= solids(x + moved[0], y + moved[1], z + moved[2]) == kind
    assert inner.mean() > 0.8 and all((inner & (kind == k)).sum() > 1000 for k in (0, 1, 2))
    field = engine(size).astype(float)
    for number, level in ((1, 110.0), (2, 215.0)):
        values = field[inner & (kind == number)]
        assert np.abs(values - level).max() < 28
        assert values.mean() == pytest.approx(level, abs=0.2) and values.std() == pytest.approx(4.0, abs=0.1)
    outside = inner & (kind == 0)
    far = [np.maximum(np.abs(at) - edge, 0) for at, edge in ((x, 0.7), (y, 0.5), (z, 0.5))]
    haze = 26 * np.exp(-3 * sum(far))
    assert np.abs(field - haze)[outside].max() < 28
    left = (field - haze)[outside & (haze > 16)]
    assert abs(left.mean()) < 0.1 and left.std() == pytest.approx(4.0, abs=0.1)
