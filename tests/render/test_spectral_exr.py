# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral EXR: round trips, and channel names that other programs read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.render import Bands, render_scene
from spectral_core.render.spectral_exr import read_spectral_exr, spectral_channel, write_spectral_exr
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
