# SPDX-License-Identifier: GPL-3.0-or-later
"""Multilayer EXR files as textures, as a render that was saved with its passes."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
OpenEXR = pytest.importorskip("OpenEXR")

from tests.blender.images.test_image_files import colors, textured  # noqa: E402

ROW = np.array([[0.25, 0.5, 2.0, 0.75]], np.float32)
"""Red of the pixels of a row, which tells left from right; green is half of it in the upper of two rows, else 0."""


@pytest.fixture
def layered(tmp_path):
    """A file with the layers Combined and Depth in one part, as Blender 4 writes it."""
    red = np.repeat(ROW, 2, axis=0)
    green = red * np.array([[0.5], [0.0]], np.float32)
    named = {"R": red, "G": green, "B": 0 * red, "A": 0 * red + 1}
    channels = {f"ViewLayer.Combined.{letter}": values for letter, values in named.items()}
    channels["ViewLayer.Depth.Z"] = 0 * red + 7
    path = str(tmp_path / "layers.exr")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {name: OpenEXR.Channel(values) for name, values in channels.items()}) as file:
        file.write(path)
    return bpy.data.images.load(path)


@pytest.mark.parametrize("space", ["Non-Color", "Linear Rec.709"])
def test_the_first_layer_is_shown(build, translate, layered, space):
    """As in Cycles, for which Blender gives a script no pixels: it was magenta."""
    node = textured(build, layered)
    layered.colorspace_settings.name = space
    node.interpolation, node.extension = "Closest", "EXTEND"
    scene = translate()
    places = [(u, v) for v in (0.75, 0.25) for u in (0.125, 0.375, 0.625, 0.875)]
    upper = [(red, red / 2, 0) for red in ROW[0]]
    lower = [(red, 0, 0) for red in ROW[0]]
    np.testing.assert_allclose(colors(scene, *places), upper + lower, rtol=1e-6)
    assert scene.notes == ()


def test_a_color_space_that_only_blender_converts_has_a_note(build, translate, layered):
    textured(build, layered)
    layered.colorspace_settings.name = "ACEScg"
    assert "the color space 'ACEScg' of a file of several layers" in translate().notes[0].message
