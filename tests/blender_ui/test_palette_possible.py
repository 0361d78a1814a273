# SPDX-License-Identifier: GPL-3.0-or-later
"""The button Possible? of a selected cell, and taking the nearest color."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.editing.palette.possible import picture_of


@pytest.fixture
def palette(blender):
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    return blender.context.scene.spectral.palette


def test_an_impossible_color_is_named_drawn_and_replaced_by_the_nearest(blender, palette) -> None:
    palette.active_row, palette.active_column = 0, 1
    cell = palette.materials[0].cells[1]
    palette.materials[0].cells[0].mode = "FIXED"
    palette.materials[0].cells[0].exact = True
    cell.mode, cell.target = "FIXED", (0.0, 1.0, 0.0)
    blender.ops.spectral.palette_possible()
    answer = palette.possible
    assert not answer.reachable
    assert "Not possible" in answer.words
    assert "In the way: the exact color under" in answer.words
    picture = picture_of(blender.context.scene)
    assert picture.shape[2] == 4
    assert np.isfinite(picture).all()
    blender.ops.spectral.palette_take_nearest()
    blender.ops.spectral.palette_possible()
    assert "Possible." in palette.possible.words or "ΔE 0." in palette.possible.words
    with pytest.raises(RuntimeError, match="no cell is selected"):
        blender.ops.spectral.palette_clear()
        blender.ops.spectral.palette_possible()


def test_nothing_to_take_is_said(blender, palette) -> None:
    with pytest.raises(RuntimeError, match="nothing was asked yet"):
        blender.ops.spectral.palette_take_nearest()
