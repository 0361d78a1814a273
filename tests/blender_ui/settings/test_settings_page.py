# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/settings.md: every setting that a panel draws, and every operator, as the extension declares them."""

from __future__ import annotations

import ast
import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

pytest.importorskip("bpy")

ROOT = Path(__file__).parents[3]


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
    ours = drawn & told.keys()  # the others are settings of Blender or Cycles, which the panels show as well
    assert len(ours) > 100
    assert [name for name in ours if not any(text in page for text in told[name])] == []


def test_a_script_reaches_every_setting_by_its_place_and_name(writer: ModuleType) -> None:
    """The page had labels only; a script needs ``catalogue_name`` for Name and ``CATALOGUE`` for Named."""
    import bpy

    scene = bpy.context.scene.spectral
    scene.palette.lights.add()
    scene.palette.materials.add().cells.add()
    scene.palette.materials[0].dyes.add()
    for listed in (scene.dial.bulbs, scene.board.bindings, scene.sweep.parameters, scene.texture.wanted_colors):
        listed.add()
    material, volume = bpy.data.materials.new("m"), bpy.data.volumes.new("v")
    material.spectral.dyes.add()
    volume.spectral.materials.add()
    found, owner = 0, None
    for line in writer.page().partition("## Operators")[0].splitlines():
        if line.startswith("In Python: "):
            owner = eval(line.split("`")[1], {"bpy": bpy, "material": material, "volume": volume})
        elif line.startswith("| ") and "| in Python |" not in line:
            assert line.split(" | ")[1].strip("`") in owner.bl_rna.properties, line
            found += 1
    assert found > 150
    material.spectral.source, material.spectral.catalogue_name = "CATALOGUE", "dark skin"
