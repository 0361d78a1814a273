# SPDX-License-Identifier: GPL-3.0-or-later
"""Every setting and input of a shader node that the ledger lists as read changes the translation or its notes.

A setting that is removed from the evaluator of a node therefore fails a test here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bpy")

import bpy

from blender_addon.translate.ledger import entries
from blender_addon.translate.lighting import patterns
from blender_addon.translate.shading.nodes import skies as sky_nodes
from spectral_core.scene.skies import atmosphere
from tests.blender.node_walk import Bench, ignored, names_of

PLACES = {
    "ShaderNodeOutputLight": ("LIGHT",), "ShaderNodeTexIES": ("LIGHT", "MATERIAL"),
    "ShaderNodeLightFalloff": ("LIGHT",), "ShaderNodeOutputWorld": ("WORLD",),
    "ShaderNodeBackground": ("WORLD", "MATERIAL"), "ShaderNodeTexEnvironment": ("WORLD", "MATERIAL"),
    "ShaderNodeTexSky": ("WORLD", "MATERIAL"),
}  # fmt: skip
"""Where a node is tried, other than in a material."""
OF_WORLDS = {
    "ShaderNodeTexSky": {"sun_disc", "sun_size", "sun_intensity"},
    "ShaderNodeTexEnvironment": {"image", "projection", "interpolation"},
}
"""Settings that are tried in a world, whose translation computes a picture; all others are tried in a material."""
BESIDES = {
    "node_tree": "groups: tests/blender/surfaces/test_translate_surfaces.py",
    "image_user": "sequences: tests/blender/images/test_image_files.py",
    "is_active_output": "one of several outputs, below",
}
LUMINAIRE = "IESNA:LM-63-2002\nTILT=NONE\n1 {lumen} 1 3 1 1 2 0 0 0\n1 1 100\n0 45 90\n0\n100 60 10\n"


@pytest.fixture(scope="module")
def stage(_extension: None) -> Iterator[None]:
    """One empty file for all nodes, with an AOV of each type."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    for kind in ("COLOR", "VALUE"):
        aov = bpy.context.view_layer.aovs.add()
        aov.name, aov.type = kind, kind
    yield
    bpy.ops.wm.read_factory_settings(use_empty=True)


@pytest.fixture(autouse=True)
def small_sky(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Skies and drawn worlds of few elements: whether a setting counts is asked, not its effect."""
    monkeypatch.setattr(sky_nodes, "SKY_ROWS", 8)
    monkeypatch.setattr(patterns, "ROWS", 32)
    for name, value in (("ROWS", 8), ("COLUMNS", 6)):
        monkeypatch.setattr(atmosphere, name, value)
    atmosphere._table.cache_clear()
    yield
    atmosphere._table.cache_clear()


def _picture(seed: int) -> Any:
    made = bpy.data.images.new(f"picture {seed}", 4, 4, float_buffer=True)
    made.pixels.foreach_set(np.random.default_rng(seed).random(64).astype(np.float32))
    return made


def _text(lumen: int) -> Any:
    made = bpy.data.texts.new("luminaire")
    made.write(LUMINAIRE.format(lumen=lumen))
    return made


def _with_picture(bench: Bench) -> None:
    bench.node.image, bench.given["image"] = _picture(1), _picture(2)


def _with_uv_map(bench: Bench) -> None:
    mesh = bpy.data.meshes.new("mesh")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    mesh.uv_layers.new(name="UVMap")
    mesh.materials.append(bench.owner)


def _with_luminaire(bench: Bench) -> None:
    bench.node.ies, bench.given["ies"] = _text(1000), _text(2000)


def _with_object(bench: Bench) -> None:
    other = bpy.data.objects.new("other", None)
    other.location = (1, 2, 3)
    bpy.context.scene.collection.objects.link(other)
    bench.depsgraph = bpy.context.evaluated_depsgraph_get()
    bench.given["object"] = other


def _with_colors(bench: Bench) -> None:
    for element, color in zip(
        bench.node.color_ramp.elements, ((0.9, 0.1, 0.2, 1.0), (0.1, 0.3, 0.8, 1.0)), strict=True
    ):
        element.color = color


def _as_vectors(bench: Bench) -> None:
    bench.node.data_type = "VECTOR"
    for name, value in (
        ("Factor_Vector", (0.1, 0.2, 0.9)),
        ("A_Vector", (0.3, 0.4, 0.5)),
        ("B_Vector", (0.8, 0.7, 0.9)),
    ):
        bench.socket(f"input:{name}").default_value = value


def _aov(kind: str) -> Callable[[Bench], None]:
    return lambda bench: setattr(bench.node, "aov_name", kind)


PREPARED: dict[str, Callable[[Bench], None]] = {
    "ShaderNodeTexImage": _with_picture, "ShaderNodeTexEnvironment": _with_picture,
    "ShaderNodeNormalMap": _with_uv_map, "ShaderNodeTangent": _with_uv_map, "ShaderNodeTexIES": _with_luminaire,
    "ShaderNodeTexCoord": _with_object, "ShaderNodeValToRGB": _with_colors, "ShaderNodeOutputAOV": _aov("COLOR"),
}  # fmt: skip
"""What a node needs before its settings count."""
THEN: dict[str, Callable[[Bench], None]] = {
    "ShaderNodeMix": _as_vectors, "ShaderNodeOutputAOV": _aov("VALUE"),
    "ShaderNodeValToRGB": lambda bench: setattr(bench.node.color_ramp, "color_mode", "HSV"),
}  # fmt: skip
"""What settings need that did not count before."""
KINDS = sorted(
    kind for kind, entry in entries().items()
    if kind.startswith("ShaderNode") and hasattr(bpy.types, kind)
    and not entry.stand_in and entry.read | set(entry.noted)
)  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_every_setting_of_a_node_changes_the_translation(stage: None, kind: str) -> None:
    for place in PLACES.get(kind, ("MATERIAL",)):
        bench = Bench.of(kind, place)
        PREPARED.get(kind, lambda _: None)(bench)
        names = names_of(bench) - set(BESIDES)
        if kind in OF_WORLDS:
            names = OF_WORLDS[kind] if place == "WORLD" else names - (OF_WORLDS[kind] - {"image", "projection"})
        if place != "WORLD" and (panel := getattr(bench.node, "texture_mapping", None)):
            panel.translation, panel.rotation, panel.scale = (0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (1.1, 1.2, 1.3)
        left = ignored(bench, names)
        if left and kind in THEN:
            THEN[kind](bench)
            bench.plain = None
            left = ignored(bench, left)
        assert not left, place
        bench.remove()


@pytest.mark.parametrize(("kind", "place"), [("Material", "MATERIAL"), ("World", "WORLD"), ("Light", "LIGHT")])
def test_of_two_outputs_the_active_one_is_read(stage: None, kind: str, place: str) -> None:
    bench = Bench.of(f"ShaderNodeOutput{kind}", place)
    tree = bench.owner.node_tree
    other = tree.nodes.new(bench.node.bl_idname)
    tree.links.new(bench.shader, bench.node.inputs["Surface"])
    found = []
    for active in (bench.node, other):
        bench.node.is_active_output = other.is_active_output = False
        active.is_active_output = True
        found.append(bench.translated())
    assert found[0] != found[1]
    bench.remove()
