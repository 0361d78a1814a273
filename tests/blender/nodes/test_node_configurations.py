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

from tests.blender.node_walk import STRUCTS, Bench, names_of
from tests.blender.nodes.test_node_settings_are_read import (  # noqa: F401
    BESIDES,
    KINDS,
    OF_WORLDS,
    PLACES,
    PREPARED,
    small_sky,
    stage,
)
from tests.settings_walk import settings_of

MOST = 16
"""Combinations of a node; of more, each option once and others at random."""
OLDER_SKIES = {"PREETHAM", "HOSEK_WILKIE"}
SUNNY_SKIES = {"NISHITA", "SINGLE_SCATTERING", "MULTIPLE_SCATTERING"}
ONLY_WITH: dict[str, dict[str, set[str]]] = {
    "ShaderNodeMix": {"factor_mode": {"VECTOR"}, "blend_type": {"RGBA"}, "clamp_result": {"RGBA"}},
    "ShaderNodeTangent": {"uv_map": {"UV_MAP"}, "axis": {"RADIAL"}},
    "ShaderNodeNormalMap": {"uv_map": {"TANGENT"}},
    "ShaderNodeAttribute": {"attribute_name": {"GEOMETRY", "OBJECT", "INSTANCER"}},
    "ShaderNodeTexIES": {"ies": {"INTERNAL"}, "filepath": {"EXTERNAL"}, "input:Vector": {"INTERNAL"}},
    "ShaderNodeTexImage": {"projection_blend": {"BOX"}},
    "ShaderNodeTexWave": {"rings_direction": {"RINGS"}, "bands_direction": {"BANDS"}},
    "ShaderNodeTexSky": {
        **dict.fromkeys(("turbidity", "sun_direction"), OLDER_SKIES),
        "ground_albedo": {"HOSEK_WILKIE"},
        **dict.fromkeys(["sun_elevation", "sun_rotation", "altitude", "air_density", "dust_density"], SUNNY_SKIES),
        **dict.fromkeys(("aerosol_density", "ozone_density"), SUNNY_SKIES),
    },
}  # fmt: skip
"""Settings that count with one of these options only."""
EQUAL = {("AUTO", "AUTO_CLAMPED"), ("Cubic", "Smart"), ("ALL", "CYCLES")}
"""Options that are one in Cycles, or for the points of a curve that were not moved."""
NEVER = {"ShaderNodeTexSky": OF_WORLDS["ShaderNodeTexSky"], "ShaderNodeOutputAOV": {"input:Color", "input:Value"}}
"""What counts in worlds only, or with another pass."""
VALUES = {"A_Vector": (0.3, 0.4, 0.5), "B_Vector": (0.8, 0.7, 0.9), "Factor_Vector": (0.1, 0.2, 0.9)}


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


def prepared(kind: str) -> Bench:
    """A bench on which the settings of a node count; of a world's node in a material, which computes no picture."""
    bench = Bench.of(kind, PLACES.get(kind, ("MATERIAL",))[-1])
    PREPARED.get(kind, lambda _: None)(bench)
    if panel := getattr(bench.node, "texture_mapping", None):
        panel.translation, panel.rotation, panel.scale = (0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (1.1, 1.2, 1.3)
    return bench


def equal_options(bench: Bench, names: set[str]) -> set[tuple[str, ...]]:
    """Options of a list, of the node or of one of its structs, that give the same translation."""
    found: dict[tuple[str, str, str], list[str]] = {}
    for path in names:
        struct, _, name = path.rpartition(".")
        owner = STRUCTS[struct][1](bench.node) if struct else bench.node
        if path.startswith("input:") or owner.bl_rna.properties[name].type != "ENUM":
            continue
        kept = getattr(owner, name)
        for item in owner.bl_rna.properties[name].enum_items:
            with contextlib.suppress(TypeError):  # an option that depends on another setting
                setattr(owner, name, item.identifier)
                plain = bench.translated()
                bench.link_all()
                found.setdefault((path, plain, bench.translated()), []).append(item.identifier)
                bench.unlink_all()
        setattr(owner, name, kept)
    return {tuple(options) for options in found.values() if len(options) > 1}


@pytest.mark.parametrize("kind", KINDS)
def test_each_option_of_a_list_has_a_translation_of_its_own(stage: None, kind: str) -> None:  # noqa: F811
    bench = prepared(kind)
    names = names_of(bench) - set(BESIDES) - set(ONLY_WITH.get(kind, {})) - {"color_ramp.hue_interpolation"}
    assert equal_options(bench, names) <= EQUAL
    bench.remove()


@pytest.mark.parametrize("kind", KINDS)
def test_what_a_combination_shows_changes_the_translation(stage: None, kind: str) -> None:  # noqa: F811
    ignored = {}
    bench = prepared(kind)
    for name in ("A_Vector", "B_Vector", "Factor_Vector") if kind == "ShaderNodeMix" else ():
        bench.socket(f"input:{name}").default_value = VALUES[name]
    names = names_of(bench) - set(BESIDES) - NEVER.get(kind, set())
    for options in combinations(bench.node):
        if options.get("target") == "EEVEE" or options.get("convert_from", 0) == options.get("convert_to", 1):
            continue
        with contextlib.suppress(TypeError):
            for name, value in options.items():
                setattr(bench.node, name, value)
            if left := ignored_in(bench, options, names):
                ignored[tuple(options.values())] = left
    bench.remove()
    assert not ignored
