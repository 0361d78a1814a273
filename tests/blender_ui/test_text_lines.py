# SPDX-License-Identifier: GPL-3.0-or-later
"""Wrapped text fills the width of a panel, and no line is wider."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")
import blf  # noqa: E402

TEXT = (
    "“Mark” under “Sodium” misses its color by ΔE 26.8, and no single cell is to blame: choose another color or light."
)


@pytest.mark.parametrize("room", [130.0, 171.0, 260.0, 900.0])
def test_lines_are_as_wide_as_the_panel_and_no_wider(room: float) -> None:
    from blender_addon.drawing.text import lines_in

    lines = lines_in(TEXT, room, SimpleNamespace(preferences=None))
    blf.size(0, 11.0)
    assert " ".join(lines) == TEXT
    assert max(blf.dimensions(0, line)[0] for line in lines) <= room + 2
    for line, following in pairwise(lines):
        assert blf.dimensions(0, f"{line} {following.split()[0]}")[0] > room - 4  # the next word had no room


def test_a_word_longer_than_a_line_is_divided() -> None:
    from blender_addon.drawing.text import lines_in

    lines = lines_in(f"at {'long' * 40} end", 150.0, SimpleNamespace(preferences=None))
    assert "".join(lines).replace(" ", "") == f"at{'long' * 40}end" and len(lines) > 4
    assert lines_in("", 150.0, SimpleNamespace(preferences=None)) == []
