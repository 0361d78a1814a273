# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/blender_nodes.md states for every shader node of Blender whether it is read, as in the code."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

PAGE = Path(__file__).parents[2] / "docs" / "blender_nodes.md"
OUTPUTS = {"OUTPUT_MATERIAL", "OUTPUT_WORLD", "OUTPUT_LIGHT", "OUTPUT_AOV"}
ELSEWHERE = {"GROUP", "MIX_SHADER", "ADD_SHADER", "LIGHT_FALLOFF", *OUTPUTS}
"""Nodes that the walk over the tree or the translation of lamps reads, not an evaluator."""


def _state(kind: str) -> str:
    from blender_addon.translate.shading import media, surfaces
    from blender_addon.translate.shading.reader import EVALUATORS

    if kind in ELSEWHERE or kind in media.FILLS:
        return "Read"
    if kind in EVALUATORS:
        return "Stand-in" if EVALUATORS[kind].__name__ in ("_not_read", "_pattern") else "Read"
    if kind in surfaces.SURFACES:
        read = surfaces.SURFACES[kind]
        return "Stand-in" if read.__name__ == "_eevee" else "Read"
    return "Not read"


def test_every_node_is_in_the_right_row(blender):
    tree = bpy.data.node_groups.new("every node", "ShaderNodeTree")
    text = PAGE.read_text("utf-8")
    rows = {
        state: {name.strip() for name in names.split(",")}
        for state, names in re.findall(r"^\| (Read|Stand-in|Not read) \| (.+?) \|$", text, flags=re.M)
    }
    assert set(rows) == {"Read", "Stand-in", "Not read"}
    wrong = {}
    for name in dir(bpy.types):
        if not name.startswith("ShaderNode"):
            continue
        try:
            node = tree.nodes.new(name)
        except RuntimeError:  # a base class, or a node of geometry
            continue
        if node.bl_label not in rows[_state(node.type or name)]:
            wrong[node.bl_label] = _state(node.type or name)
    assert wrong == {}
