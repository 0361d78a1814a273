# SPDX-License-Identifier: GPL-3.0-or-later
"""What ``texture`` prints: colors as an artist writes them, observers by their names."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

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


@pytest.mark.parametrize(
    ("pictures", "lights", "settings", "named"),
    [
        (
            1,
            True,
            "floor = 0.2\nimportance = 9.0\nled_width_nm = 40.0\nspectra = 6",
            "floor, importance, led_width_nm; one",
        ),
        (2, True, "daylight_share = 0.3\nfloor = 0.2", "daylight_share; both lights are given"),
        (2, True, "slope = 0.3\nmapping = 'uniform_contrast'", "slope; uniform_contrast"),
        (1, True, "spectra = 6", ""),
        (2, False, "daylight_share = 0.3\nfloor = 0.2\nimportance = 2.0", ""),
    ],
)
def test_settings_of_a_document_without_effect_are_noted(
    tmp_path: Path, capsys, pictures: int, lights: bool, settings: str, named: str
) -> None:
    """Options are refused there; settings counted for nothing in silence."""
    files = [f"{number}.png" for number in range(pictures)]
    for name in files:
        write_picture(tmp_path / name, np.full((4, 4, 3), 0.2))
    (tmp_path / "t.toml").write_text(
        f"format = 'spectral-scene texture'\nversion = 1\npictures = {files}\n"
        + ("lights = ['D65', 'FL11']\n" if lights else "")
        + f"[settings]\n{settings}\n"
    )
    assert main(["texture", str(tmp_path / "t.toml"), "--out", str(tmp_path / "out"), "--json"]) == 0
    printed = capsys.readouterr().out
    notes = re.findall(r"note: settings without effect: (.*)", printed)
    assert len(notes) == bool(named) and all(note.startswith(named) for note in notes)
    assert len(json.loads(printed.splitlines()[-1])["notes"]) == bool(named)
    assert lights or "CIE 1964 10°: " in printed  # an observer has its name
