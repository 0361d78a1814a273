# SPDX-License-Identifier: GPL-3.0-or-later
"""In each combination of a node's lists, what Blender shows of it changes the translation or its notes.

Blender itself disables the inputs that a combination does not use, so that a branch of an evaluator which reads one
input or setting less than its twin fails a test here.
"""

from __future__ import annotations

import contextlib
import itertools
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bpy")

import bpy

from blender_addon.translate.shading import sky_nodes
from tests.blender.node_walk import Bench, names_of
from tests.blender.test_node_settings_are_read import BESIDES, KINDS, PLACES, PREPARED, stage  # noqa: F401
from tests.settings_walk import settings_of

MOST = 24
"""Combinations of a node; of more, each option once and others at random."""
ROUNDING = {"SIGN", "FLOOR", "CEIL", "TRUNC"}
ONLY_WITH: dict[str, dict[str, set[str]]] = {
    "ShaderNodeMix": {"factor_mode": {"VECTOR"}, "blend_type": {"RGBA"}, "clamp_result": {"RGBA"}},
    "ShaderNodeTangent": {"uv_map": {"UV_MAP"}, "axis": {"RADIAL"}},
    "ShaderNodeNormalMap": {"uv_map": {"TANGENT"}},
    "ShaderNodeAttribute": {"attribute_name": {"GEOMETRY", "OBJECT", "INSTANCER"}},
}
"""Settings that count with one of these options only."""
NEVER = {"input:Weight"}


def combinations(node: Any) -> list[dict[str, str]]:
    """Values of the node's lists."""
    lists = {
        name: [item.identifier for item in node.bl_rna.properties[name].enum_items]
        for name in settings_of(node, bpy.types.ShaderNode)
        if node.bl_rna.properties[name].type == "ENUM"
    }
    every = itertools.product(*lists.values())
    found = [dict(zip(lists, values, strict=True)) for values in itertools.islice(every, 5000)]
    if len(found) <= MOST:
        return found
    rng = np.random.default_rng(4417)
    usual = {name: getattr(node, name) for name in lists}
    each = [usual | {name: option} for name, options in lists.items() for option in options]
    return each + [found[k] for k in rng.choice(len(found), MOST, replace=False)]


def ignored_in(bench: Bench, options: dict[str, str], names: set[str]) -> set[str]:
    """Names that change nothing in a combination."""
    bench.plain = None
    only = ONLY_WITH.get(bench.node.bl_idname, {})
    left = {
        name
        for name in names
        if (bench.socket(name).enabled if name.startswith("input:") else only.get(name, set(options.values())))
        and (name not in only or only[name] & set(options.values()))
    }
    for varying in (False, True):
        left -= {name for name in sorted(left) if bench.changes(name, varying)}
    bench.unlink_all()
    return left


@pytest.mark.parametrize("kind", KINDS)
def test_what_a_combination_shows_changes_the_translation(
    stage: None, kind: str, monkeypatch: pytest.MonkeyPatch  # noqa: F811
) -> None:  # fmt: skip
    monkeypatch.setattr(sky_nodes, "SKY_ROWS", 8)
    ignored = {}
    for place in PLACES.get(kind, ("MATERIAL",))[:1]:
        bench = Bench.of(kind, place)
        PREPARED.get(kind, lambda _: None)(bench)
        if panel := getattr(bench.node, "texture_mapping", None):
            panel.translation, panel.rotation, panel.scale = (0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (1.1, 1.2, 1.3)
        names = names_of(bench) - set(BESIDES) - NEVER
        for options in combinations(bench.node):
            if options.get("target") == "EEVEE":
                continue
            with contextlib.suppress(TypeError):
                for name, value in options.items():
                    setattr(bench.node, name, value)
                if left := ignored_in(bench, options, names):
                    ignored[tuple(options.values())] = left
        bench.remove()
    assert not ignored
