# SPDX-License-Identifier: GPL-3.0-or-later
"""Durations in the status lines of renders and views."""

import pytest

pytest.importorskip("bpy")

from blender_addon.drawing.clock import clock


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.04, "0.0 s"), (59.94, "59.9 s"), (59.96, "1:00 min"), (119.97, "2:00 min"), (1962.04, "32:42 min"),
        (3599.7, "1:00:00 h"), (3909.0, "1:05:09 h"), (360_000.0, "100:00:00 h"),
    ],
)  # fmt: skip
def test_seconds_have_tenths_and_minutes_have_none(seconds, text):
    assert clock(seconds) == text


def test_time_left_has_no_tenths():
    assert [clock(each, digits=0) for each in (0.4, 59.4, 59.6, 61.2)] == ["0 s", "59 s", "1:00 min", "1:01 min"]
