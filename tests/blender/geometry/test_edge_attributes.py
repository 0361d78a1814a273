# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes of edges at the vertices equal those that Blender itself converts."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.translate.meshes import triangles  # noqa: E402


def converted(obj, kind):
    """The mesh with the attribute "Edges" stored by geometry nodes at its vertices as "Vertices"."""
    tree = bpy.data.node_groups.new("Tree", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    entry, last = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    read = tree.nodes.new("GeometryNodeInputNamedAttribute")
    store = tree.nodes.new("GeometryNodeStoreNamedAttribute")
    read.data_type = "QUATERNION" if kind == "QUATERNION" else "FLOAT_COLOR"
    store.data_type, store.domain = kind, "POINT"
    read.inputs["Name"].default_value, store.inputs["Name"].default_value = "Edges", "Vertices"
    tree.links.new(entry.outputs[0], store.inputs[0])
    value = next(s for s in store.inputs if s.name == "Value" and s.enabled)
    tree.links.new(next(s for s in read.outputs if s.enabled), value)
    tree.links.new(store.outputs[0], last.inputs[0])
    obj.modifiers.new("Tree", "NODES").node_group = tree
    return obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data


@pytest.mark.parametrize("output", ["attribute", "attribute_factor", "attribute_alpha"])
@pytest.mark.parametrize(
    ("kind", "field", "scale"),
    [
        ("BYTE_COLOR", "color", 1.0),
        ("FLOAT_COLOR", "color", 3.0),
        ("QUATERNION", "value", 1.0),
        ("QUATERNION", "value", 0.0),
        ("QUATERNION", "value", (1.0, 0.0, 0.0, 0.0)),
    ],
)
def test_edges(blender, kind, field, scale, output):
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=5, y_subdivisions=4)
    obj = bpy.context.object
    layer = obj.data.attributes.new("Edges", kind, "EDGE")
    random = np.random.default_rng(11)
    values = random.random((len(layer.data), 4)) if field == "color" else random.normal(size=(len(layer.data), 4))
    layer.data.foreach_set(field, (np.array(scale) * values).ravel().astype(np.float32))
    mesh = converted(obj, kind)
    count = len(mesh.loops)
    corners = np.empty(count, np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    found, expected = (
        triangles._values(mesh, mesh.attributes[name], corners, output) for name in ("Edges", "Vertices")
    )
    np.testing.assert_allclose(found, expected, atol=2e-6)
