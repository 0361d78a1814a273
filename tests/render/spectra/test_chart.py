# SPDX-License-Identifier: GPL-3.0-or-later
"""Designed colors are rendered colors."""

from __future__ import annotations

import pytest

pytest.importorskip("mitsuba")


def test_a_designed_chart_renders_as_designed():
    from benchmarks.render.render_chart import chart_errors, designed_chart

    solution = designed_chart(seed=11)
    assert solution.status.usable
    for light in range(3):
        errors, _ = chart_errors(solution, light, 512)
        assert errors.mean() < 0.3 and errors.max() < 1.0
