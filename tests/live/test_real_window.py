# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendered mode in a Blender with a window: edits of each type, views, undo, and a killed renderer.

SPECTRAL_REAL_BLENDER and SPECTRAL_PATHS as in tests/blender_ui; the folders must hold Mitsuba and Dr.Jit for that
Blender's Python. Do not start the session in the repository's folder, which child processes do not trust.
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
def test_the_view_follows_every_edit_and_recovers(tmp_path):
    paths = os.pathsep.join([str(HERE.parents[1]), os.environ.get("SPECTRAL_PATHS", "")])
    command = [*shlex.split(COMMAND), "--factory-startup", "-p", "0", "0", "700", "500"]
    done = subprocess.run(
        [*command, "--python", str(HERE / "window_drive.py")],
        env={**os.environ, "SPECTRAL_PATHS": paths, "SPECTRAL_OUT": str(tmp_path)},
        cwd=HERE, capture_output=True, text=True, timeout=1500, check=False,
    )  # fmt: skip
    lines = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    assert lines, f"no result; the end of the output: {(done.stdout + done.stderr)[-2000:]}"
    result = json.loads(lines[-1].removeprefix("RESULT "))
    assert result["errors"] == []
    assert result["restarts"] >= 1
    assert result["steps"]["color"]["how"] == "materials"
    means = {name: step["mean"] for name, step in result["steps"].items()}
    assert means["lamp"] > means["roughness"]
