# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python code of docs/relight.md runs, and the dial's geometry is correct."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.drawing.dial_shape import DialShape, Target, snapped, tooltip

PAGE = Path(__file__).parents[2] / "docs" / "relight.md"
BULBS = [(0.0, 1.0), (0.9, -0.5), (-0.9, -0.5)]


def test_the_examples_for_blender_run(stage):
    pytest.importorskip("mitsuba")
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), flags=re.S)
    code = "\n".join(block for block in blocks if "record_transport" not in block)  # that one needs no Blender
    assert "bpy" in code
    exec(code, {})
    assert (Path(__import__("bpy").data.filepath).parent / "first_light.png").is_file()


def test_every_picture_of_the_page_exists():
    pictures = re.findall(r"\]\((pictures/[^)]+)\)", PAGE.read_text("utf-8"))
    assert pictures and all((PAGE.parent / picture).is_file() for picture in pictures)


def test_the_item_under_the_mouse():
    shape = DialShape.in_region(1200, 800, left=50)
    for index, place in enumerate(BULBS):
        assert shape.target(shape.pixels(place), (0, 0), BULBS) == Target("bulb", index)
    assert shape.target(shape.pixels((0, 0)), (0, 0), BULBS) == Target("selector")
    assert shape.target(shape.pixels((0.5, 0.5)), (0, 0), BULBS) == Target("disc")
    assert shape.target((1190, 790), (0, 0), BULBS) is None
    # a selector on a bulb leaves a ring of the bulb that can be clicked
    beside = np.add(shape.pixels(BULBS[0]), (11, 0))
    assert shape.target(beside, BULBS[0], BULBS) == Target("bulb", 0)
    np.testing.assert_allclose(shape.place(shape.pixels((0.3, -0.7))), (0.3, -0.7), atol=1e-12)
    assert shape.x - 1.25 * shape.unit > 50


def test_snapping_prefers_bulbs_then_midpoints_then_the_grid():
    np.testing.assert_allclose(snapped((0.86, -0.45), BULBS), (0.9, -0.5))
    np.testing.assert_allclose(snapped((0.02, -0.46), BULBS), (0.0, -0.5))
    np.testing.assert_allclose(snapped((0.05, 0.05), BULBS), (0.0, 0.0))
    np.testing.assert_allclose(snapped((0.55, 0.7), BULBS), (0.5, 0.75))
    assert np.hypot(*snapped((0.88, 0.88), BULBS)) <= 1.25 + 1e-9  # the grid point (1, 1) is beyond the rim


def test_the_tooltip_lists_shares_in_descending_order_and_warns_if_all_are_off():
    assert tooltip(["Key", ""], [0.25, 0.75], 2.0) == ["ungrouped: 75.0 %, × 1.500", "Key: 25.0 %, × 0.500"]
    assert "All bulbs are off" in tooltip(["Key"], [0.0], 1.0)[0]
    nearly = [0.25 + error for error in (0.0, 3e-17, 6e-17, -6e-17)]  # their last digits shuffled the lines
    assert [line[0] for line in tooltip("abcd", nearly, 4.0)] == list("abcd")
