# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawings over an editor begin beside Blender's bars and panels, and stay apart from each other."""

from __future__ import annotations

import sys
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("bpy")

from blender_addon.drawing import dial
from blender_addon.drawing.covered import Covered, covered, dial_beside
from blender_addon.drawing.dial_shape import DialShape, fitting, without_overlaps


def part(kind: str, alignment: str, x: int, y: int, width: int, height: int) -> Any:
    return SimpleNamespace(type=kind, alignment=alignment, x=x, y=y, width=width, height=height)


QUADS = [part("WINDOW", "NONE", x, y, 600, 400) for x in (100, 700) for y in (50, 450)]


def area(*bars: Any) -> Any:
    return SimpleNamespace(regions=[*bars, *QUADS])


def test_bars_cover_only_the_parts_of_a_quad_view_below_them() -> None:
    tools, sidebar = part("TOOLS", "LEFT", 100, 50, 58, 800), part("UI", "RIGHT", 1050, 50, 250, 800)
    assert [covered(area(tools, sidebar), each) for each in QUADS] == [
        Covered(left=58), Covered(left=58), Covered(right=250), Covered(right=250)
    ]  # fmt: skip
    flipped = part("TOOLS", "RIGHT", 1242, 50, 58, 800), part("UI", "LEFT", 100, 50, 250, 800)
    assert covered(area(*flipped), QUADS[0]) == Covered(left=250)
    assert covered(area(*flipped), QUADS[2]) == Covered(right=58)


def test_hidden_bars_and_those_beside_the_region_cover_nothing() -> None:
    hidden, beside = part("TOOLS", "LEFT", 100, 50, 1, 1), part("TOOLS", "LEFT", 42, 50, 58, 800)
    assert covered(area(hidden, beside), QUADS[0]) == Covered()


def test_the_dial_and_its_tooltip_are_above_the_bars_at_the_bottom_and_below_those_at_the_top(monkeypatch: Any) -> None:
    """In Sculpt Mode the asset shelf and a header at the bottom covered half of the dial, which no mouse reached."""
    header, shelf = part("HEADER", "BOTTOM", 100, 50, 1200, 27), part("ASSET_SHELF", "BOTTOM", 100, 77, 1200, 86)
    tools = part("TOOL_HEADER", "TOP", 100, 823, 1200, 27)
    assert [covered(area(header, shelf, tools), each) for each in QUADS] == [
        Covered(bottom=113), Covered(top=27), Covered(bottom=113), Covered(top=27)
    ]  # fmt: skip
    free, shelved = (dial_beside(area(*bars), QUADS[0], 1.0) for bars in ((), (header, shelf)))
    assert shelved.y - dial.DISC * shelved.unit >= 113 + free.y - dial.DISC * free.unit
    pen = SimpleNamespace(size=lambda *_: None, dimensions=lambda _font, text: (7.0 * len(text), 12.0))
    monkeypatch.setitem(sys.modules, "blf", pen)
    for count in (1, 9):
        plate = dial._tooltip_plate(shelved, ["a line"] * count, [], (0.0, 113.0, 600.0, 373.0))
        assert plate[1] >= 113 and plate[1] + plate[3] <= 373


@pytest.mark.parametrize(("height", "is_beside"), [(25, False), (200, True)])
def test_the_dial_is_beside_an_open_panel_of_the_last_operation(height: int, is_beside: bool) -> None:
    """The closed one is below the dial."""
    panel = part("HUD", "FLOAT", 163, 55, 300, height)
    tools = part("TOOLS", "LEFT", 100, 50, 58, 800)
    shape = dial_beside(area(tools, panel), QUADS[0], 1.0)
    assert (shape.left >= 363) is is_beside
    assert covered(area(tools, panel), QUADS[0]).panel == (363, height + 5)
    assert covered(area(tools, panel), QUADS[1]).panel == (0.0, 0.0)


def test_texts_that_overlap_give_way_to_the_larger_share() -> None:
    boxes = [(0.0, 0.0, 50.0, 10.0), (40.0, 5.0, 50.0, 10.0), (85.0, 0.0, 50.0, 10.0), (0.0, 10.0, 50.0, 10.0)]
    assert without_overlaps(boxes, (0, 1, 2, 3)) == {0, 2, 3}
    assert without_overlaps(boxes, (1, 0, 2, 3)) == {1}
    assert without_overlaps(boxes, (0, 1, 2, 3), [(90.0, 5.0, 2.0, 2.0)]) == {0, 3}


def test_lines_without_room_are_counted() -> None:
    assert fitting(["a", "b"], 2) == ["a", "b"]
    assert fitting(["a", "b", "c"], 2) == ["a", "and 2 more"]
    assert fitting(["a", "b", "c"], 0) == ["and 3 more"]
    assert fitting(["a"], 0) == ["a"]


@pytest.mark.parametrize("count", [3, 33])
def test_the_tooltip_is_within_the_editor(count: int) -> None:
    shape = DialShape.in_region(800.0, 640.0, left=60.0)
    left, low, width, height = dial._tooltip_plate(shape, ["a"] * count, [], (0.0, 0.0, 800.0, 640.0))
    assert low >= 0
    assert low + height <= 640
    assert left >= 0
    assert left + width <= 800


def test_the_tooltip_is_beyond_the_names_at_the_right() -> None:
    shape = DialShape.in_region(1200.0, 700.0, left=60.0)
    assert dial._tooltip_plate(shape, ["a"], [("name", 600.0, 90.0)], (0.0, 0.0, 1200.0, 700.0))[0] > 600.0


def test_the_tooltip_is_above_the_dial_in_a_narrow_editor() -> None:
    """It covered the bulb under the mouse."""
    shape = DialShape.in_region(420.0, 440.0, left=60.0)
    left, low, width, _ = dial._tooltip_plate(shape, ["a"] * 3, [], (0.0, 0.0, 300.0, 440.0))
    assert low >= shape.y + dial.DISC * shape.unit
    assert left + width <= 300


@pytest.mark.parametrize("scale", [1.0, 1.5, 2.0])
@pytest.mark.parametrize("room", [140.0, 200.0, 260.0, 330.0, 500.0])
def test_the_dial_is_beside_the_sidebar_of_a_narrow_view(room: float, scale: float) -> None:
    """Half of the dial was below the sidebar, where no mouse reached it."""
    tools, sidebar = 58.0 * scale, 292.0 * scale
    shape = DialShape.in_region(tools + room * scale + sidebar, 900.0, left=tools, right=sidebar, scale=scale)
    assert shape.x - dial.DISC * shape.unit >= tools
    assert shape.x + dial.DISC * shape.unit <= tools + room * scale
    assert shape.left >= tools and shape.end == tools + room * scale


def test_a_sidebar_with_room_for_the_dial_does_not_change_it() -> None:
    bare, beside = (DialShape.in_region(1200.0, 700.0, left=60.0, right=right) for right in (0.0, 292.0))
    assert (bare.x, bare.y, bare.unit) == (beside.x, beside.y, beside.unit)


@pytest.mark.parametrize("count", range(2, 25))
def test_equal_shares_read_alike(count):
    """Eight bulbs at the center read 12 % and 13 %, by the last digits of 0.125."""
    from blender_addon.drawing.dial_shape import percent
    from spectral_core.render.relight.dial import bulbs_on_polygon, dial_weights

    shown = {percent(share) for share in dial_weights((0.0, 0.0), bulbs_on_polygon(count))}
    assert shown == {f"{(200 + count) // (2 * count)} %"}  # halves are rounded up
