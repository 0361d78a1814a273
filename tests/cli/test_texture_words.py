# SPDX-License-Identifier: GPL-3.0-or-later
"""What ``texture`` prints: colors as an artist writes them, observers by their names."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from spectral_core.cli import main
from spectral_core.spectra.pictures import write_picture


def test_a_wanted_color_that_cannot_be_reached_is_answered_by_one_that_can(tmp_path: Path, capsys) -> None:
    picture = tmp_path / "flat.png"
    write_picture(picture, np.full((4, 4, 3), 0.2))
    words = ["texture", str(picture), "--light", "D65", "--light", "HP1", "--out", str(tmp_path / "out")]
    assert main([*words, "--want", "#a02020", "#2020ff"]) == 0  # sodium light shows no blue
    printed = capsys.readouterr().out
    found = re.search(r"the nearest color that these spectra can show is #([0-9a-f]{6})\n", printed)
    assert found, printed
    red, _, blue = (int(found[1][i : i + 2], 16) for i in (0, 2, 4))
    assert red > blue


def test_observers_have_their_names(tmp_path: Path, capsys) -> None:
    for name in ("one.png", "two.png"):
        write_picture(tmp_path / name, np.full((4, 4, 3), 0.2))
    assert main(["texture", str(tmp_path / "one.png"), str(tmp_path / "two.png"), "--out", str(tmp_path / "out")]) == 0
    assert "CIE 1964 10°: " in capsys.readouterr().out
