# SPDX-License-Identifier: GPL-3.0-or-later
"""Press, drag and release on the dial in a Blender with a window.

SPECTRAL_REAL_BLENDER and SPECTRAL_PATHS as in tests/blender_ui; the folders must hold OpenEXR too. The Blender must
see the folder of temporary files.
"""

from __future__ import annotations

import json
import os
import shlex
import subprocess
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

COMMAND = os.environ.get("SPECTRAL_REAL_BLENDER", "")
HERE = Path(__file__).resolve().parent


@pytest.mark.slow
@pytest.mark.real_blender
@pytest.mark.skipif(not COMMAND, reason="needs a Blender with a window in SPECTRAL_REAL_BLENDER")
def test_the_mouse_moves_the_selector_and_the_picture_follows(tmp_path):
    paths = os.pathsep.join([str(HERE.parents[1]), os.environ.get("SPECTRAL_PATHS", "")])
    stage = {"SPECTRAL_PATHS": paths, "SPECTRAL_STAGE": str(tmp_path)}
    command = [*shlex.split(COMMAND), "--factory-startup", "--enable-event-simulate"]
    done = subprocess.run(
        [*command, "--python", str(HERE / "window_drive.py")],
        env={**os.environ, **stage}, capture_output=True, text=True, timeout=280, check=False,
    )  # fmt: skip
    lines = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    assert lines, f"no result; the end of the output: {(done.stdout + done.stderr)[-2000:]}"
    result = json.loads(lines[-1].removeprefix("RESULT "))
    assert result["errors"] == []
    assert "Traceback" not in done.stdout + done.stderr and "rna_ui" not in done.stdout + done.stderr
    assert np.abs(np.subtract(result["dragged"], result["start"])).max() > 0.01


@pytest.mark.slow
@pytest.mark.real_blender
@pytest.mark.skipif(not COMMAND, reason="needs a Blender with a window in SPECTRAL_REAL_BLENDER")
def test_record_as_a_button_leaves_nothing_behind(tmp_path):
    paths = os.pathsep.join([str(HERE.parents[1]), os.environ.get("SPECTRAL_PATHS", "")])
    command = [*shlex.split(COMMAND), "--factory-startup", "--enable-event-simulate"]
    done = subprocess.run(
        [*command, "--python", str(HERE / "record_drive.py")],
        env={**os.environ, "SPECTRAL_PATHS": paths}, cwd=tmp_path, capture_output=True, text=True, timeout=280,
        check=False,
    )  # fmt: skip
    lines = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    assert lines, f"no result; the end of the output: {(done.stdout + done.stderr)[-2000:]}"
    result = json.loads(lines[-1].removeprefix("RESULT "))
    assert result["errors"] == []
    before = result["before"]
    assert result["pressed"] == ["RUNNING_MODAL"]
    assert "is being recorded" in result["twice"]
    assert result["recorded"] == [True, 2, True, before]
    assert result["changes"] == ""
    assert result["stopped"] == ["unchanged", before]
    assert result["after an error"] == before
    assert result["again"] == ["", before]
    refused, *planned = result["plan"]
    assert "renders at present" in refused
    assert planned == [True, before]
    assert result["file"]
    assert result["during"] == [result["during"][0], True]
    assert result["walk"] == [False, True, True, True, True, False]
    assert result["frame"] == 1 and result["same"]
    assert result["long"] == [1, True]
    assert result["here"] == ["write_picture"]  # the one of the script
    words = ("being recorded", "recorded", "stopped", "camera", "recorded", "renders at present")
    assert [word in text for word, text in zip(words, result["reports"], strict=True)] == [True] * len(words)
