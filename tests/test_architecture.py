# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/architecture.md names files that exist: a reader begins there."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FROM_THE_ROOT = ("blender_addon/", "benchmarks/", "docs/")


def test_every_path_of_the_table_exists() -> None:
    page = (ROOT / "docs" / "architecture.md").read_text("utf-8")
    rows = [line for line in page.partition("## Where to find what")[2].splitlines() if line.startswith("| ")]
    paths = [path for path in re.findall(r"`([^` ]+/[^` ]*)`", "\n".join(rows)) if "NAME" not in path]
    places = {path: (ROOT if path.startswith(FROM_THE_ROOT) else ROOT / "spectral_core") / path for path in paths}

    assert len(places) > 50
    assert [path for path, place in places.items() if not place.exists()] == []
