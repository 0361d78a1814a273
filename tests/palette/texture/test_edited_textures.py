# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral textures that another program has written again: read as they are, or refused with the name of the file."""

from __future__ import annotations

import numpy as np
import OpenEXR
import pytest

from spectral_core.errors import FileFormatError
from spectral_core.palette.texture.file import ATTRIBUTE, read_texture, write_texture
from spectral_core.palette.texture.reach import TEXTURE_GRID
from spectral_core.palette.texture.texture import SpectralTexture
from spectral_core.spectra.catalogue import illuminant


@pytest.fixture
def edited(tmp_path):
    """A function that changes the weights, float32 (2, 3, 5), or the header of a texture, and its file."""
    band = np.linspace(0.0, 1.0, TEXTURE_GRID.size)
    weights = np.random.default_rng(3).random((2, 3, 5)).astype(np.float16)
    path = tmp_path / "texture.exr"
    write_texture(path, SpectralTexture(weights, np.stack([band, 1 - band]), (illuminant("D65"),)))
    about = OpenEXR.File(str(path)).header()[ATTRIBUTE]

    def edit(change, **header):
        planes = {f"weight.{k}": plane for k, plane in enumerate(change(weights.astype(np.float32)))}
        plain = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION, ATTRIBUTE: about}
        OpenEXR.File(plain | header, planes).write(str(path))
        return weights

    return edit, path


def test_floats_and_negative_zeros_are_read(edited) -> None:
    """-0 was “outside [0, 1]”."""
    edit, path = edited
    weights = edit(lambda each: np.where(each < 0.5, -0.0, each))
    assert np.array_equal(read_texture(path).weights, np.where(weights < 0.5, 0, weights))


@pytest.mark.parametrize("change", [lambda each: each * 2, lambda each: each - 0.5, lambda each: each * np.nan])
def test_weights_outside_of_their_range_name_the_file(edited, change) -> None:
    edit, path = edited
    edit(change)
    with pytest.raises(FileFormatError, match=r"texture\.exr: weights are outside \[0, 1\]"):
        read_texture(path)


def test_a_part_of_a_texture_is_refused(edited) -> None:
    """Programs that leave out black borders wrote less than the picture; the rest was stretched over the surface."""
    edit, path = edited
    part = np.array([1, 1], np.int32), np.array([4, 2], np.int32)
    whole = np.array([0, 0], np.int32), np.array([4, 2], np.int32)
    edit(lambda each: each[:, 1:, 1:].copy(), dataWindow=part, displayWindow=whole)
    with pytest.raises(FileFormatError, match=r"texture\.exr has pixels for another area than its picture"):
        read_texture(path)
