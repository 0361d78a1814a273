# SPDX-License-Identifier: GPL-3.0-or-later
"""A video of a dial's path has the colors of its pictures in every player."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from spectral_core.cli import main
from spectral_core.render.relight.transport_file import write_transport
from spectral_core.spectra.color import display_rgb_from_linear
from tests.relight.test_page import transport_of

COLORS = np.array([[0.8, 0.02, 0.02], [0.02, 0.6, 0.02], [0.02, 0.02, 0.9], [0.6, 0.05, 0.6]])
"""Linear sRGB of four stripes."""
RED, BLUE = 0.2126, 0.0722
"""Shares of luma in ITU-R BT.709."""


def video(folder: Path, size: int = 16) -> Path:
    stripes = np.repeat(COLORS.T[:, None, :], size, axis=1).repeat(size, axis=2)
    write_transport(folder / "t.exr", transport_of(np.stack([0.5 * stripes, 0.5 * stripes])))
    path = folder / "walk.mp4"
    assert main(["relight", str(folder / "t.exr"), "--dial", "0,0;0,0", "--frames", "2", "--out", str(path)]) == 0
    return path


def test_a_video_is_made_and_marked_as_bt709(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Players take large videos without a mark as BT.709, and the numbers were those of BT.601."""
    program = tmp_path / "bin" / "ffmpeg"
    program.parent.mkdir()
    program.write_text(
        f'#!/bin/sh\nfor word; do echo "$word" >> {tmp_path}/words; last=$word; done\necho x > "$last"\n'
    )
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}:/usr/bin:/bin")
    video(tmp_path)
    words = (tmp_path / "words").read_text().splitlines()
    stated = {word: words[words.index(word) + 1] for word in words if word.startswith("-color")}
    assert stated["-colorspace"] == stated["-color_primaries"] == "bt709"
    assert (stated["-color_trc"], stated["-color_range"]) == ("iec61966-2-1", "tv")
    assert "scale=out_color_matrix=bt709:out_range=tv" in words[words.index("-vf") + 1].split(",")


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="no ffmpeg")
def test_a_video_decoded_by_bt709_has_the_colors_of_the_pictures(tmp_path: Path) -> None:
    """Saturated colors were off by up to 26 of 255."""
    path, size = video(tmp_path), 16
    raw = [
        "ffmpeg",
        "-loglevel",
        "error",
        "-i",
        str(path),
        "-frames:v",
        "1",
        "-f",
        "rawvideo",
        "-pix_fmt",
        "yuv444p",
        "-",
    ]
    planes = np.frombuffer(subprocess.run(raw, capture_output=True, check=True).stdout, np.uint8).reshape(3, size, -1)
    middle = planes[:, size // 2, size // 2 :: size].astype(float)
    luma, blue, red = (middle[0] - 16) / 219, (middle[1] - 128) / 224, (middle[2] - 128) / 224
    r, b = luma + 2 * (1 - RED) * red, luma + 2 * (1 - BLUE) * blue
    g = (luma - RED * r - BLUE * b) / (1 - RED - BLUE)
    assert np.abs(255 * (np.stack([r, g, b], axis=1) - display_rgb_from_linear(COLORS))).max() < 8
