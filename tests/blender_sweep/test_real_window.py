# SPDX-License-Identifier: GPL-3.0-or-later
"""Add three numbers by the context menu, run, open and apply in a Blender with a window.

SPECTRAL_REAL_BLENDER is a command that runs Blender; SPECTRAL_PATHS holds folders with Mitsuba, SciPy and OpenEXR for
its Python. The Blender must see the folder of temporary files.
"""

from __future__ import annotations

import json
import os
import shlex
import subprocess
from pathlib import Path

import pytest

COMMAND = os.environ.get("SPECTRAL_REAL_BLENDER", "")
HERE = Path(__file__).resolve().parent


@pytest.mark.slow
@pytest.mark.real_blender
@pytest.mark.skipif(not COMMAND, reason="needs a Blender with a window in SPECTRAL_REAL_BLENDER")
def test_a_sweep_in_a_window(tmp_path: Path) -> None:
    paths = os.pathsep.join([str(HERE.parents[1]), os.environ.get("SPECTRAL_PATHS", "")])
    done = subprocess.run(
        [*shlex.split(COMMAND), "--factory-startup", "--python", str(HERE / "window_drive.py")],
        env={**os.environ, "SPECTRAL_PATHS": paths, "SPECTRAL_FOLDER": str(tmp_path)},
        capture_output=True, text=True, timeout=280, check=False,
    )  # fmt: skip
    lines = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    assert lines, f"no result; the end of the output: {(done.stdout + done.stderr)[-2000:]}"
    result = json.loads(lines[-1].removeprefix("RESULT "))
    assert result["errors"] == []
    assert (result["rows"], result["applied"], result["address"]) == (4, True, True)
