# SPDX-License-Identifier: GPL-3.0-or-later
"""Every test that docs/findings.md names exists."""

from __future__ import annotations

import ast
import re
from pathlib import Path

TESTS = Path(__file__).parent
PAGE = TESTS.parent / "docs" / "findings.md"


def test_every_named_test_exists() -> None:
    named = re.findall(r"`([\w/]+\.py)(?:::(\w+))?` \|$", PAGE.read_text("utf-8"), flags=re.MULTILINE)
    rows = [
        line for line in PAGE.read_text("utf-8").splitlines() if line.startswith("| ") and not line.startswith("| area")
    ]
    assert len(named) == len(rows) > 60
    missing = []
    for file, name in named:
        path = TESTS / file
        functions = (
            {node.name for node in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(node, ast.FunctionDef)}
            if path.is_file()
            else set()
        )
        if not functions or (name and name not in functions):
            missing.append(f"{file}::{name}")
    assert missing == []
