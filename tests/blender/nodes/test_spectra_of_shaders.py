# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra of materials and nodes reach every shader that has a color, volumes too, or a note names what has none."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.scene import leaves
from spectral_core.spectra.spectrum import Reflectance, SpectralGrid, Spectrum

bpy = pytest.importorskip("bpy")

GRID = SpectralGrid.uniform(400.0, 700.0, 20.0)
SURFACES = (
    "ShaderNodeSubsurfaceScattering", "ShaderNodeBsdfSheen", "ShaderNodeBsdfHair", "ShaderNodeBsdfHairPrincipled",
    "ShaderNodeBsdfMetallic",
)  # fmt: skip
VOLUMES = ("ShaderNodeVolumeScatter", "ShaderNodeVolumeAbsorption", "ShaderNodeVolumePrincipled")


def give(owner, name="given"):
    from blender_addon.translate.spectra.stored import store_spectrum

    store_spectrum(owner.spectral, Reflectance(name, GRID, np.linspace(0.1, 0.9, GRID.size)))


@pytest.mark.parametrize("of_node", [False, True])
@pytest.mark.parametrize("shader", SURFACES)
def test_every_shader_has_the_spectrum(build, surface, shader, of_node):
    material = build.material(shader=shader)
    node = material.node_tree.nodes["shader"]
    if hasattr(node, "fresnel_type"):
        node.fresnel_type = "PHYSICAL_CONDUCTOR"
    if hasattr(node, "parametrization"):
        node.parametrization = "MELANIN"
    give(node if of_node else material)
    found, notes = surface(material)
    assert found.color.name == "given"
    assert getattr(found, "is_fur", True)
    assert not any("spectrum" in note for note in notes)


def test_gloss_over_subsurface_light_stays_white(build, surface):
    material = build.material(shader="ShaderNodeSubsurfaceScattering")
    tree = material.node_tree
    both, gloss = tree.nodes.new("ShaderNodeAddShader"), tree.nodes.new("ShaderNodeBsdfGlossy")
    tree.links.new(tree.nodes["shader"].outputs[0], both.inputs[0])
    tree.links.new(gloss.outputs[0], both.inputs[1])
    tree.links.new(both.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    give(material)
    found, _ = surface(material)
    assert [isinstance(leaf.color, Spectrum) for leaf in leaves(found)] == [True, False]


def test_a_spectrum_without_a_shader_to_color_is_named(build, surface):
    material = build.material(shader="ShaderNodeEmission")
    give(material)
    _, notes = surface(material)
    assert any("colors none of its shaders" in note for note in notes)


def fog(build, shader):
    material = build.material(shader=shader)
    tree = material.node_tree
    output, node = tree.nodes["Material Output"], tree.nodes["shader"]
    tree.links.clear()
    tree.links.new(node.outputs[0], output.inputs["Volume"])
    return material, node, output


@pytest.mark.parametrize("of_node", [False, True])
@pytest.mark.parametrize("shader", VOLUMES)
def test_a_volume_has_the_spectrum(build, translate, shader, of_node):
    material, node, _ = fog(build, shader)
    give(material, "of the material")
    if of_node:
        give(node, "of the node")
    build.plane(material=material)
    medium = translate().materials[0].medium
    found = next(each for each in (medium.extinction, medium.color) if isinstance(each, Spectrum))
    assert found.name.endswith("of the node" if of_node else "of the material")


def test_the_spectrum_of_a_material_with_a_surface_is_that_of_the_surface(build, translate):
    material, _, output = fog(build, "ShaderNodeVolumeScatter")
    tree = material.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeBsdfGlass").outputs[0], output.inputs["Surface"])
    give(material)
    build.plane(material=material)
    made = translate().materials[0]
    assert made.surface.color.name == "given"
    assert not isinstance(made.medium.extinction, Spectrum)


@pytest.mark.parametrize("of_node", [False, True])
def test_a_sum_of_volumes_names_a_spectrum_that_it_cannot_have(build, translate, of_node):
    material, node, output = fog(build, "ShaderNodeVolumeScatter")
    tree = material.node_tree
    both = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(node.outputs[0], both.inputs[0])
    tree.links.new(both.outputs[0], output.inputs["Volume"])
    give(node if of_node else material)
    build.plane(material=material)
    scene = translate()
    words = "counts as its color" if of_node else "does not color 'Add Shader'"
    assert any(words in note.message for note in scene.notes)
    if of_node:  # more red than blue is scattered
        assert np.ptp(scene.materials[0].medium.extinction.linear_rgb) > 0.2


@pytest.mark.parametrize("socket", ["Absorption Color", "Color Attribute"])
def test_inputs_that_a_spectrum_leaves_out_are_named(build, translate, socket):
    material, node, _ = fog(build, "ShaderNodeVolumePrincipled")
    give(material)
    node.inputs[socket].default_value = (0.2, 0.4, 0.1, 1.0) if socket == "Absorption Color" else "tint"
    build.plane(material=material)
    assert any(f"{socket} is left out" in note.message for note in translate().notes)
