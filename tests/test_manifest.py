# SPDX-License-Identifier: GPL-3.0-or-later
"""The manifest of the extension: its permissions are those that the code uses, each with a reason; versions agree."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
MANIFEST = tomllib.loads((ROOT / "blender_addon" / "blender_manifest.toml").read_text("utf-8"))
USES = {"clipboard": r"\.clipboard\b", "network": r"^\s*(import|from) (socket|socketserver|http|pythonosc)\b",
        "camera": r"\bVideoCapture\b", "microphone": r"\baud\.", "files": r"whole_file|write_text"}  # fmt: skip
"""Code that needs each permission of Blender."""


@pytest.mark.parametrize("permission", USES)
def test_permissions_are_those_that_the_code_uses(permission: str) -> None:
    sources = [
        path.read_text("utf-8") for name in ("blender_addon", "spectral_core") for path in (ROOT / name).rglob("*.py")
    ]
    is_used = any(re.search(USES[permission], text, re.MULTILINE) for text in sources)
    assert is_used == (permission in MANIFEST["permissions"])


def test_reasons_are_as_blender_accepts_them() -> None:
    for reason in MANIFEST["permissions"].values():
        assert 0 < len(reason) <= 64 and reason[-1].isalnum()
    assert len(MANIFEST["tagline"]) <= 64 and MANIFEST["tagline"][-1].isalnum()


def test_versions_agree() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    from spectral_core import __version__

    assert MANIFEST["version"] == project["version"] == __version__.partition("+")[0]
