# SPDX-License-Identifier: GPL-3.0-or-later
"""What a plot of the cost curve needs is asked for before the measurement, which takes minutes."""

from __future__ import annotations

from pathlib import Path

import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.render.cost.figure import require_drawable


def test_a_wrong_axis_of_the_plot_is_refused_before_the_measurement(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    require_drawable(tmp_path / "cost.png", "bounces")
    with pytest.raises(InvalidInputError, match="no axis is named 'colors'"):
        require_drawable(tmp_path / "cost.png", "colors")
