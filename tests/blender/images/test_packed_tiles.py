# SPDX-License-Identifier: GPL-3.0-or-later
"""Tiles of a UDIM image that is packed into the .blend."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.blender.images.test_image_files import colors, saved, textured  # noqa: E402


def test_packed_tiles_are_those_of_their_files(build, translate, tmp_path):
    """A render of a packed UDIM image ended in an AttributeError. The name has the number of another tile, too."""
    shown = {1001: (0.2, 0.4, 0.6), 1002: (0.8, 0.2, 0.0)}
    for number, color in shown.items():
        saved(tmp_path / f"v1002_{number}.png", color)
    image = bpy.data.images.load(str(tmp_path / "v1002_1001.png"))
    image.source, image.filepath = "TILED", str(tmp_path / "v1002_<UDIM>.png")
    if 1002 not in [tile.number for tile in image.tiles]:
        image.tiles.new(1002)
    textured(build, image)
    places = (0.4, 0.5), (1.7, 0.1)
    beside = colors(translate(), *places)
    image.pack()
    for number in shown:
        (tmp_path / f"v1002_{number}.png").unlink()
    scene = translate()
    np.testing.assert_allclose(beside, list(shown.values()), atol=1 / 255)
    np.testing.assert_array_equal(colors(scene, *places), beside)
    assert not scene.notes and len(bpy.data.images) == 1
