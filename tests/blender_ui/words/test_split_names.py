# SPDX-License-Identifier: GPL-3.0-or-later
"""The names of the sides of a split view are beside the tools and the sidebar, and apart from each other."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

pytest.importorskip("bpy")

from blender_addon.drawing import split
from blender_addon.drawing.covered import Covered
from blender_addon.drawing.split import name_spots


@pytest.mark.parametrize("middle", [0, 5, 150, 300, 420, 599, 600])
@pytest.mark.parametrize("ends", [(0, 600), (0, 350), (58, 350), (250, 600)])
@pytest.mark.parametrize("widths", [(60.0, 60.0), (130.0, 20.0), (20.0, 130.0)])
def test_names_are_visible_and_apart(middle: int, ends: tuple[int, int], widths: tuple[float, float]) -> None:
    """The name at the right of a quad view lay under the sidebar."""
    spots = name_spots(middle, ends, widths, 1.0)
    for (start, _), width in zip(spots, widths, strict=True):
        assert ends[0] < start
        assert start + width < ends[1]
    (left, low), (right, high) = spots
    assert high - low >= 20 or left + widths[0] < right


def test_names_with_room_are_beside_the_divider() -> None:
    (left, low), (right, high) = name_spots(300, (0, 600), (60.0, 40.0), 1.0)
    assert left + 60 < 300 < right
    assert low == high


def test_a_name_without_room_is_shortened(monkeypatch: pytest.MonkeyPatch) -> None:
    """A long name beside the divider of a narrow view ended below the sidebar."""
    import blf

    written: list[str] = []
    monkeypatch.setattr(blf, "dimensions", lambda _font, text: (7.0 * len(text), 12.0))
    monkeypatch.setattr(split, "draw_line", lambda *_: None)
    monkeypatch.setattr(split, "draw_triangles", lambda *_: None)
    monkeypatch.setattr(split, "write", lambda text, x, _y, _color: written.append(text) or ends.append(x))
    ends: list[float] = []
    known, region = Covered(left=60, right=300), SimpleNamespace(width=500, height=400)
    split.draw_divider(250, region, ("blackbody 3200 of the long corridor", "HP1"), 1.0, known)
    assert written[1] == "HP1"
    assert "…" in written[0]
    assert all(x >= 60 and x + 7.0 * len(text) <= 200 for text, x in zip(written, ends, strict=True))
