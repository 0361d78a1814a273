# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl-C while the script `spectral-scene` imports its modules."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("module", ["spectral_core.cli", "argparse", "spectral_core.explore.sweep.document"])
def test_ctrl_c_while_the_script_imports_its_modules_is_one_line(module: str) -> None:
    """In its first tenths of a second `spectral-scene` ended in a traceback."""
    code = (
        "import sys\nclass Stop:\n    def find_spec(self, name, *rest):\n"
        f"        if name == {module!r}: raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Stop())\n"
        "from blender_addon.commands import main\nsys.exit(main(['sweep', 'no.toml']))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, timeout=200)
    assert (done.returncode, done.stderr) == (130, "stopped\n")
