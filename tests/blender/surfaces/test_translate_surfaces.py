# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials: closures, textures, groups, arithmetic, spectra, and notes on unsupported nodes."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.scene import (
    AddSurface,
    Color,
    Diffuse,
    Emission,
    Glass,
    Glossy,
    MixSurface,
    Principled,
    RayPortal,
    Transparent,
)
from spectral_core.spectra.color import linear_from_display_rgb
from spectral_core.spectra.spectrum import Reflectance, SpectralGrid

bpy = pytest.importorskip("bpy")


def add(material, kind, **values):
    node = material.node_tree.nodes.new(kind)
    for name, value in values.items():
        setattr(node, name, value)
    return node


def feed(material, output, into="Color"):
    shader = material.node_tree.nodes["shader"]
    material.node_tree.links.new(output, shader.inputs[into] if isinstance(into, str) else into)


def rgb(paint):
    assert isinstance(paint, Color)
    return paint.linear_rgb


def test_plain_closures(build, surface):
    found, notes = surface(build.material(Color=(0.1, 0.2, 0.3, 1), Roughness=0.4))
    assert isinstance(found, Diffuse) and found.roughness == pytest.approx(0.4)
    np.testing.assert_allclose(rgb(found.color), (0.1, 0.2, 0.3), rtol=1e-6)
    found, _ = surface(build.material(shader="ShaderNodeBsdfAnisotropic", Roughness=0.3))
    assert isinstance(found, Glossy) and found.roughness == pytest.approx(0.3)
    found, _ = surface(build.material(shader="ShaderNodeBsdfGlass", IOR=1.7))
    assert isinstance(found, Glass) and found.ior == pytest.approx(1.7)
    found, _ = surface(build.material(shader="ShaderNodeBsdfTransparent"))
    assert isinstance(found, Transparent)
    found, _ = surface(build.material(shader="ShaderNodeEmission", Strength=4.0))
    assert isinstance(found, Emission) and found.strength == 4
    assert notes == set()


def test_principled_socket_by_socket(build, surface):
    sockets = {
        "Base Color": ("base_color", (0.1, 0.2, 0.3, 1)), "Metallic": ("metallic", 0.25),
        "Roughness": ("roughness", 0.75), "IOR": ("ior", 1.25), "Alpha": ("alpha", 0.5),
        "Specular IOR Level": ("specular_level", 0.125), "Anisotropic": ("anisotropic", 0.375),
        "Transmission Weight": ("transmission", 0.625),
        "Coat Roughness": ("coat_roughness", 0.0625), "Sheen Weight": ("sheen_weight", 0.1875),
        "Emission Color": ("emission_color", (1, 0.5, 0.25, 1)), "Emission Strength": ("emission_strength", 2.0),
    }  # fmt: skip
    material = build.material(shader="ShaderNodeBsdfPrincipled")
    for name, (_, value) in sockets.items():
        material.node_tree.nodes["shader"].inputs[name].default_value = value
    found, notes = surface(material)
    assert isinstance(found, Principled) and not notes
    for field, value in sockets.values():
        given = getattr(found, field)
        np.testing.assert_allclose(
            given.linear_rgb if isinstance(given, Color) else given, np.ravel(value)[:3], rtol=1e-6
        )


def test_mix_and_add_of_shaders(build, surface):
    material = build.material(Color=(1, 0, 0, 1))
    tree = material.node_tree
    glossy, mix, both = (add(material, f"ShaderNode{kind}") for kind in ("BsdfGlossy", "MixShader", "AddShader"))
    light = add(material, "ShaderNodeEmission")
    mix.inputs[0].default_value = 0.25
    tree.links.new(tree.nodes["shader"].outputs[0], mix.inputs[1])
    tree.links.new(glossy.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], both.inputs[0])
    tree.links.new(light.outputs[0], both.inputs[1])
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(both.outputs[0], output.inputs["Surface"])
    found, _ = surface(material)
    assert isinstance(found, AddSurface) and isinstance(found.second, Emission)
    assert isinstance(found.first, MixSurface) and found.first.factor == 0.25
    assert isinstance(found.first.first, Diffuse) and isinstance(found.first.second, Glossy)
    mix.inputs[0].default_value = 1.0
    found, _ = surface(material)
    assert isinstance(found.first, Glossy)


