# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials on a ball, rendered by Cycles and by this renderer: mean color within a few percent."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.blender import balls, cycles  # noqa: E402

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
    "coat IOR": {"Coat Weight": 1.0, "Coat IOR": 2.2},
    "index below 1": {"IOR": 0.8},
    "diffuse roughness": {"Diffuse Roughness": 1.0},
    "single scattering metal": {"Metallic": 1.0, "Roughness": 0.9, "distribution": "GGX"},
    "single scattering plastic": {"Roughness": 0.8, "IOR": 2.0, "distribution": "GGX"},
}


BEHIND_AN_IMAGE = ("HueSaturation", "Gamma", "RGBCurve", "FloatCurve", "ValToRGB")
GLOSSY = "glossy without multiple scattering"
VOLUMES = ("ShaderNodeVolumeScatter", "ShaderNodeVolumeAbsorption")


def principled(builders, values):
    values = dict(values)
    distribution = values.pop("distribution", "MULTI_GGX")
    material = builders.material(shader="ShaderNodeBsdfPrincipled", **values)
    material.node_tree.nodes["shader"].distribution = distribution
    return material


def glossy(builders):
    material = builders.material(shader="ShaderNodeBsdfAnisotropic", Roughness=1.0)
    material.node_tree.nodes["shader"].distribution = "GGX"
    return material


def behind_an_image(builders, kind):
    """A matt surface in the colors of an image behind a node."""
    material = builders.material()
    tree = material.node_tree
    image = tree.nodes.new("ShaderNodeTexImage")
    pixels = np.random.default_rng(20111).random((4, 4, 4))
    pixels[..., 3] = 1
    image.image, image.interpolation = builders.image("Picture", pixels), "Closest"
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
    return material


def volume(builders, shader):
    material = builders.material(shader=shader, Color=(0.8, 0.3, 0.1, 1), Density=1.5)
    tree = material.node_tree
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.remove(output.inputs["Surface"].links[0])
    tree.links.new(tree.nodes["shader"].outputs[0], output.inputs["Volume"])
    return material


@pytest.fixture(scope="module")
def surfaces(builders, tmp_path_factory):
    """Balls of all surfaces in one picture."""
    balls.emptied()
    materials = {name: principled(builders, values) for name, values in PRINCIPLED.items()}
    materials |= {GLOSSY: glossy(builders)}
    materials |= {kind: behind_an_image(builders, kind) for kind in BEHIND_AN_IMAGE}
    return balls.shown(materials, builders, tmp_path_factory.mktemp("surfaces"), samples=128)


@pytest.fixture(scope="module")
def volumes(builders, tmp_path_factory):
    """Balls of both volumes in one picture."""
    balls.emptied()
    materials = {shader: volume(builders, shader) for shader in VOLUMES}
    return balls.shown(materials, builders, tmp_path_factory.mktemp("volumes"), samples=256)


@pytest.mark.parametrize("name", PRINCIPLED)
def test_principled(surfaces, name):
    (theirs, ours), notes = surfaces[0][name], surfaces[1]
    np.testing.assert_allclose(ours, theirs, rtol=0.035)
    assert notes == []


def test_a_coat_tint_over_glass(build, stage, tmp_path):
    """Alone: with other balls behind the glass, it has much more noise."""
    coated = {"Coat Weight": 1.0, "Coat Tint": (0.9, 0.3, 0.2, 1), "Transmission Weight": 1.0}
    theirs, ours, notes = stage(principled(build, coated), tmp_path, samples=128)
    np.testing.assert_allclose(ours, theirs, rtol=0.035)
    assert notes == []


def test_glossy_without_multiple_scattering(surfaces):
    (theirs, ours), notes = surfaces[0][GLOSSY], surfaces[1]
    np.testing.assert_allclose(ours, theirs, rtol=0.02)
    assert notes == []


@pytest.mark.parametrize("shader", VOLUMES)
def test_colored_volumes(volumes, shader):
    (theirs, ours), notes = volumes[0][shader], volumes[1]
    np.testing.assert_allclose(ours, theirs, rtol=0.08)
    assert notes == []


@pytest.mark.parametrize("kind", BEHIND_AN_IMAGE)
def test_nodes_behind_an_image(surfaces, kind):
    (theirs, ours), notes = surfaces[0][kind], surfaces[1]
    np.testing.assert_allclose(ours, theirs, rtol=0.03, atol=0.004)
    assert notes == []


ALPHA_MODES = [(mode, linked) for mode in ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE") for linked in (False, True)]


def glowing(builders, path, mode, linked):
    """A material that shines in the color of an image, times its alpha if alpha is linked to its strength."""
    image = bpy.data.images.load(path, check_existing=False)
    image.alpha_mode = mode
    image.pack()
    material = builders.material(shader="ShaderNodeEmission")
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Closest"
    tree.links.new(texture.outputs["Color"], tree.nodes["shader"].inputs["Color"])
    if linked:
        tree.links.new(texture.outputs["Alpha"], tree.nodes["shader"].inputs["Strength"])
    return material


def test_alpha_modes_of_images(build, tmp_path):
    """Planes in a row that shine; the pixels at their edges, which show two of them, are left out."""
    image = build.image("Picture", np.broadcast_to((0.8, 0.4, 0.2, 0.5), (4, 4, 4)))
    image.filepath_raw, image.file_format = str(tmp_path / "picture.png"), "PNG"
    image.save()
    for number, case in enumerate(ALPHA_MODES):
        build.plane(size=1, material=glowing(build, image.filepath_raw, *case)).location = (number - 3.5, 0, 0)
    build.camera((0, 0, 5), type="ORTHO", ortho_scale=len(ALPHA_MODES))
    cycles.settings(4, 8)
    bpy.context.scene.render.resolution_x = 8 * len(ALPHA_MODES)
    theirs, (ours, notes) = cycles.cycles(tmp_path), cycles.ours(4)
    colors = [picture[2:6].reshape(4, -1, 8, 3)[:, :, 2:6].mean((0, 2)) for picture in (ours, theirs)]
    for case, found, wanted in zip(ALPHA_MODES, *colors, strict=True):
        np.testing.assert_allclose(found, wanted, rtol=0.035, err_msg=str(case))  # 8-bit values are rounded
    assert len({tuple(np.round(color, 2)) for color in colors[1]}) >= 4
    assert notes == []
