# SPDX-License-Identifier: GPL-3.0-or-later
"""Unusual node trees: long chains, recursive groups, broken attributes, UV maps without area, no hair."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from benchmarks.render.features.compare import render
from benchmarks.render.features.stage import Stage
from blender_addon import jobs


def pixels_of(build: Callable[[Stage], object]) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Colors by this renderer and by Cycles of the stage after ``build``; notes on samples that were not finite."""
    build(Stage(16))
    jobs.records.clear()
    ours = render("SPECTRAL", 1, raw=True)[..., :3]
    lost = sum("not finite" in note.message for record in jobs.records for note in record.notes)
    return ours, render("CYCLES", 1)[..., :3], lost


def _long(stage: Stage) -> None:
    """1,000 Math nodes in a row that add up to one half."""
    value = stage.node("ShaderNodeValue").outputs[0]
    value.default_value = 0.0
    for _ in range(1000):
        node = stage.node("ShaderNodeMath", operation="ADD")
        node.inputs[1].default_value = 0.0005
        stage.link(value, node.inputs[0])
        value = node.outputs[0]
    stage.into_color(value)


def _wide(stage: Stage) -> None:
    """1,000 nodes that read the position, in a tree of sums."""
    layer = []
    for k in range(500):
        node = stage.node("ShaderNodeVectorMath", operation="SCALE")
        node.inputs["Scale"].default_value = 0.002
        stage.link(stage.node("ShaderNodeTexCoord").outputs["Generated" if k % 2 else "UV"], node.inputs[0])
        layer.append(node.outputs[0])
    while len(layer) > 1:
        pairs, rest = zip(layer[::2], layer[1::2], strict=False), layer[-1:] if len(layer) % 2 else []
        layer = [_sum(stage, one, other) for one, other in pairs] + rest
    stage.into_color(layer[0])


def _sum(stage: Stage, one: Any, other: Any) -> Any:
    node = stage.node("ShaderNodeVectorMath", operation="ADD")
    stage.link(one, node.inputs[0])
    stage.link(other, node.inputs[1])
    return node.outputs[0]


def _deep_groups(stage: Stage) -> None:
    """Forty groups within each other."""
    inner = None
    for k in range(40):
        tree = bpy.data.node_groups.new(f"level {k}", "ShaderNodeTree")
        tree.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
        end = tree.nodes.new("NodeGroupOutput")
        source = tree.nodes.new("ShaderNodeGroup" if inner is not None else "ShaderNodeRGB")
        if inner is None:
            source.outputs[0].default_value = (0.2, 0.5, 0.7, 1)
        else:
            source.node_tree = inner
        tree.links.new(source.outputs[0], end.inputs[0])
        inner = tree
    node = stage.node("ShaderNodeGroup")
    node.node_tree = inner
    stage.into_color(node.outputs[0])


def _own_group(stage: Stage) -> None:
    """A group that should contain itself: Blender refuses, and the node stays empty."""
    tree = bpy.data.node_groups.new("ring", "ShaderNodeTree")
    tree.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    end, inside = tree.nodes.new("NodeGroupOutput"), tree.nodes.new("ShaderNodeGroup")
    inside.node_tree = tree
    color = tree.nodes.new("ShaderNodeRGB")
    color.outputs[0].default_value = (0.3, 0.6, 0.2, 1)
    tree.links.new(color.outputs[0], end.inputs[0])
    node = stage.node("ShaderNodeGroup")
    node.node_tree = tree
    stage.into_color(node.outputs[0])


def _broken_attribute(stage: Stage) -> None:
    """One vertex in seven carries no number."""
    mesh = stage.ball.data
    values = np.full(len(mesh.vertices), 0.5, np.float32)
    values[::7] = np.nan
    made = mesh.attributes.new("broken", "FLOAT", "POINT")
    made.data.foreach_set("value", values)
    node = stage.node("ShaderNodeAttribute", attribute_name="broken")
    stage.link(node.outputs["Fac"], stage.shader("ShaderNodeBsdfPrincipled").inputs["Roughness"])


def _without_area(stage: Stage, *, mapped: str) -> None:
    """A UV map that is a point or a line, under a normal map and an anisotropic lobe along its tangent."""
    mesh = stage.ball.data
    uv = np.zeros((len(mesh.loops), 2), np.float32)
    if mapped == "line":
        uv[:, 0] = np.linspace(0, 1, len(mesh.loops))
    mesh.uv_layers[0].uv.foreach_set("vector", uv.ravel())
    shader = stage.shader("ShaderNodeBsdfPrincipled", Roughness=0.4)
    normal = stage.node("ShaderNodeNormalMap")
    normal.inputs["Color"].default_value = (0.5, 0.5, 1.0, 1)
    stage.link(normal.outputs[0], shader.inputs["Normal"])


def _hair(stage: Stage, *, length: float, count: int = 2) -> None:
    """Hair curves of no length, or of one point each."""
    curves = bpy.data.hair_curves.new("Hair")
    curves.add_curves([count] * 20)
    points = np.repeat(np.random.default_rng(1).normal(size=(20, 3)), count, axis=0)
    points += np.array([0, 0, 1]) + np.tile(np.arange(count), 20)[:, None] * np.array([0, 0, length])
    curves.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    stage.object("Hair", curves)


def _divided(stage: Stage, operation: str) -> None:
    """Roughness and normal from an operation that has no value."""
    shader = stage.shader("ShaderNodeBsdfPrincipled")
    node = stage.node("ShaderNodeVectorMath", operation=operation)
    node.inputs[0].default_value = (0, 0, 0)
    if len(node.inputs) > 1:
        node.inputs[1].default_value = (0, 0, 0)
    stage.link(node.outputs[0], shader.inputs["Base Color"])


SCENES: dict[str, Callable[[Stage], object]] = {
    "1,000 nodes in a row": _long,
    "1,000 nodes in a tree of sums": _wide,
    "40 groups within each other": _deep_groups,
    "a group within itself": _own_group,
    "an attribute that is no number": _broken_attribute,
    "a UV map that is a point": lambda s: _without_area(s, mapped="point"),
    "a UV map that is a line": lambda s: _without_area(s, mapped="line"),
    "hair of no length": lambda s: _hair(s, length=0.0),
    "hair of single points": lambda s: _hair(s, length=0.1, count=1),
    "0 / 0 as a color": lambda s: _divided(s, "DIVIDE"),
    "a zero vector, normalized": lambda s: _divided(s, "NORMALIZE"),
    "a zero vector, projected": lambda s: _divided(s, "PROJECT"),
}
