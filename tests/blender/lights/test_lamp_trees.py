# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees of lamps become factors of their emission, at the coordinates that Cycles gives a lamp."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

TINY = 1e-6


def tree_of(lamp):
    from blender_addon import compat

    tree = compat.use_nodes(lamp.data)
    return tree, next(node for node in tree.nodes if node.type == "EMISSION")


def shown(build, translate, lamp, kind, output):
    """The scene's light, whose color is an output of a node."""
    tree, emission = tree_of(lamp)
    node = tree.nodes.new(kind)
    tree.links.new(node.outputs[output], emission.inputs["Color"])
    (light,) = translate().lights
    return light


def value(light, position=(0, 0, 0), incoming=(0, 0, -1), normal=None, distance=3.0):
    """The factor at one point of a light."""
    vectors = {"position": position, "incoming": incoming, "normal": incoming if normal is None else normal}

    def read(name, shift):
        if name == "ray:Ray Length":
            return np.array([distance])
        return tuple(np.array([part], float) for part in vectors[name.removeprefix("true_")])

    return light.pattern.program.evaluate(read, transform=lambda vector, *_: vector).reshape(-1)


@pytest.mark.parametrize("output", ["UV", "Generated", "Object", "Normal"])
def test_coordinates_are_in_the_space_of_the_lamp(build, translate, output):
    lamp = build.light("AREA", size=2.0)
    lamp.location, lamp.rotation_euler, lamp.scale = (1, 2, 3), (0.4, 0.2, 0.9), (1.5, 0.5, 1.0)
    light = shown(build, translate, lamp, "ShaderNodeTexCoord", output)
    matrix = np.array(lamp.matrix_world)
    at = matrix @ (0.5, -0.25, 0, 1)  # a quarter of the width to the right, an eighth of the height down
    expected = {"UV": (0.75, 0.375, 0), "Normal": (0, 0, -1)}.get(output, (0.5, -0.25, 0))
    found = value(light, at[:3], incoming=(0, 0, -1), normal=-matrix[:3, 2] / np.linalg.norm(matrix[:3, 2]))
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_an_image_on_a_spot_fills_its_cone(build, translate):
    lamp = build.light("SPOT", spot_size=1.0)
    lamp.rotation_euler = (0.3, 0.0, 0.5)
    light = shown(build, translate, lamp, "ShaderNodeTexCoord", "UV")
    turn = np.array(lamp.matrix_world)[:3, :3]
    edge = np.tan(0.5)
    for local, expected in (((0, 0, -1), (0.5, 0.5)), ((edge, 0, -1), (1, 0.5)), ((0, -edge, -1), (0.5, 0))):
        toward = turn @ np.array(local, float)
        found = value(light, incoming=toward / np.linalg.norm(toward))
        np.testing.assert_allclose(found[:2], expected, atol=1e-5)


def test_a_sun_is_mapped_to_its_disk(build, translate):
    """The edge of the disk is the edge of the image (Cycles: distant_light_uv)."""
    lamp = build.light("SUN", angle=0.4)
    light = shown(build, translate, lamp, "ShaderNodeTexCoord", "UV")
    edge = 0.2 - 1e-6
    found = value(light, incoming=(-np.sin(edge), 0, -np.cos(edge)))  # light from a point of the disk toward +x
    np.testing.assert_allclose(found[:2], (1.0, 0.5), atol=1e-4)


def test_a_point_is_mapped_as_a_sphere(build, translate):
    light = shown(build, translate, build.light("POINT"), "ShaderNodeNewGeometry", "Parametric")
    for direction, expected in (((0, 1, 0), (0.5, 0.5)), ((1, 0, 0), (0.25, 0.5)), ((0.0, 1e-4, 1.0), (0.5, 1.0))):
        found = value(light, incoming=np.array(direction) / np.linalg.norm(direction))
        np.testing.assert_allclose(found[:2], expected, atol=1e-3)


def test_the_distance_and_object_info_are_read(build, translate):
    lamp = build.light("POINT")
    lamp.color = (0.2, 0.4, 0.6, 1.0)
    light = shown(build, translate, lamp, "ShaderNodeObjectInfo", "Color")
    np.testing.assert_allclose(light.color.linear_rgb, (0.2, 0.4, 0.6), atol=TINY)
    assert light.pattern is None  # the same all over the lamp
    light = shown(build, translate, lamp, "ShaderNodeLightPath", "Ray Length")
    np.testing.assert_allclose(value(light, distance=4.5), [4.5] * 3)


