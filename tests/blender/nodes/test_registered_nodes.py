# SPDX-License-Identifier: GPL-3.0-or-later
"""The translation alone imports every module that registers nodes: other tests import some of them, and hide a lack."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("bpy")

ADD_ON = Path(__file__).parents[3] / "blender_addon"


def registering() -> set[str]:
    """Modules of the extension that register how a node is read."""
    files = (path for path in (ADD_ON / "translate").rglob("*.py") if "\n@evaluator(" in path.read_text("utf-8"))
    return {".".join(path.relative_to(ADD_ON.parent).with_suffix("").parts) for path in files}


def test_the_translation_imports_all_modules_of_nodes():
    code = "import bpy, sys, blender_addon.translate.scene; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ADD_ON.parent)
    assert done.returncode == 0, done.stderr
    assert len(registering()) > 5
    assert registering() - set(done.stdout.split()) == set()
