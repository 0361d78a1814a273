# SPDX-License-Identifier: GPL-3.0-or-later
"""Muted nodes, colors of instances, patterns on emissive surfaces: cases from a review of mixed scenes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.scene import Color, Computed, Emission, Film, Instance, Material, World, gray
from spectral_core.scene.geometry import Attribute
from spectral_core.scene.shading import Builder
from tests.render.scenes import lit_plane, looking_down, matrix, plane

bpy = pytest.importorskip("bpy")


def color_of(scene):
    return np.asarray(scene.materials[0].surface.color.linear_rgb)


@pytest.mark.parametrize("through", ["node", "node and reroute"])
def test_an_input_behind_a_muted_node_keeps_its_own_color(build, translate, through):
    material = build.material(Color=(0.9, 0.1, 0.3, 1))
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeInvert")
    node.inputs["Color"].default_value, node.mute = (0.2, 0.5, 0.3, 1), True
    output = node.outputs[0]
    if through != "node":
        reroute = tree.nodes.new("NodeReroute")
        tree.links.new(output, reroute.inputs[0])
        output = reroute.outputs[0]
    tree.links.new(output, tree.nodes["shader"].inputs["Color"])
    build.plane(material=material)
    assert np.allclose(color_of(translate()), (0.9, 0.1, 0.3))


def test_a_muted_node_passes_its_linked_input(build, translate):
    material = build.material()
    tree = material.node_tree
    color, node = tree.nodes.new("ShaderNodeRGB"), tree.nodes.new("ShaderNodeInvert")
    color.outputs[0].default_value, node.mute = (0.1, 0.6, 0.2, 1), True
    tree.links.new(color.outputs[0], node.inputs["Color"])
    tree.links.new(node.outputs[0], tree.nodes["shader"].inputs["Color"])
    build.plane(material=material)
    assert np.allclose(color_of(translate()), (0.1, 0.6, 0.2))


def test_an_instance_shows_the_color_of_its_instancer(build, translate):
    thing = build.plane()
    thing.color = (0.1, 0.7, 0.3, 1)
    group = bpy.data.collections.new("Group")
    group.objects.link(thing)
    empty = build.object("Empty", None, (3, 0, 0))
    empty.instance_type, empty.instance_collection, empty.color = "COLLECTION", group, (0.9, 0.1, 0.1, 1)
    colors = sorted(tuple(np.round(item.color[:3], 3)) for item in translate().instances)
    assert colors == [(0.1, 0.7, 0.3), (0.9, 0.1, 0.1)]


def lit_by(emission):
    """A floor under an emissive square with a green color attribute."""
    pytest.importorskip("mitsuba")
    square = plane(1.0, "square")
    green = np.tile(np.array([0.0, 1.0, 0.0], np.float32), (len(square.positions), 1))
    square = replace(square, attributes=(Attribute("attribute:Tint", green),))
    base = lit_plane(camera=looking_down(1.0, 0.5), film=Film(8, 8, samples=64), world=World(gray(0.0)))
    lamp = Instance("lamp", "square", matrix((3, 0, 2)), ("glow",))
    other = Instance("other", "square", matrix((-3, 0, 2)), ("glow",))  # a second instance of the same mesh
    scene = replace(
        base, meshes=(*base.meshes, square), materials=(*base.materials, Material("glow", emission)),
        instances=(*base.instances, lamp, other),
    )  # fmt: skip
    return render_scene(scene).pixels[..., :3].mean(axis=(0, 1))


def test_emission_from_an_attribute_lights_other_surfaces_in_its_visible_color():
    build = Builder()
    program = Computed(build.program(build.add("vector_input", (), "attribute:Tint", 0)))
    found, expected = lit_by(Emission(program, 5.0)), lit_by(Emission(Color(np.array([0.0, 1.0, 0.0])), 5.0))
    assert expected[1] > 0.05 and found == pytest.approx(expected, rel=0.02, abs=1e-4)


def test_a_coat_dims_and_tints_the_emission_below_it(build, translate):
    """A coat of index 1.5 reflects 4 % at normal incidence; the tint counts once, because light passes it once."""
    sockets = {"Emission_Strength": 1.0, "Coat_Weight": 1.0, "Coat_Tint": (0.5, 1.0, 1.0, 1)}
    build.plane(material=build.material(shader="ShaderNodeBsdfPrincipled", **sockets))
    scene = translate()
    color = scene.materials[0].surface.emission_color
    assert isinstance(color, Computed) and not scene.notes
    up = tuple(np.full(1, value) for value in (0.0, 0.0, 1.0))
    np.testing.assert_allclose(np.ravel(color.program.evaluate(lambda name, shift: up)), [0.48, 0.96, 0.96], rtol=1e-3)
