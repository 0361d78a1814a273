# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes of a world that read data of objects, which a world does not have: the values are those of Cycles."""

from __future__ import annotations

import numpy as np
import pytest

from tests.blender import cycles
from tests.blender.surfaces.test_surfaces_against_cycles import stage  # noqa: F401

bpy = pytest.importorskip("bpy")

CASES = {
    "parametric coordinates": ("NewGeometry", "Parametric", {}),
    "island": ("NewGeometry", "Random Per Island", {}),
    "alpha of an attribute": ("Attribute", "Alpha", {"attribute_name": "missing"}),
    "color of an attribute": ("Attribute", "Color", {"attribute_name": "missing"}),
    "alpha of an object": ("Attribute", "Alpha", {"attribute_name": "missing", "attribute_type": "OBJECT"}),
    "alpha of an instancer": ("Attribute", "Alpha", {"attribute_name": "missing", "attribute_type": "INSTANCER"}),
    "alpha of the scene": ("Attribute", "Alpha", {"attribute_name": "stored", "attribute_type": "VIEW_LAYER"}),
    "alpha of a color attribute": ("VertexColor", "Alpha", {}),
    "random of particles": ("ParticleInfo", "Random", {}),
    "random of objects": ("ObjectInfo", "Random", {}),
    "ray depth": ("LightPath", "Ray Depth", {}),
    "diffuse depth": ("LightPath", "Diffuse Depth", {}),
}


def shown(kind, output, values):
    """A world that shows a quarter of an output plus a half."""
    from blender_addon import compat

    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    tree = compat.use_nodes(world)
    tree.nodes.clear()
    node, scaled = tree.nodes.new(f"ShaderNode{kind}"), tree.nodes.new("ShaderNodeVectorMath")
    for name, value in values.items():
        setattr(node, name, value)
    scaled.operation = "MULTIPLY_ADD"
    scaled.inputs[1].default_value, scaled.inputs[2].default_value = (0.25,) * 3, (0.5,) * 3
    background, end = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(node.outputs[output], scaled.inputs[0])
    tree.links.new(scaled.outputs[0], background.inputs["Color"])
    tree.links.new(background.outputs[0], end.inputs["Surface"])


@pytest.mark.parametrize("case", CASES)
def test_a_world_has_what_cycles_gives_it(build, translate, tmp_path, case):
    bpy.context.scene["stored"] = (0.1, 0.2, 0.3, 0.4)
    shown(*CASES[case])
    build.camera()
    cycles.settings(samples=1, size=4)
    expected = cycles.cycles(tmp_path)
    world = translate().world
    found = (world.camera_view or world).color.linear_rgb
    np.testing.assert_allclose(np.broadcast_to(found, expected.shape), expected, rtol=1e-5)


def test_a_tangent_that_is_no_number_in_cycles_has_a_note(build, translate, tmp_path):
    shown("NewGeometry", "Tangent", {})
    build.camera()
    cycles.settings(samples=1, size=4)
    assert cycles.cycles(tmp_path).max() == 0
    assert any("Tangent of Geometry is no number in a world" in note.message for note in translate().notes)


LIT = {"Is Glossy Ray": ("Glossy", 0.4), "Is Transmission Ray": ("Glass", 0.0), "Is Diffuse Ray": ("Glossy", 0.4)}


@pytest.mark.parametrize("output", LIT)
@pytest.mark.parametrize("is_lit", [False, True])
def test_an_even_world_that_tells_rays_apart(build, stage, tmp_path, output, is_lit, monkeypatch):  # noqa: F811
    """Each ray that meets the world shows it by its own type, as in Cycles, with and without a lamp."""
    kind, roughness = LIT[output]
    material = build.material(shader="ShaderNodeBsdfAnisotropic" if kind == "Glossy" else "ShaderNodeBsdfGlass")
    material.node_tree.nodes["shader"].inputs["Roughness"].default_value = roughness
    rendered = cycles.cycles

    def told(folder):
        from blender_addon import compat

        if not is_lit:
            bpy.data.objects.remove(next(each for each in bpy.data.objects if each.type == "LIGHT"))
        tree = compat.use_nodes(bpy.context.scene.world)
        path, mix = tree.nodes.new("ShaderNodeLightPath"), tree.nodes.new("ShaderNodeMixShader")
        other, end = tree.nodes.new("ShaderNodeBackground"), next(n for n in tree.nodes if n.type == "OUTPUT_WORLD")
        other.inputs["Color"].default_value = (0.9, 0.3, 0.1, 1.0)
        first = end.inputs["Surface"].links[0].from_socket
        for start, target in zip((path.outputs[output], first, other.outputs[0]), mix.inputs, strict=True):
            tree.links.new(start, target)
        tree.links.new(mix.outputs[0], end.inputs["Surface"])
        return rendered(folder)

    monkeypatch.setattr(cycles, "cycles", told)
    theirs, ours, notes = stage(material, tmp_path, samples=128)
    np.testing.assert_allclose(ours, theirs, rtol=0.02)
    assert notes == []


@pytest.mark.parametrize(("kind", "turbidity", "count"), [
    ("HOSEK_WILKIE", 2.2, 0), ("HOSEK_WILKIE", 5.0, 1), ("PREETHAM", 5.0, 0),
])  # fmt: skip
def test_a_turbid_sky_that_is_fitted_otherwise_has_a_note(build, translate, kind, turbidity, count):
    from blender_addon import compat

    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    tree = compat.use_nodes(world)
    sky, background = tree.nodes.new("ShaderNodeTexSky"), next(n for n in tree.nodes if n.type == "BACKGROUND")
    sky.sky_type, sky.turbidity = kind, turbidity
    tree.links.new(sky.outputs[0], background.inputs["Color"])
    assert sum("Hosek-Wilkie" in note.message for note in translate().notes) == count
