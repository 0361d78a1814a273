# SPDX-License-Identifier: GPL-3.0-or-later
"""The spectrum of a world beside images, skies and strengths that depend on the ray."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

bpy = pytest.importorskip("bpy")


@pytest.fixture
def world(build):
    """A world with a spectrum, and its Background node of strength 0.25."""
    from blender_addon import compat
    from blender_addon.translate.spectra.stored import store_spectrum

    made = bpy.data.worlds.new("Studio")
    bpy.context.scene.world = made
    tree = compat.use_nodes(made)
    tree.nodes.clear()
    background, output = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(background.outputs[0], output.inputs["Surface"])
    background.inputs["Strength"].default_value = 0.25
    grid = SpectralGrid.uniform(400.0, 700.0, 10.0)
    store_spectrum(made.spectral, Illuminant("lamp", grid, np.linspace(0.2, 1.0, grid.size)), strength=2.0)
    build.plane()
    return made, tree, background


def replaced(scene):
    return [note for note in scene.notes if "its spectrum replaces" in note.message]


def test_a_plain_world_has_its_spectrum_and_strength(world, translate):
    scene = translate()
    assert scene.world.color.name == "lamp" and scene.world.strength == 0.5
    assert replaced(scene) == []


@pytest.mark.parametrize("size", [(4, 8), (512, 1024)])
def test_an_image_keeps_its_strength_and_is_named(world, build, translate, size):
    _, tree, background = world
    image = tree.nodes.new("ShaderNodeTexEnvironment")
    image.image = build.image("Sky", np.random.default_rng(3).random((*size, 4)))
    tree.links.new(image.outputs["Color"], background.inputs["Color"])
    scene = translate()
    assert scene.world.color.name == "lamp" and scene.world.strength == 0.5
    assert len(replaced(scene)) == 1


def test_a_sky_is_named_and_loses_its_sun(world, translate):
    _, tree, background = world
    tree.links.new(tree.nodes.new("ShaderNodeTexSky").outputs[0], background.inputs["Color"])
    scene = translate()
    assert scene.lights == () and scene.world.strength == 0.5
    assert len(replaced(scene)) == 1


def test_a_background_for_the_camera_alone_stays_visible(world, translate):
    _, tree, background = world
    rays = tree.nodes.new("ShaderNodeLightPath")
    tree.links.new(rays.outputs["Is Camera Ray"], background.inputs["Strength"])
    found = translate().world
    assert found.strength == 0
    assert found.camera_view.color.name == "lamp" and found.camera_view.strength == 2.0


def test_the_spectrum_of_a_node_has_precedence(world, build, translate):
    from blender_addon import compat
    from blender_addon.translate.spectra.stored import store_spectrum
    from spectral_core.spectra.catalogue import illuminant

    _, _, background = world
    lamp = build.light("POINT")
    emission = next(node for node in compat.use_nodes(lamp.data).nodes if node.type == "EMISSION")
    for owner in (background, emission):
        store_spectrum(owner.spectral, illuminant("FL11"))
    store_spectrum(lamp.data.spectral, illuminant("HP1"))
    scene = translate()
    assert scene.world.color.name == scene.lights[0].color.name == "FL11"


def test_the_spectrum_of_a_lamp_replaces_the_temperature_of_its_nodes(build, translate):
    from blender_addon import compat
    from blender_addon.translate.spectra.stored import store_spectrum
    from spectral_core.spectra.catalogue import illuminant

    lamp = build.light("POINT")
    tree = compat.use_nodes(lamp.data)
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    tree.links.new(tree.nodes.new("ShaderNodeBlackbody").outputs[0], emission.inputs["Color"])
    store_spectrum(lamp.data.spectral, illuminant("HP1"))
    (light,) = translate().lights
    assert light.color.name == "HP1"


def test_the_spectra_of_two_backgrounds_are_added(world, translate):
    """Only the strongest was used."""
    from blender_addon.translate.spectra.stored import store_spectrum
    from spectral_core.spectra.catalogue import illuminant
    from spectral_core.spectra.observer import xyz_of

    made, tree, first = world
    made.spectral.source = "NONE"
    second, add = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeAddShader")
    store_spectrum(first.spectral, illuminant("HP1"))
    store_spectrum(second.spectral, illuminant("D65"))
    for number, node in enumerate((first, second)):
        tree.links.new(node.outputs[0], add.inputs[number])
    tree.links.new(add.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_WORLD").inputs["Surface"])
    scene = translate()
    assert scene.world.strength == pytest.approx(1.25) and not scene.notes
    at = np.arange(380.5, 780, 0.25)
    parts = [(0.25, illuminant("HP1")), (1.0, illuminant("D65"))]
    expected = sum(amount * part.at(at) / xyz_of(part)[1] for amount, part in parts)
    color = scene.world.color
    np.testing.assert_allclose(color.at(at) / xyz_of(color)[1] * 1.25, expected, atol=1e-5 * expected.max())


def test_a_spectrum_under_a_pattern_is_shown_in_its_color(world, translate):
    """The color of the Background node's socket was used, without a note."""
    from blender_addon.translate.spectra.stored import store_spectrum
    from spectral_core.spectra.catalogue import illuminant

    made, tree, background = world
    made.spectral.source = "NONE"
    store_spectrum(background.spectral, illuminant("HP1"))
    noise = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(noise.outputs[0], background.inputs["Strength"])
    scene = translate()
    assert any("the color of the spectrum was used" in note.message for note in scene.notes)
    mean = scene.world.color.pixels[..., :3].mean(axis=(0, 1))
    assert mean[0] > 2 * mean[2] > 0 or mean[2] <= 0 < mean[0]  # sodium is orange, the socket's color gray


@pytest.mark.parametrize("is_node", [False, True])
def test_a_negative_strength_removes_the_light_of_the_spectrum(world, translate, is_node):
    """It was dark; as the number of a Value node also without a spectrum."""
    made, tree, background = world
    background.inputs["Strength"].default_value = -0.25
    if is_node:
        value = tree.nodes.new("ShaderNodeValue")
        value.outputs[0].default_value = -0.25
        tree.links.new(value.outputs[0], background.inputs["Strength"])
    scene = translate()
    assert scene.world.color.name == "lamp" and scene.world.strength == -0.5
    assert replaced(scene) == []
    made.spectral.source = "NONE"
    assert translate().world.color.pixels.max() < 0
