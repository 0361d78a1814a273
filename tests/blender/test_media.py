# SPDX-License-Identifier: GPL-3.0-or-later
"""Volume shaders: sums and mixes, phase functions, and media of the world."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


@pytest.fixture
def filled(build):
    """A cube with a volume shader node; returns the node and its tree."""

    def make(kind, **inputs):
        material = build.material()
        tree = material.node_tree
        tree.nodes.remove(tree.nodes["shader"])
        node = tree.nodes.new(kind)
        for name, value in inputs.items():
            node.inputs[name.replace("_", " ")].default_value = value
        output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
        tree.links.new(node.outputs[0], output.inputs["Volume"])
        build.plane(material=material)
        return node, tree, output

    return make


def only_medium(scene):
    return next(material.medium for material in scene.materials if material.medium is not None)


def coefficients(medium):
    extinction = medium.density * np.asarray(medium.extinction.linear_rgb)
    scattered = extinction * np.asarray(medium.color.linear_rgb)
    return scattered, extinction - scattered


def test_principled_absorbs_by_the_root_of_its_absorption_color(filled, translate):
    filled("ShaderNodeVolumePrincipled", Density=2.0, Color=(0.5, 0.5, 0.5, 1), Absorption_Color=(0.0, 0.25, 1.0, 1))
    scattered, absorbed = coefficients(only_medium(translate()))
    assert np.allclose(scattered, 1.0) and np.allclose(absorbed, [1.0, 0.5, 0.0], atol=1e-6)


def test_sums_and_mixes_of_volumes_add_up(filled, translate):
    first, tree, output = filled("ShaderNodeVolumeScatter", Color=(1, 1, 1, 1), Density=1.0, Anisotropy=0.5)
    second, glow = tree.nodes.new("ShaderNodeVolumeAbsorption"), tree.nodes.new("ShaderNodeEmission")
    second.inputs["Color"].default_value, second.inputs["Density"].default_value = (0.0, 0.5, 1.0, 1), 2.0
    glow.inputs["Strength"].default_value = 0.3
    mix, add = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeAddShader")
    mix.inputs[0].default_value = 0.25
    for source, target in (
        (first, mix.inputs[1]),
        (second, mix.inputs[2]),
        (mix, add.inputs[0]),
        (glow, add.inputs[1]),
    ):
        tree.links.new(source.outputs[0], target)
    tree.links.new(add.outputs[0], output.inputs["Volume"])
    scene = translate()
    medium = only_medium(scene)
    scattered, absorbed = coefficients(medium)
    assert np.allclose(scattered, 0.75) and np.allclose(absorbed, [0.5, 0.25, 0.0], atol=1e-6)
    assert (
        medium.emission_strength == pytest.approx(0.3) and medium.lobes[0][1] == pytest.approx(0.5) and not scene.notes
    )


@pytest.mark.parametrize("phase", ["HENYEY_GREENSTEIN", "FOURNIER_FORAND", "DRAINE", "RAYLEIGH", "MIE"])
def test_phase_functions_integrate_to_1(filled, translate, phase):
    node, _, _ = filled("ShaderNodeVolumeScatter")
    if not hasattr(node, "phase"):
        pytest.skip("this Blender has one phase function")
    node.phase = phase
    scene = translate()
    lobes = only_medium(scene).lobes
    assert sum(weight for weight, _, _ in lobes) == pytest.approx(1.0) and not scene.notes
    assert all(weight >= 0 and -1 < g < 1 and alpha >= 0 for weight, g, alpha in lobes)


@pytest.mark.parametrize("backscatter", [0.01, 0.1, 0.3])
def test_lobes_follow_the_phase_function_of_water(backscatter):
    from blender_addon.translate.shading.media.phases import fournier_forand

    cosine = np.linspace(-1.0, 0.0, 2001)
    turned = sum(
        weight * (1 - g * g) / 2 / (1 + g * g - 2 * g * cosine) ** 1.5
        for weight, g, _ in fournier_forand(1.33, backscatter)
    )
    assert np.mean(turned) == pytest.approx(backscatter, rel=0.15)


def test_a_world_can_have_a_medium(build, translate):
    from blender_addon import compat

    world = bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    tree = compat.use_nodes(world)
    node = tree.nodes.new("ShaderNodeVolumeScatter")
    node.inputs["Density"].default_value = 0.2
    tree.links.new(node.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_WORLD").inputs["Volume"])
    scene = translate()
    assert np.allclose(coefficients(scene.world.medium)[0], 0.2 * 0.8) and not scene.notes


def test_a_medium_that_varies_gets_a_note(filled, translate):
    node, tree, _ = filled("ShaderNodeVolumeScatter")
    noise = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(noise.outputs["Color"], node.inputs["Color"])
    assert any("Color varies inside a volume" in note.message for note in translate().notes)
