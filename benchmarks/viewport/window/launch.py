# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs a script of this folder in a Blender with a window, and reads what it tells.

SPECTRAL_REAL_BLENDER is a command that runs Blender with a window when its arguments follow, SPECTRAL_PATHS holds
folders for its Python with Mitsuba, Dr.Jit, SciPy and OpenEXR (an installed extension's site-packages).
"""

from __future__ import annotations

import json
import os
import shlex
import subprocess
from pathlib import Path
from typing import Any

from benchmarks import ROOT, Options
from spectral_core.errors import UnknownNameError

MISSING = "SPECTRAL_REAL_BLENDER names no Blender with a window"


def has_window() -> bool:
    """True if a Blender with a window is named."""
    return bool(os.environ.get("SPECTRAL_REAL_BLENDER"))


def told_by(script: str, settings: dict[str, Any], options: Options, size: tuple[int, int]) -> dict[str, Any]:
    """What ``script`` tells; it reads ``settings`` and gets a window of ``size`` pixels.

    Raises UnknownNameError if it tells nothing.
    """
    options.out.mkdir(parents=True, exist_ok=True)
    command = shlex.split(os.environ["SPECTRAL_REAL_BLENDER"])
    command += ["--python-exit-code", "1"]  # a script that cannot start ends Blender
    place = ["-p", "0", "0", *map(str, size)]
    done = subprocess.run(
        [*command, "--factory-startup", *place, "--python", str(Path(__file__).with_name(script))],
        env={**os.environ, "SPECTRAL_PATHS": os.pathsep.join([str(ROOT), os.environ.get("SPECTRAL_PATHS", "")]),
             "SPECTRAL_SETTINGS": json.dumps(settings)},
        cwd=options.out, stdout=subprocess.PIPE, text=True, check=False,
    )  # fmt: skip
    lines = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    if not lines:
        raise UnknownNameError(f"Blender told no result; its output ends with: {done.stdout[-1500:]}")
    told: dict[str, Any] = json.loads(lines[-1].removeprefix("RESULT "))
    return told
