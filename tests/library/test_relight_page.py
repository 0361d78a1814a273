# SPDX-License-Identifier: GPL-3.0-or-later
"""The example without Blender of docs/relight.md, as it is printed."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from benchmarks import ROOT

pytest.importorskip("mitsuba")
pytest.importorskip("OpenEXR")


def test_the_example_without_blender_records_and_mixes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (ROOT / "docs" / "relight.md").read_text("utf-8")
    (text,) = [block for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "record_transport" in block]
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(compile(text.replace("size=96", "size=16"), "relight.md", "exec"), names)
    assert (tmp_path / "night.png").is_file() and (tmp_path / "corner.transport.exr").is_file()
    night, picture = np.asarray(names["night"]), np.asarray(names["picture"])
    assert night.shape == picture.shape == (16, 16, 4)
    assert night[..., 0].mean() > 2 * night[..., 2].mean()  # sodium is red, where the fill light is white
