# SPDX-License-Identifier: GPL-3.0-or-later
"""Coats of a Principled BSDF whose index of refraction is linked, and may be any number."""

from __future__ import annotations

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
