# SPDX-License-Identifier: GPL-3.0-or-later
"""Attribute nodes of type Object read the properties that Cycles reads as numbers, and 0 of all others."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.translate.shading import attributes  # noqa: E402

NONE = (0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ([True, False, True], NONE),
        ("12", NONE),
        (b"12", NONE),
        ({"7": 1.0, "8": 2.0}, NONE),
        ([1.0, 2.0, 3.0, 4.0, 5.0], NONE),
        (True, (1.0, 1.0, 1.0, 1.0)),
        (3, (3.0, 3.0, 3.0, 1.0)),
        ([4, 5], (4.0, 5.0, 0.0, 1.0)),
        ([0.5, 0.25, 2.0, 0.125], (0.5, 0.25, 2.0, 0.125)),
    ],
)
def test_custom_properties(blender, value, expected):
    owner = bpy.data.objects.new("Owner", None)
    owner["tone"] = value
    assert attributes._first((owner,), "tone") == expected


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("location", (0.5, 0.25, 2.0, 1.0)),
        ("location[1]", NONE),
        ("location.x", NONE),
        ('["tone"]', (4.0, 5.0, 0.0, 1.0)),
        ('["tone"][1]', NONE),
        ("lock_location", NONE),
        ("rotation_mode", NONE),
        ("name", NONE),
        ("pass_index", (7.0, 7.0, 7.0, 1.0)),
        ("hide_render", (1.0, 1.0, 1.0, 1.0)),
    ],
)
def test_paths(blender, path, expected):
    owner = bpy.data.objects.new("12", None)
    owner.location, owner["tone"] = (0.5, 0.25, 2.0), [4, 5]
    owner.pass_index, owner.hide_render, owner.lock_location = 7, True, (True, True, False)
    assert attributes._first((owner,), path) == expected


def test_a_text_gives_way_to_the_number_of_the_data(blender):
    owner = bpy.data.objects.new("Owner", bpy.data.meshes.new("Owner"))
    owner["tone"], owner.data["tone"] = "12", 0.5
    assert np.allclose(attributes._first((owner, owner.data), "tone"), (0.5, 0.5, 0.5, 1.0))


@pytest.mark.parametrize(
    ("value", "is_noted"),
    [(np.nan, True), ([1.0, -np.inf], True), (2.5, False), ("nan", False), ({"7": 1.0}, False), ([np.nan] * 2, True)],
)
def test_a_property_that_is_no_finite_number_is_noted(blender, value, is_noted):
    """It was read as 0 without a note."""
    owner = bpy.data.objects.new("Owner", bpy.data.meshes.new("Owner"))
    owner["tone"] = value
    assert attributes._is_not_finite((None, owner, owner.data), "tone") is is_noted
    assert not attributes._is_not_finite((None, owner), "other")


@pytest.mark.parametrize("custom", [None, 0.25])
def test_the_color_of_an_instance_is_that_of_its_instancer(build, translate, custom):
    """Blender gives the objects of a collection the color of the empty that shows it, but not its custom properties."""
    material = build.material()
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeAttribute")
    node.attribute_type, node.attribute_name = "OBJECT", "color"
    tree.links.new(node.outputs["Color"], tree.nodes["shader"].inputs["Color"])
    build.plane(material=material)
    (shown,) = bpy.context.scene.objects
    shown.color = (0.1, 0.2, 0.3, 0.4)
    if custom is not None:
        shown["color"] = custom
    collection = bpy.data.collections.new("Shown")
    bpy.context.scene.collection.objects.unlink(shown)
    collection.objects.link(shown)
    empty = bpy.data.objects.new("Empty", None)
    bpy.context.scene.collection.objects.link(empty)
    empty.instance_type, empty.instance_collection, empty.color = "COLLECTION", collection, (0.9, 0.8, 0.7, 0.6)
    (instance,) = translate().instances
    expected = (0.9, 0.8, 0.7, 0.6) if custom is None else (custom, custom, custom, 1.0)
    assert np.allclose(instance.attributes[0][1], expected)
