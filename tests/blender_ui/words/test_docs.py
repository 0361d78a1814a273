# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python code of docs/palette_in_blender.md runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

pytest.importorskip("bpy")

PAGE = Path(__file__).parents[3] / "docs" / "palette_in_blender.md"


def test_the_example_of_the_page_runs(blender, capsys):
    code = "\n".join(re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), flags=re.S))
    assert "palette_apply" in code
    exec(code, {})
    assert capsys.readouterr().out.startswith(("solved ", "compromise "))
    assert blender.data.materials["mark"].spectral.source == "DESIGNED"


def test_every_picture_of_the_page_exists():
    pictures = re.findall(r"\]\((pictures/[^)]+)\)", PAGE.read_text("utf-8"))
    assert len(pictures) == 5
    assert all((PAGE.parent / picture).stat().st_size < 300_000 for picture in pictures)
