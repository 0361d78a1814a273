# SPDX-License-Identifier: GPL-3.0-or-later
"""Every control of a panel exists in Blender, has a tooltip, and is used by a test in this folder."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

import pytest

pytest.importorskip("bpy")

import blender_addon
from blender_addon import interface

PANELS = Path(blender_addon.__file__).parent / "panels"
TESTS = Path(__file__).parent
FILES = sorted(PANELS.rglob("*.py"))
CALLS = [
    node
    for file in FILES
    for node in ast.walk(ast.parse(file.read_text("utf-8")))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
]


def constants(method: str, position: int) -> list[str]:
    """String constants at one argument position in all calls of a layout method in the panels."""
    found = [node.args[position] for node in CALLS if node.func.attr == method and len(node.args) > position]
    return sorted({node.value for node in found if isinstance(node, ast.Constant) and isinstance(node.value, str)})


SHOWN_PROPERTIES = constants("prop", 1)
SHOWN_OPERATORS = sorted(
    {name for method in ("operator", "operator_menu_enum", "operator_enum") for name in constants(method, 0)}
)


@pytest.fixture
def groups(registered):
    """All property groups of the extension, as RNA."""
    return [cls.bl_rna for module in interface.modules_of("properties") for cls in module.CLASSES]


def settings_of_blender():
    """Settings of Blender and Cycles in the panels of passes, objects and lamps."""
    import bpy

    lamp = bpy.data.lights.new("Any", "AREA")
    owners = (bpy.context.view_layer, bpy.context.view_layer.cycles, lamp, lamp.cycles)
    return [bpy.types.Object.bl_rna, *(type(each).bl_rna for each in owners)]


@cache
def text_of_tests() -> str:
    files = [file for folder in TESTS.parent.glob("blender*") for file in folder.rglob("test_*.py")]
    return "\n".join(file.read_text("utf-8") for file in files if file != Path(__file__))


def test_the_panels_were_read():
    assert len(SHOWN_PROPERTIES) > 35
    assert len(SHOWN_OPERATORS) > 15


@pytest.mark.parametrize("name", SHOWN_PROPERTIES)
def test_each_property_exists_has_a_label_and_is_tested(groups, name):
    found = [rna.properties[name] for rna in (*groups, *settings_of_blender()) if name in rna.properties]
    assert found, f"no property group has {name!r}"
    assert all(prop.name for prop in found)
    assert re.search(rf"\b{name}\b", text_of_tests()), f"no test drives {name!r}"


@pytest.mark.parametrize("name", SHOWN_OPERATORS)
def test_each_operator_exists_has_a_tooltip_and_is_tested(registered, name):
    operator = getattr(registered.ops.spectral, name.removeprefix("spectral."))
    rna = operator.get_rna_type()
    assert len(rna.description) > 15
    cls = getattr(registered.types, operator.idname())
    assert callable(getattr(cls, "execute", None)), "or a base class"
    assert re.search(rf"spectral\.{name.removeprefix('spectral.')}\b", text_of_tests()), f"no test calls {name!r}"


def test_every_control_of_the_palette_has_a_tooltip(groups):
    for rna in groups:
        for prop in rna.properties:
            if prop.identifier in SHOWN_PROPERTIES and prop.identifier != "name" and prop.type != "COLLECTION":
                assert prop.description, f"{rna.identifier}.{prop.identifier} has no tooltip"


def test_icons_of_the_panels_exist(registered):
    known = set(registered.types.UILayout.bl_rna.functions["prop"].parameters["icon"].enum_items.keys())
    used = {
        keyword.value.value
        for node in CALLS
        for keyword in node.keywords
        if keyword.arg == "icon" and isinstance(keyword.value, ast.Constant)
    }
    from blender_addon.panels.palette import STATUS
    from blender_addon.properties.palette.cell import MODES
    from blender_addon.properties.palette.table import DESIGN

    used |= {icon for icon, _ in STATUS.values()} | {item[3] for item in (*MODES, *DESIGN)}
    assert used <= known


def test_enum_items_have_explicit_numbers(groups):
    """Files store an item's number. Without explicit numbers, a new item would change the meaning of saved files."""
    for file in (PANELS.parent / "properties").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "EnumProperty":
                items = next(keyword.value for keyword in node.keywords if keyword.arg == "items")
                if isinstance(items, ast.List):
                    assert all(isinstance(item.elts[-1].value, int) for item in items.elts)


def test_registering_twice_leaves_no_classes_behind(blender):
    before = set(dir(blender.types))
    blender_addon.unregister()
    try:
        assert not hasattr(blender.types.Scene, "spectral")
        assert not hasattr(blender.types.Material, "spectral")
        assert not [name for name in dir(blender.types) if name.startswith("SPECTRAL_")]
    finally:
        blender_addon.register()
    assert set(dir(blender.types)) == before
    blender_addon.register_once()  # what a command does in a process where the extension is enabled: nothing
    assert set(dir(blender.types)) == before
