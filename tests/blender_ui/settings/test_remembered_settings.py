# SPDX-License-Identifier: GPL-3.0-or-later
"""What a button leaves unset has its default: Blender would fill it from the last run of the operator otherwise."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("bpy")

import blender_addon

FOLDER = Path(blender_addon.__file__).parent
BUTTONS = ("operator", "operator_menu_enum", "operator_enum")


def buttons_in(function: ast.AST) -> Iterator[tuple[str, set[str]]]:
    """Each button that a function draws: its operator, and the properties that the lines after it set for certain."""
    nodes = list(ast.walk(function))
    settings: dict[ast.Call, set[str]] = {}
    for node in nodes:
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in BUTTONS:
            settings[node] = {ast.literal_eval(node.args[1])} if node.func.attr != "operator" else set()
    assigned = [node for node in nodes if isinstance(node, ast.Assign)]
    named = {(node.targets[0].id, node.lineno): node.value for node in assigned
             if node.value in settings and isinstance(node.targets[0], ast.Name)}  # fmt: skip
    for node in assigned:
        for target in node.targets:
            for each in target.elts if isinstance(target, ast.Tuple) else (target,):
                if not isinstance(each, ast.Attribute):
                    continue
                button = each.value
                if isinstance(button, ast.Name):  # the button that got this name last
                    lines = [line for name, line in named if name == button.id and line < node.lineno]
                    button = named[button.id, max(lines)] if lines else button
                if button in settings:
                    settings[button].add(each.attr)
    for call, known in settings.items():
        if isinstance(call.args[0], ast.Constant) and call.args[0].value.startswith("spectral."):
            yield call.args[0].value, known


def all_buttons() -> dict[str, list[set[str]]]:
    """By operator, the properties that each of its buttons sets, in panels and menus."""
    found: dict[str, list[set[str]]] = {}
    for file in [
        path for part in ("panels", "operators", "properties") for path in sorted((FOLDER / part).rglob("*.py"))
    ]:
        for function in [
            node for node in ast.walk(ast.parse(file.read_text("utf-8"))) if isinstance(node, ast.FunctionDef)
        ]:
            for name, known in buttons_in(function):
                found.setdefault(name, []).append(known)
    return found


SOMETIMES_SET = sorted(
    (name, each)
    for name, buttons in all_buttons().items()
    for each in set.union(*buttons) - set.intersection(*buttons)
)  # fmt: skip


def test_buttons_are_found() -> None:
    assert len(all_buttons()) > 50
    assert ("spectral.palette_select", "row") in SOMETIMES_SET and (
        "spectral.dial_record",
        "only_changed",
    ) in SOMETIMES_SET
    assert {"effect", "value"} == set.intersection(*all_buttons()["spectral.plan_override"])


@pytest.mark.parametrize(
    ("name", "setting"),
    [*SOMETIMES_SET, ("spectral.palette_remove", "index"), ("spectral.palette_add", "name")],
)  # fmt: skip
def test_a_setting_that_a_button_leaves_unset_is_not_remembered(registered: Any, name: str, setting: str) -> None:
    rna = getattr(registered.ops.spectral, name.removeprefix("spectral.")).get_rna_type()
    assert rna.properties[setting].is_skip_save, f"give {setting} of {name} the option SKIP_SAVE"


def test_a_click_on_a_name_keeps_the_other_index(blender: Any) -> None:
    palette = blender.context.scene.spectral.palette
    palette.live = False
    for side in ("LIGHT", "MATERIAL"):
        for _ in range(3):
            blender.ops.spectral.palette_add(side=side)
    press = blender.ops.spectral.palette_select
    press("EXEC_DEFAULT", True, row=1, column=1)
    palette.active_column = 2
    press("EXEC_DEFAULT", True, row=0)  # True: as a button, which has the settings of the last run
    assert (palette.active_row, palette.active_column) == (0, 2)
