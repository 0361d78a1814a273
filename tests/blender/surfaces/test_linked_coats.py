# SPDX-License-Identifier: GPL-3.0-or-later
"""Coats of a Principled BSDF whose index of refraction is linked, and may be any number."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")


def test_a_linked_index_of_a_coat_is_at_least_1(build, surface):
    """As in Cycles: below 1 the coat would reflect everything at grazing angles."""
    made = build.material(shader="ShaderNodeBsdfPrincipled", Coat_Weight=1.0)
    tree = made.node_tree
    value = tree.nodes.new("ShaderNodeValue")
    tree.links.new(value.outputs[0], tree.nodes["shader"].inputs["Coat IOR"])
    for given, expected in ((0.5, 1.0), (1.25, 1.25)):
        value.outputs[0].default_value = given
        found, _ = surface(made)
        assert found.coat_ior == expected


def test_an_emission_below_such_a_coat_is_dimmed_as_by_an_index_of_1(build, surface):
    made = build.material(shader="ShaderNodeBsdfPrincipled", Coat_Weight=1.0, Emission_Strength=1.0)
    tree = made.node_tree
    value = tree.nodes.new("ShaderNodeValue")
    tree.links.new(value.outputs[0], tree.nodes["shader"].inputs["Coat IOR"])
    colors = []
    for given in (0.5, 1.0, 1.25):
        value.outputs[0].default_value = given
        colors.append(repr(surface(made)[0].emission_color))
    assert colors[0] == colors[1] != colors[2]


def test_a_tinted_coat_of_part_weight_tints_that_share_of_the_emission(build, translate):
    """Seen straight on: the rest of the surface, without coat, keeps its color."""
    material = build.material(shader="ShaderNodeBsdfPrincipled")
    node = material.node_tree.nodes["shader"]
    values = {"Emission Strength": 1.0, "Coat Weight": 0.5, "Coat IOR": 1.5}
    for name, value in values.items():
        node.inputs[name].default_value = value
    node.inputs["Emission Color"].default_value = (1, 1, 1, 1)
    node.inputs["Coat Tint"].default_value = (0.9, 0.6, 0.2, 1)
    build.plane(material=material)
    build.camera()
    program = translate().materials[0].surface.emission_color.program
    up = (np.zeros(1), np.zeros(1), np.ones(1))
    found = program.evaluate(lambda name, shift: up)
    np.testing.assert_allclose(found, [(1 - 0.5 * 0.04) * (0.5 + 0.5 * np.array([0.9, 0.6, 0.2]))], rtol=1e-5)
