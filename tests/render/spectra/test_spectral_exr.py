# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral EXR: round trips, and channel names that other programs read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.render import Bands, render_scene
from spectral_core.render.images.spectral_exr import read_spectral_exr, spectral_channel, write_spectral_exr
from spectral_core.scene import Film, PointLight
from tests.render.scenes import lit_plane, looking_down, matrix

OpenEXR = pytest.importorskip("OpenEXR")


def test_bands_are_read_back_with_their_wavelengths(tmp_path: Path) -> None:
    light = PointLight(name="point", world_from_light=matrix((0.5, 0, 3)), power_w=50)
    scene = lit_plane(light, camera=looking_down(8, 0.5), film=Film(5, 4, samples=2))
    result = render_scene(scene, bands=Bands.uniform(400, 700, 7))
    path = write_spectral_exr(tmp_path / "picture.exr", result)
    wavelengths, radiance = read_spectral_exr(path)

    np.testing.assert_array_equal(wavelengths, np.linspace(400, 700, 7))
    np.testing.assert_array_equal(radiance, result.band_pixels)
    names = set(OpenEXR.File(str(path), separate_channels=True).parts[0].channels)
    assert {"R", "G", "B", "A", "S0.400,000000nm", "S0.550,000000nm"} <= names
    with pytest.raises(InvalidInputError, match="measured no spectral bands"):
        write_spectral_exr(path, replace(result, bands=None))


def test_other_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "plain.exr"
    OpenEXR.File({}, {"R": np.zeros((2, 2), np.float32)}).write(str(path))

    with pytest.raises(FileFormatError, match="has no spectral channel such as"):
        read_spectral_exr(path)
    with pytest.raises(FileFormatError, match="there is no file"):
        read_spectral_exr(tmp_path / "absent.exr")
    assert spectral_channel(532.25) == "S0.532,250000nm"


def test_every_spelling_of_a_wavelength_in_the_layout_is_read(tmp_path: Path) -> None:
    """The paper's grammar: no fraction, no whole part, exponents, prefixes of the meter."""
    path = tmp_path / "elsewhere.exr"
    names = {"S0.700nm": 7.0, "S0.0,4um": 4.0, "S0.5,5e-7m": 5.5, "S0.6E2nm": 6.0, "S0.,00065mm": 6.5, "S1.500nm": 9.0}
    OpenEXR.File({}, {name: np.full((2, 2), value, np.float32) for name, value in names.items()}).write(str(path))
    wavelengths, radiance = read_spectral_exr(path)
    np.testing.assert_allclose(wavelengths, [400, 550, 600, 650, 700], rtol=1e-12)
    np.testing.assert_array_equal(radiance[0, 0], [4.0, 5.5, 6.0, 6.5, 7.0])


def test_two_channels_of_one_wavelength_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "twice.exr"
    OpenEXR.File({}, {name: np.zeros((2, 2), np.float32) for name in ("S0.550nm", "S0.550,0nm")}).write(str(path))
    with pytest.raises(FileFormatError, match="two channels of 550 nm"):
        read_spectral_exr(path)
