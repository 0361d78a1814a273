# SPDX-License-Identifier: GPL-3.0-or-later
"""The shipped zip in a real Blender: ``make real-blender BLENDER="path/to/launcher VERSION --"``.

``BLENDER`` is any command that runs Blender with the arguments after it and can read this checkout at its path.
"""

from __future__ import annotations

import os
import shlex
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.real_blender


@pytest.fixture(scope="module")
def blender() -> list[str]:
    command = os.environ.get("BLENDER")
    if not command:
        pytest.skip('set BLENDER to a command that runs Blender, such as BLENDER="/opt/blender/blender"')
    return shlex.split(command)


def run(command: list[str]) -> str:
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, timeout=280)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout + done.stderr


def test_zip_installs_and_renders(blender: list[str]) -> None:
    """Blender's command installs and enables the zip, which designs a palette and renders the default scene."""
    (package,) = (ROOT / "dist").glob("spectral_scene-*.zip")
    run([*blender, "--command", "extension", "install-file", "-r", "user_default", "-e", str(package)])
    out = run([*blender, "-b", "--python", str(ROOT / "tests/real_blender/drive.py")])

    assert "STATUS solved" in out
    assert "RENDERED {'FINISHED'}" in out


def test_every_setting_of_this_blender_is_in_the_ledger(blender: list[str]) -> None:
    out = run([*blender, "-b", "--python", str(ROOT / "tests/blender/ledger_walk.py")])
    (line,) = [each for each in out.splitlines() if each.startswith("MISSING")]
    assert line == "MISSING {}"


def test_settings_of_newer_blenders_are_read_or_get_a_note(blender: list[str]) -> None:
    out = run([*blender, "-b", "--python", str(ROOT / "tests/real_blender/newer_settings.py")])
    assert "ALL TRIED" in out
    assert " False" not in out
