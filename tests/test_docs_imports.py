# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python code of the pages runs, because a reader copies these lines; its imports exist where it needs more."""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
NEED_MORE = {
    "volume_files.md": "files of the reader's own",
}
"""Pages whose code cannot run as it stands, and what it needs."""
OURS = ("spectral_core", "blender_addon", "benchmarks", "examples")


def blocks_of(page: Path) -> list[str]:
    """The Python blocks of a page."""
    return re.findall(r"```python\n(.*?)```", page.read_text("utf-8"), flags=re.DOTALL)


def imports_of(page: Path) -> list[tuple[str, str | None]]:
    """(module, name) of every import of this project in the Python blocks of a page."""
    found: list[tuple[str, str | None]] = []
    for block in blocks_of(page):
        lines = [line for line in block.splitlines() if line.startswith(("import ", "from "))]
        for node in ast.walk(ast.parse("\n".join(lines))):
            if isinstance(node, ast.ImportFrom) and node.module is not None:
                found += [(node.module, alias.name) for alias in node.names]
            elif isinstance(node, ast.Import):
                found += [(alias.name, None) for alias in node.names]
    return [(module, name) for module, name in found if module.split(".")[0] in OURS]


def test_pages_have_imports() -> None:
    assert sum(len(imports_of(page)) for page in PAGES) > 20


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_import_of_a_page_works(page: Path) -> None:
    for module, name in imports_of(page):
        if module.startswith("blender_addon"):
            pytest.importorskip("bpy")
        found = importlib.import_module(module)
        if name is not None and not hasattr(found, name):
            importlib.import_module(f"{module}.{name}")


RUN = [
    page for page in PAGES
    if page.name not in NEED_MORE and any("bpy" not in block and "mitsuba" not in block for block in blocks_of(page))
]  # fmt: skip


@pytest.mark.parametrize("page", RUN, ids=lambda page: page.name)
def test_the_code_of_a_page_runs(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if page.name in ("volume.md", "render.md", "plan_and_cost.md"):
        pytest.importorskip("mitsuba")
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}  # a later block of a page uses what an earlier one has made
    for block in blocks_of(page):
        if "bpy" not in block and "mitsuba" not in block:
            exec(compile(block, page.name, "exec"), names)
