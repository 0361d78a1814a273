# SPDX-License-Identifier: GPL-3.0-or-later
"""The tree: folders with at most 15 Python files, files with fewer than 300 lines."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("spectral_core", "blender_addon", "benchmarks", "examples", "scripts")
MOST_FILES, MOST_LINES = 15, 300


def sources(*folders: str) -> list[Path]:
    return [path for folder in folders for path in (ROOT / folder).rglob("*.py") if "__pycache__" not in path.parts]


@pytest.mark.parametrize("package", PACKAGES)
def test_no_folder_has_too_many_files(package: str) -> None:
    """A folder with more than 15 files contains an idea that should have a separate folder."""
    counts: dict[str, int] = {}
    for path in sources(package):
        if path.name != "__init__.py":
            counts[str(path.parent.relative_to(ROOT))] = counts.get(str(path.parent.relative_to(ROOT)), 0) + 1
    assert {folder: count for folder, count in counts.items() if count > MOST_FILES} == {}


def test_no_file_is_long() -> None:
    lengths = {
        str(path.relative_to(ROOT)): len(path.read_text("utf-8").splitlines()) for path in sources(*PACKAGES, "tests")
    }
    assert {path: length for path, length in lengths.items() if length >= MOST_LINES} == {}
