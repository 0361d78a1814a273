# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws every panel and makes a live edit in a Blender with a window.

SPECTRAL_REAL_BLENDER holds the start of the command (``"xvfb-run blender"``; the script and its arguments follow),
SPECTRAL_PATHS the folders with numpy-only dependencies for that Blender's Python (scipy, daqp, piqp).
"""

from __future__ import annotations

import json
import os
import shlex
import subprocess
from pathlib import Path

import numpy as np
import pytest

COMMAND = os.environ.get("SPECTRAL_REAL_BLENDER", "")
HERE = Path(__file__).resolve().parent


@pytest.mark.slow
@pytest.mark.real_blender
@pytest.mark.skipif(not COMMAND, reason="needs a Blender with a window in SPECTRAL_REAL_BLENDER")
def test_every_panel_is_drawn_and_a_live_edit_is_solved():
    paths = os.pathsep.join([str(HERE.parents[1]), os.environ.get("SPECTRAL_PATHS", "")])
    command = [*shlex.split(COMMAND), "--factory-startup", "--python", str(HERE / "window_drive.py")]
    done = subprocess.run(
        command, env={**os.environ, "SPECTRAL_PATHS": paths}, capture_output=True, text=True, timeout=280, check=False
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    assert lines, f"no result; the end of the output: {(done.stdout + done.stderr)[-2000:]}"
    result = json.loads(lines[-1].removeprefix("RESULT "))
    assert result["errors"] == []
    assert len(result["drawn"]) == result["panels"] >= 24
    assert "rna_ui" not in done.stdout + done.stderr  # Blender's message for a property that does not exist
    assert result["waits_for_timer"]
    assert np.abs(np.subtract(result["after"], result["before"])).max() > 1e-3
    assert np.abs(np.subtract(result["target_after_undo"], (0.9, 0.7, 0.5))).max() > 1e-2
    assert result["error_after_undo"] < 1e-2
    assert result["status"] != "solved"
    assert result["conflicts"] > 0
