# SPDX-License-Identifier: GPL-3.0-or-later
"""The reader of a command's lines goes away, as ``| head -1`` does: files that took work are written all the same."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from spectral_core.spectra.pictures import png_bytes

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pipes as Unix has them")
CLI = [sys.executable, "-P", "-m", "spectral_core.cli"]


def first_line(words: list[str], folder: Path) -> bytes:
    """The first line of a command whose output is closed after it; waits for its end."""
    with subprocess.Popen([*CLI, *words], stdout=subprocess.PIPE, cwd=folder) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        process.stdout.close()
        assert process.wait(timeout=250) in (0, 141)
    return line


def test_a_texture_is_written(tmp_path: Path) -> None:
    ramp = np.linspace(20, 230, 12, dtype=np.uint8)
    for name, picture in (("a", ramp[None].repeat(12, 0)), ("b", ramp[:, None].repeat(12, 1))):
        (tmp_path / f"{name}.png").write_bytes(png_bytes(np.dstack([picture] * 3)))
    assert first_line(["texture", "a.png", "b.png", "--light", "D65", "--light", "HP1", "--out", "out"], tmp_path)
    assert {each.name for each in (tmp_path / "out").iterdir()} >= {"texture.exr", "lights.csv", "report.json"}


@pytest.mark.slow
def test_every_picture_of_a_volume_is_written(tmp_path: Path) -> None:
    pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")
    words = ["volume", "sample:shells:24", "--transfer", "wide", "--size", "16", "16", "--quality", "draft"]
    line = first_line([*words, "--light", "D65", "--light", "HP1", "--out", "picture.png"], tmp_path)
    assert b"steps" in line
    assert len(list(tmp_path.glob("picture_*.png"))) == 2


def test_an_error_of_unknown_origin_adds_no_line_to_the_output(tmp_path: Path) -> None:
    """Where the output is unbuffered, an empty line was written to learn whether the output was at fault."""
    script = (
        "import errno, sys\nfrom spectral_core.cli import lattice, main\n"
        "def fail(_given): raise OSError(errno.ENOSPC, 'No space left on device')\n"
        "lattice.run = fail\nsys.exit(main(['lattice']))"
    )
    done = subprocess.run(
        [sys.executable, "-u", "-c", script], capture_output=True, text=True, cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )  # fmt: skip

    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "spectral-scene lattice: No space left on device\n"