def test_a_color_as_strength_is_its_luminance(build, translate):
    """A checker of two colors made the lamp colored."""
    tree, emission = tree_of(build.light("POINT"))
    checker, place = tree.nodes.new("ShaderNodeTexChecker"), tree.nodes.new("ShaderNodeTexCoord")
    checker.inputs["Color1"].default_value, checker.inputs["Color2"].default_value = (1, 0.1, 0, 1), (0, 0.2, 1, 1)
    checker.inputs["Scale"].default_value = 1.0
    tree.links.new(place.outputs["Normal"], checker.inputs["Vector"])
    tree.links.new(checker.outputs["Color"], emission.inputs["Strength"])
    emission.inputs["Color"].default_value = (1.0, 0.5, 0.25, 1.0)
    (light,) = translate().lights
    luminances = (0.2126 + 0.1 * 0.7152, 0.2 * 0.7152 + 0.0722)
    found = [value(light, normal=normal) for normal in ((0.5, 0.5, 0.5), (0.5, 0.5, -0.5))]
    for each in found:
        np.testing.assert_allclose(each / each[0], (1.0, 0.5, 0.25), atol=1e-4)
    np.testing.assert_allclose(sorted(each[0] for each in found), sorted(luminances), atol=1e-3)


def test_rays_to_a_lamp_are_not_told_apart(build, translate):
    """Cycles evaluates a lamp without the type of ray, so that such a lamp is black."""
    tree, emission = tree_of(build.light("POINT"))
    path = tree.nodes.new("ShaderNodeLightPath")
    tree.links.new(path.outputs["Is Camera Ray"], emission.inputs["Strength"])
    assert translate().lights == ()


@pytest.mark.parametrize("depth", ["Ray Depth", "Diffuse Depth", "Glossy Depth", "Transparent Depth",
                                   "Transmission Depth"])  # fmt: skip
def test_a_lamp_whose_depths_are_not_counted_has_a_note(build, translate, depth):
    tree, emission = tree_of(build.light("POINT"))
    path, add = tree.nodes.new("ShaderNodeLightPath"), tree.nodes.new("ShaderNodeMath")
    add.inputs[1].default_value = 0.25
    tree.links.new(path.outputs[depth], add.inputs[0])
    tree.links.new(add.outputs[0], emission.inputs["Strength"])
    scene = translate()
    assert scene.lights[0].pattern is None
    assert [note.message for note in scene.notes] == [
        f"{depth!r} is 0 in a lamp's nodes; Cycles counts the bounces up to the surface"
    ]


@pytest.mark.parametrize("kind", ["POINT", "SUN"])
def test_a_light_falloff_in_a_computed_strength(build, translate, kind):
    """3 · d · d² / (s + d²), and the strength alone on a sun."""
    tree, emission = tree_of(build.light(kind, 1))
    falloff, add = tree.nodes.new("ShaderNodeLightFalloff"), tree.nodes.new("ShaderNodeMath")
    falloff.inputs["Strength"].default_value, falloff.inputs["Smooth"].default_value = 3.0, 2.0
    add.inputs[1].default_value = 0.0
    tree.links.new(falloff.outputs["Linear"], add.inputs[0])
    tree.links.new(add.outputs[0], emission.inputs["Strength"])
    (light,) = translate().lights
    if kind == "SUN":
        assert light.pattern is None and light.irradiance == pytest.approx(3.0)
    else:
        assert value(light, distance=4.0)[0] == pytest.approx(3 * 4 * 16 / (2 + 16), rel=1e-6)


def test_a_spectrum_keeps_its_wavelengths_under_a_pattern(build, translate):
    from spectral_core.spectra.spectrum import Spectrum

    tree, emission = tree_of(build.light("POINT"))
    body, noise = tree.nodes.new("ShaderNodeBlackbody"), tree.nodes.new("ShaderNodeTexNoise")
    body.inputs[0].default_value = 3000.0
    tree.links.new(body.outputs[0], emission.inputs["Color"])
    tree.links.new(noise.outputs[0], emission.inputs["Strength"])
    (light,) = translate().lights
    assert isinstance(light.color, Spectrum) and light.pattern.program.width == 1


def test_other_shaders_in_a_lamp_are_black_and_named(build, translate):
    tree, emission = tree_of(build.light("POINT"))
    mix, matt = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfDiffuse")
    mix.inputs[0].default_value = 0.25
    tree.links.new(emission.outputs[0], mix.inputs[1])
    tree.links.new(matt.outputs[0], mix.inputs[2])
    output = next(node for node in tree.nodes if node.type == "OUTPUT_LIGHT")
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    scene = translate()
    np.testing.assert_allclose(scene.lights[0].color.linear_rgb, (0.75,) * 3)
    assert any("Diffuse BSDF" in note.message for note in scene.notes)


