# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/settings.md: every setting that a panel draws, and every operator, as the extension declares them."""

from __future__ import annotations

import ast
import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

pytest.importorskip("bpy")

ROOT = Path(__file__).parents[2]
BLENDERS_OWN = {"denoising_store_passes", "is_portal", "is_shadow_catcher", "lightgroup", "pass_alpha_threshold",
                "pass_debug_sample_count", "spread", "use_pass_emit", "use_pass_environment", "use_pass_volume_direct",
                "use_pass_volume_indirect", "use_shadow"}  # fmt: skip


@pytest.fixture
def writer(registered) -> ModuleType:
    spec = importlib.util.spec_from_file_location("settings_page", ROOT / "scripts" / "settings_page.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_states_what_is_declared(writer: ModuleType) -> None:
    """Where this fails, run ``python scripts/settings_page.py``."""
    assert writer.PAGE.read_text("utf-8") == writer.page()


def test_every_setting_and_operator_has_a_tooltip(writer: ModuleType) -> None:
    rows = [row.split(" | ") for row in writer.page().splitlines() if row.startswith("| ") and "setting |" not in row]
    assert len(rows) > 200
    assert [row for row in rows if not row[-1].strip("| ")] == []


def test_every_setting_that_a_panel_draws_is_on_the_page(writer: ModuleType) -> None:
    """The names in calls of ``prop`` are counted here without the writer, which reads all texts of a panel."""
    import bpy

    page = writer.page()
    drawn: set[str] = set()
    for file in (ROOT / "blender_addon" / "panels").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if (
                isinstance(node, ast.Call)
                and isinstance(node.func, ast.Attribute)
                and node.func.attr.startswith("prop")
            ):
                drawn |= {word.value for word in node.args[1:2] if isinstance(word, ast.Constant)}
    told: dict[str, set[str]] = {}
    for kind in bpy.types.PropertyGroup.__subclasses__():
        for prop in kind.bl_rna.properties if kind.__name__.startswith("Spectral") else ():
            told.setdefault(prop.identifier, set()).add(prop.description)
    assert len(drawn) > 100
    assert [name for name in drawn - BLENDERS_OWN if not any(text in page for text in told[name])] == []
