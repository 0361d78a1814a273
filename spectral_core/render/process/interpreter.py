# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python interpreter in which render processes run."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import cache
from pathlib import Path

from spectral_core import child
from spectral_core.errors import RenderError


@cache
def find_python() -> str:
    """An interpreter of the same version: inside Blender, ``sys.executable`` may be Blender itself.

    ``SPECTRAL_SCENE_PYTHON`` has precedence. Raises RenderError that names the candidates.
    """
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    places = [os.environ.get("SPECTRAL_SCENE_PYTHON"), sys.executable, getattr(sys, "_base_executable", None)]
    for prefix in dict.fromkeys((sys.prefix, sys.exec_prefix, sys.base_prefix)):
        places += [f"{prefix}/bin/python{version}", f"{prefix}/bin/python3", f"{prefix}/bin/python.exe"]
        places += [f"{prefix}/python.exe"]
    tried = [place for place in dict.fromkeys(places) if place and Path(place).is_file()]
    for place in tried:
        if "python" in Path(place).name.lower() and _version_of(place) == version:
            return place
    raise RenderError(
        f"no Python {version} was found to run the render process with (tried {', '.join(tried) or 'nothing'}); "
        "name one in the environment variable SPECTRAL_SCENE_PYTHON"
    )


def _version_of(python: str) -> str | None:
    code = "import sys; print(f'{sys.version_info.major}.{sys.version_info.minor}')"
    try:
        answer = subprocess.run([python, *child.ISOLATED, "-c", code], capture_output=True, text=True, timeout=20)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return answer.stdout.strip() or None
