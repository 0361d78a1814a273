# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials on a ball, rendered by Cycles and by this renderer: mean color within a few percent."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.blender import cycles  # noqa: E402

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@pytest.fixture
def stage(build):
    """A ball of a material under a lamp and a colored sky, before a camera; returns the ball's pixels of both."""

    def show(material, tmp_path, samples=64):
        from blender_addon import compat

        cycles.settings(samples)
        bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=1)
        bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(material)
        world = bpy.context.scene.world = bpy.data.worlds.new("World")
        background = next(node for node in compat.use_nodes(world).nodes if node.type == "BACKGROUND")
        background.inputs[0].default_value, background.inputs[1].default_value = (0.4, 0.5, 0.7, 1), 0.7
        lamp = build.light("AREA", energy=200, location=(2.5, -2.5, 3.5), size=2.0)
        lamp.rotation_euler = (-lamp.location).to_track_quat("-Z", "Y").to_euler()
        camera = build.camera((0, -6, 2), lens=70)
        camera.rotation_euler = (-camera.location).to_track_quat("-Z", "Y").to_euler()
        inner = slice(6, 18)
        theirs, (ours, notes) = cycles.cycles(tmp_path), cycles.ours(samples)
        return theirs[inner, inner].mean((0, 1)), ours[inner, inner].mean((0, 1)), notes

    return show


PRINCIPLED = {
    "default": {},
    "coat tint": {"Coat Weight": 1.0, "Coat Tint": (0.9, 0.3, 0.2, 1)},
    "coat tint over glass": {"Coat Weight": 1.0, "Coat Tint": (0.9, 0.3, 0.2, 1), "Transmission Weight": 1.0},
    "coat IOR": {"Coat Weight": 1.0, "Coat IOR": 2.2},
    "index below 1": {"IOR": 0.8},
    "diffuse roughness": {"Diffuse Roughness": 1.0},
    "single scattering metal": {"Metallic": 1.0, "Roughness": 0.9, "distribution": "GGX"},
    "single scattering plastic": {"Roughness": 0.8, "IOR": 2.0, "distribution": "GGX"},
}


@pytest.mark.parametrize("name", PRINCIPLED)
def test_principled(build, stage, tmp_path, name):
    values = dict(PRINCIPLED[name])
    distribution = values.pop("distribution", "MULTI_GGX")
    material = build.material(shader="ShaderNodeBsdfPrincipled", **values)
    material.node_tree.nodes["shader"].distribution = distribution
    theirs, ours, notes = stage(material, tmp_path, samples=128)
    np.testing.assert_allclose(ours, theirs, rtol=0.035)
    assert notes == []


def test_glossy_without_multiple_scattering(build, stage, tmp_path):
    material = build.material(shader="ShaderNodeBsdfAnisotropic", Roughness=1.0)
    material.node_tree.nodes["shader"].distribution = "GGX"
    theirs, ours, notes = stage(material, tmp_path, samples=128)
    np.testing.assert_allclose(ours, theirs, rtol=0.02)
    assert notes == []


@pytest.mark.parametrize("shader", ["ShaderNodeVolumeScatter", "ShaderNodeVolumeAbsorption"])
def test_colored_volumes(build, stage, tmp_path, shader):
    material = build.material(shader=shader, Color=(0.8, 0.3, 0.1, 1), Density=1.5)
    tree = material.node_tree
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.remove(output.inputs["Surface"].links[0])
    tree.links.new(tree.nodes["shader"].outputs[0], output.inputs["Volume"])
    theirs, ours, notes = stage(material, tmp_path, samples=256)
    np.testing.assert_allclose(ours, theirs, rtol=0.08)
    assert notes == []


@pytest.mark.parametrize("kind", ["HueSaturation", "Gamma", "RGBCurve", "FloatCurve", "ValToRGB"])
def test_nodes_behind_an_image(build, stage, tmp_path, kind, rng):
    material = build.material()
    tree = material.node_tree
    image = tree.nodes.new("ShaderNodeTexImage")
    pixels = rng.random((4, 4, 4))
    pixels[..., 3] = 1
    image.image, image.interpolation = build.image("Picture", pixels), "Closest"
    node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in (("Hue", 0.3), ("Gamma", 2.0)):
        if name in node.inputs:
            node.inputs[name].default_value = value
    if kind in ("RGBCurve", "FloatCurve"):
        for curve in node.mapping.curves:
            curve.points[1].location = (1, 0.3)
    socket = next(s for s in node.inputs if s.name in ("Color", "Value") or len(node.inputs) == 1)
    tree.links.new(image.outputs["Color"], socket)
    tree.links.new(node.outputs[0], tree.nodes["shader"].inputs["Color"])
    theirs, ours, notes = stage(material, tmp_path, samples=128)
    np.testing.assert_allclose(ours, theirs, rtol=0.03, atol=0.004)
    assert notes == []


@pytest.mark.parametrize("linked", [False, True])
@pytest.mark.parametrize("mode", ["STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"])
def test_alpha_modes_of_images(build, tmp_path, mode, linked):
    """An emissive plane that fills the picture: its color, times alpha if alpha is linked to its strength."""
    image = build.image("Picture", np.broadcast_to((0.8, 0.4, 0.2, 0.5), (4, 4, 4)))
    image.filepath_raw, image.file_format = str(tmp_path / "picture.png"), "PNG"
    image.save()
    image = bpy.data.images.load(str(tmp_path / "picture.png"))
    image.alpha_mode = mode
    image.pack()
    material = build.material(shader="ShaderNodeEmission")
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Closest"
    tree.links.new(texture.outputs["Color"], tree.nodes["shader"].inputs["Color"])
    if linked:
        tree.links.new(texture.outputs["Alpha"], tree.nodes["shader"].inputs["Strength"])
    build.plane(size=20, material=material)
    build.camera((0, 0, 5))
    cycles.settings(4, 8)
    theirs, (ours, notes) = cycles.cycles(tmp_path), cycles.ours(4)
    np.testing.assert_allclose(ours.mean((0, 1)), theirs.mean((0, 1)), rtol=0.035)  # 8-bit values are rounded
    assert notes == []