def test_groups_reroutes_and_muted_nodes_are_followed(build, surface):
    material = build.material()
    inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    inner.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
    inner.interface.new_socket("Result", in_out="OUTPUT", socket_type="NodeSocketColor")
    start, end, invert = (inner.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput", "ShaderNodeInvert"))
    inner.links.new(start.outputs["Tint"], invert.inputs["Color"])
    inner.links.new(invert.outputs[0], end.inputs["Result"])
    group, reroute = add(material, "ShaderNodeGroup", node_tree=inner), add(material, "NodeReroute")
    color, gamma = add(material, "ShaderNodeRGB"), add(material, "ShaderNodeGamma", mute=True)
    color.outputs[0].default_value = (0.9, 0.7, 0.5, 1)
    gamma.inputs["Gamma"].default_value = 5
    links = material.node_tree.links
    links.new(color.outputs[0], gamma.inputs["Color"])
    links.new(gamma.outputs[0], reroute.inputs[0])
    links.new(reroute.outputs[0], group.inputs["Tint"])
    feed(material, group.outputs["Result"])
    np.testing.assert_allclose(rgb(surface(material)[0].color), (0.1, 0.3, 0.5), rtol=1e-6)
    links.remove(group.inputs["Tint"].links[0])
    group.inputs["Tint"].default_value = (0.25, 0.5, 0.75, 1)
    np.testing.assert_allclose(rgb(surface(material)[0].color), (0.75, 0.5, 0.25), rtol=1e-6)


@pytest.mark.parametrize("packed", [False, True])
def test_image_texture_from_file_or_packed(build, surface, tmp_path, packed, rng):
    pixels = np.rint(rng.random((3, 5, 4)) * 255) / 255
    pixels[..., 3] = 1
    image = build.image("Paint", pixels)
    image.filepath_raw, image.file_format = str(tmp_path / "paint.png"), "PNG"
    image.save()
    if packed:
        image.pack()
        (tmp_path / "paint.png").unlink()
    else:
        image = bpy.data.images.load(str(tmp_path / "paint.png"))
    material = build.material()
    texture = add(material, "ShaderNodeTexImage", image=image, extension="EXTEND", interpolation="Closest")
    mapping = add(material, "ShaderNodeMapping")
    mapping.inputs["Location"].default_value = (0.5, 0.25, 0)
    mapping.inputs["Scale"].default_value = (2, 3, 1)
    mapping.inputs["Rotation"].default_value = (0, 0, np.pi / 2)
    material.node_tree.links.new(add(material, "ShaderNodeTexCoord").outputs["UV"], mapping.inputs["Vector"])
    material.node_tree.links.new(mapping.outputs[0], texture.inputs["Vector"])
    feed(material, texture.outputs["Color"])
    found = surface(material)[0].color
    (read,) = found.program.images
    assert read.pixels.dtype == np.uint8
    assert (read.color_space, read.extension, read.interpolation) == ("srgb", "extend", "nearest")
    np.testing.assert_array_equal(read.pixels, np.rint(pixels[..., :3] * 255))
    u, v = rng.random((2, 50))
    place = [np.clip(c, 0, 0.9999) for c in (0.5 - 3 * v, 0.25 + 2 * u)]
    expected = pixels[(place[1] * 3).astype(int), (place[0] * 5).astype(int), :3]
    values = found.program.evaluate(lambda name, shift: (u, v, 0 * u))
    np.testing.assert_allclose(values, linear_from_display_rgb(expected), atol=1e-6)


def test_a_missing_image_is_magenta_with_a_note(build, surface):
    image = bpy.data.images.new("Lost", 2, 2)
    image.source, image.filepath = "FILE", "//lost.png"
    material = build.material()
    feed(material, add(material, "ShaderNodeTexImage", image=image).outputs["Color"])
    found, notes = surface(material)
    np.testing.assert_allclose(rgb(found.color), (1, 0, 1))
    assert len(notes) == 1 and "//lost.png" in notes.pop()


def test_color_spaces_of_images(build, surface):
    pixels = np.full((2, 2, 4), 0.5)
    for space, expected in (("Non-Color", 0.5020), ("sRGB", 0.0513), ("Linear Rec.709", 0.2510)):
        material = build.material()
        image = build.image(space, pixels, color_space=space)
        feed(material, add(material, "ShaderNodeTexImage", image=image).outputs["Color"])
        np.testing.assert_allclose(surface(material)[0].color.typical, expected, atol=1e-4)
    feed(material, add(material, "ShaderNodeTexImage", image=image).outputs["Alpha"], "Roughness")
    roughness = surface(material)[0].roughness
    assert roughness.program.width == 1
    np.testing.assert_allclose(roughness.typical, 128 / 255, atol=1e-6)


def test_an_image_factor_mixes_two_colors_per_pixel(build, surface, rng):
    material = build.material()
    mask = add(
        material, "ShaderNodeTexImage", image=build.image("Mask", rng.random((2, 2, 4)), color_space="Non-Color")
    )
    mix = add(material, "ShaderNodeMix", data_type="RGBA")
    mix.inputs["A_Color" if "A_Color" in mix.inputs else 6].default_value = (1, 0, 0, 1)
    mix.inputs[7].default_value = (0, 1, 0, 1)
    material.node_tree.links.new(mask.outputs["Color"], mix.inputs["Factor"])
    feed(material, next(socket for socket in mix.outputs if socket.enabled))
    found = surface(material)[0].color
    (read,) = found.program.images
    values = found.program.evaluate(lambda name, shift: (np.array([0.25]), np.array([0.25]), np.zeros(1)))
    share = read.pixels[0, 0].astype(float) / 255 @ (0.2126, 0.7152, 0.0722)
    np.testing.assert_allclose(values, [[1 - share, share, 0]], atol=1e-6)


def test_arithmetic_on_an_image_reaches_its_pixels(build, surface, rng):
    pixels = rng.random((3, 3, 4)).astype(np.float32)
    material = build.material()
    texture = add(material, "ShaderNodeTexImage", image=build.image("Data", pixels, float_buffer=True))
    ramp, math = add(material, "ShaderNodeValToRGB"), add(material, "ShaderNodeMath", operation="MULTIPLY_ADD")
    math.inputs[1].default_value, math.inputs[2].default_value = 0.5, 0.25
    separate = add(material, "ShaderNodeSeparateColor")
    links = material.node_tree.links
    links.new(texture.outputs["Color"], separate.inputs[0])
    links.new(separate.outputs[1], math.inputs[0])
    links.new(math.outputs[0], ramp.inputs["Fac"])
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (1, 0, 0, 1), (0, 0, 1, 1)
    feed(material, ramp.outputs["Color"])
    found, notes = surface(material)
    factor = pixels[..., 1].ravel() * 0.5 + 0.25
    v, u = (c.ravel() / 3 + 1 / 6 for c in np.mgrid[0:3, 0:3])
    values = found.color.program.evaluate(lambda name, shift: (u, v, 0 * u))
    np.testing.assert_allclose(values, np.stack([1 - factor, 0 * factor, factor], -1), atol=1e-4)
    assert notes == set()


def test_each_unsupported_node_gets_one_note(build, surface):
    material = build.material()
    noise, portal = add(material, "ShaderNodeTexIES"), add(material, "ShaderNodeBsdfRayPortal")
    feed(material, noise.outputs[0])
    mix = add(material, "ShaderNodeMixShader")
    tree = material.node_tree
    tree.links.new(noise.outputs[0], portal.inputs["Position"])
    tree.links.new(noise.outputs[0], portal.inputs["Color"])
    tree.links.new(tree.nodes["shader"].outputs[0], mix.inputs[1])
    tree.links.new(portal.outputs[0], mix.inputs[2])
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    found, notes = surface(material)
    np.testing.assert_allclose(rgb(found.first.color), 100.0)  # a luminaire without a table, in Cycles
    assert isinstance(found.second, RayPortal) and len(notes) == 1  # read twice, noted once
    assert all("IES" in note for note in notes)


@pytest.mark.parametrize("kind", ["material", "node", "both"])
def test_a_spectrum_replaces_the_main_color(build, surface, kind):
    from blender_addon.translate.spectra.stored import store_spectrum

    grid = SpectralGrid.uniform()
    material = build.material(shader="ShaderNodeBsdfPrincipled")
    given = Reflectance("leaf", grid, np.linspace(0, 1, grid.size))
    other = Reflectance("other", grid, np.linspace(1, 0, grid.size))
    if kind != "node":
        store_spectrum(material.spectral, given if kind == "material" else other)
    if kind != "material":
        store_spectrum(material.node_tree.nodes["shader"].spectral, given)
    found, notes = surface(material)
    assert isinstance(found.base_color, Reflectance) and found.base_color.name == "leaf" and notes == set()
    np.testing.assert_allclose(found.base_color.values, given.values, atol=1e-6)


def test_no_output_no_nodes_no_material(build, surface):
    material = build.material()
    material.node_tree.nodes.clear()
    found, notes = surface(material)
    assert isinstance(found, Diffuse) and not np.any(rgb(found.color)) and len(notes) == 1
    found, _ = surface(None)
    np.testing.assert_allclose(rgb(found.base_color), 0.8)


def test_no_shader_node_of_this_blender_raises_an_error(build, translate):
    """Links the first outputs of each node type to a color, a number and a surface; no translation may fail."""
    kinds = [name for name in dir(bpy.types) if name.startswith("ShaderNode") and name != "ShaderNode"]
    tried = 0
    for kind in kinds:
        material = build.material(kind)
        try:
            node = add(material, kind)
        except RuntimeError:
            continue  # an abstract or internal type
        shader = material.node_tree.nodes["shader"]
        output = next(node for node in material.node_tree.nodes if node.type == "OUTPUT_MATERIAL")
        for socket in [socket for socket in node.outputs if socket.enabled][:1]:
            if socket.type == "SHADER":
                material.node_tree.links.new(socket, output.inputs["Surface"])
            else:
                material.node_tree.links.new(socket, shader.inputs["Color"])
                material.node_tree.links.new(socket, shader.inputs["Roughness"])
        build.plane(kind, material=material)
        tried += 1
    scene = translate()
    assert len(scene.materials) == tried > 80