def two_emissions(build, kind, second, share=0.25):
    """A lamp whose first emission has the spectrum HP1, joined with another one."""
    from blender_addon.translate.spectra.stored import store_spectrum
    from spectral_core.spectra.catalogue import illuminant

    tree, emission = tree_of(build.light("POINT", 10.0))
    store_spectrum(emission.spectral, illuminant("HP1"))
    emission.inputs["Strength"].default_value = 2.0
    other, join = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new(f"ShaderNode{kind}Shader")
    if second:
        store_spectrum(other.spectral, illuminant(second))
    if kind == "Mix":
        join.inputs[0].default_value = share
    sockets = [socket for socket in join.inputs if socket.type == "SHADER"]
    tree.links.new(emission.outputs[0], sockets[0])
    tree.links.new(other.outputs[0], sockets[1])
    tree.links.new(join.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_LIGHT").inputs["Surface"])
    return other, join


@pytest.mark.parametrize(("kind", "amounts"), [("Mix", (1.5, 0.25)), ("Add", (2.0, 1.0))])
def test_a_lamp_of_two_spectra_has_their_sum(build, translate, kind, amounts):
    """Their nodes' colors were used, without a word."""
    from spectral_core.spectra.catalogue import illuminant
    from spectral_core.spectra.observer import xyz_of

    two_emissions(build, kind, "FL11")
    scene = translate()
    (light,) = scene.lights
    parts = [illuminant(name) for name in ("HP1", "FL11")]
    at = np.arange(380.5, 780, 0.25)
    expected = sum(a * part.at(at) / xyz_of(part)[1] for a, part in zip(amounts, parts, strict=True))
    found = light.color.at(at) / xyz_of(light.color)[1] * light.power_w / 10.0
    np.testing.assert_allclose(found, expected, atol=1e-5 * expected.max())
    assert not scene.notes


def test_a_spectrum_beside_a_dark_emission_or_another_shader_stays(build, translate):
    other, _ = two_emissions(build, "Mix", None)
    other.inputs["Strength"].default_value = 0.0
    (light,) = translate().lights
    assert light.color.name == "HP1" and light.power_w == pytest.approx(15.0)


def test_a_spectrum_beside_a_color_is_named(build, translate):
    two_emissions(build, "Add", None)
    scene = translate()
    assert any("a spectrum with other light" in note.message for note in scene.notes)
    assert np.ptp(scene.lights[0].color.linear_rgb) > 0.5  # the color of sodium beside white


@pytest.mark.parametrize("kelvin", [2400.0, 6500.0, 11000.0])
def test_a_lamp_color_tints_a_temperature_of_its_nodes(build, translate, kelvin):
    """The color was left out, with a note. Expected: Planck's law with color matching functions of colour-science."""
    import colour

    lamp = build.light("POINT", color=(0.9, 0.3, 0.6))
    tree, emission = tree_of(lamp)
    node = tree.nodes.new("ShaderNodeBlackbody")
    node.inputs[0].default_value = kelvin
    tree.links.new(node.outputs[0], emission.inputs["Color"])
    (light,) = translate().lights
    cmfs = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    xyz = colour.sd_blackbody(kelvin, cmfs.shape).values @ cmfs.values
    rgb = colour.RGB_COLOURSPACES["sRGB"].matrix_XYZ_to_RGB @ (xyz / xyz[1])
    np.testing.assert_allclose(light.color.linear_rgb, np.maximum(rgb, 0.0) * (0.9, 0.3, 0.6), rtol=4e-3, atol=2e-3)


def test_a_temperature_beyond_blenders_table_is_its_last_one_with_a_note(build, translate):
    lamp = build.light("POINT", 100)
    if not hasattr(lamp.data, "use_temperature"):
        pytest.skip("this Blender's lights have no temperature")
    lamp.data.use_temperature, lamp.data.temperature = True, 18000
    scene = translate()
    assert scene.lights[0].color.name == "blackbody 12000"
    assert [note.message for note in scene.notes if "18000 K" in note.message and "12000 K" in note.message]
    colors = []
    for kelvin in (12000, 18000):
        lamp.data.temperature = kelvin
        lamp.data.color = (1, 0.5, 0.5)
        colors.append(translate().lights[0].color.linear_rgb)
    np.testing.assert_allclose(colors[0], colors[1], rtol=1e-4)  # Blender's own color of a temperature
