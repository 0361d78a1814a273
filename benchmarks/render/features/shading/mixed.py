# SPDX-License-Identifier: GPL-3.0-or-later
"""Contents of real files beside single nodes: groups, drivers, attributes, unusual meshes and transforms, emission."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage

# --- node trees ----------------------------------------------------------------------------------------------------


def _group(name: str, inner: Any | None = None) -> Any:
    """A group that brightens its color; or one that passes it through another group."""
    tree = bpy.data.node_groups.new(name, "ShaderNodeTree")
    tree.interface.new_socket("Color", in_out="INPUT", socket_type="NodeSocketColor")
    tree.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    if inner is None:
        node = tree.nodes.new("ShaderNodeGamma")
        node.inputs["Gamma"].default_value = 2.0
        tree.links.new(start.outputs[0], node.inputs["Color"])
    else:
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = inner
        tree.links.new(start.outputs[0], node.inputs[0])
    tree.links.new(node.outputs[0], end.inputs[0])
    return tree


def _groups(stage: Stage) -> None:
    node = stage.node("ShaderNodeGroup")
    node.node_tree = _group("Outer", _group("Inner"))
    node.inputs[0].default_value = (0.8, 0.5, 0.3, 1)
    stage.into_color(node.outputs[0])


def _group_of_shader(stage: Stage) -> None:
    tree = bpy.data.node_groups.new("Shader", "ShaderNodeTree")
    tree.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    rough = tree.interface.new_socket("Roughness", in_out="INPUT", socket_type="NodeSocketFloat")
    rough.default_value = 0.9
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    tree.links.new(start.outputs[0], node.inputs["Roughness"])
    tree.links.new(node.outputs[0], end.inputs[0])
    group = stage.node("ShaderNodeGroup")
    group.node_tree = tree
    group.inputs[0].default_value = 0.3
    stage.link(group.outputs[0], stage.tree().nodes["output"].inputs["Surface"])


def _muted_node(stage: Stage) -> None:
    node = stage.node("ShaderNodeInvert", Color=(0.2, 0.5, 0.3, 1))
    node.mute = True
    stage.into_color(node.outputs[0])


def _muted_link(stage: Stage) -> None:
    node = stage.node("ShaderNodeTexChecker")
    stage.into_color(node.outputs[0])
    stage.tree().links[-1].is_muted = True


def _reroutes(stage: Stage) -> None:
    source: Any = stage.node("ShaderNodeTexChecker")
    for _ in range(4):
        reroute = stage.node("NodeReroute")
        stage.link(source.outputs[0], reroute.inputs[0])
        source = reroute
    stage.into_color(source.outputs[0])


def _driver(stage: Stage) -> None:
    curve = stage.material_of_ball.node_tree.nodes["shader"].inputs["Color"].driver_add("default_value", 0)
    curve.driver.type, curve.driver.expression = "SCRIPTED", "0.1 + 0.2 * 2"


def _frame_driver(stage: Stage) -> None:
    stage.scene.frame_set(7)
    curve = stage.ball.driver_add("location", 0)
    curve.driver.type, curve.driver.expression = "SCRIPTED", "frame / 10"


feature("mixed/groups in groups", _groups)
feature("mixed/group that holds a shader", _group_of_shader)
feature("mixed/muted node", _muted_node)
feature("mixed/muted link", _muted_link)
feature("mixed/reroutes", _reroutes)
feature("mixed/driven color", _driver)
feature("mixed/driven by the frame", _frame_driver)

# --- attributes ----------------------------------------------------------------------------------------------------


def _attribute(kind: str, domain: str, node: str) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        mesh = stage.ball.data
        layer = mesh.attributes.new("Tint", kind, domain)
        count = {"POINT": len(mesh.vertices), "CORNER": len(mesh.loops), "FACE": len(mesh.polygons)}[domain]
        ramp = (np.arange(count) % 17) / 17
        name, width = {"FLOAT": ("value", 1), "FLOAT_VECTOR": ("vector", 3)}.get(kind, ("color", 4))
        values = np.stack([ramp, 1 - ramp, ramp**2, np.ones(count)], axis=-1)[:, :width]
        layer.data.foreach_set(name, values.astype(np.float32).ravel())
        found = stage.node(node)
        setattr(found, "layer_name" if node == "ShaderNodeVertexColor" else "attribute_name", "Tint")
        stage.into_color(found.outputs["Color"])

    return build


for _kind in ("FLOAT_COLOR", "BYTE_COLOR"):
    for _domain in ("POINT", "CORNER"):
        feature(
            f"mixed/color attribute {_kind.lower()} {_domain.lower()}",
            _attribute(_kind, _domain, "ShaderNodeVertexColor"),
        )
feature("mixed/attribute of faces", _attribute("FLOAT_VECTOR", "FACE", "ShaderNodeAttribute"))
feature("mixed/attribute of numbers", _attribute("FLOAT", "POINT", "ShaderNodeAttribute"))


def _missing_attribute(stage: Stage) -> None:
    stage.into_color(stage.node("ShaderNodeAttribute", attribute_name="Nothing").outputs["Color"])


feature("mixed/attribute that is missing", _missing_attribute)


def _instancer(stage: Stage) -> None:
    """Instances with their own colors and random numbers."""
    node = stage.node("ShaderNodeObjectInfo")
    stage.into_color(node.outputs["Color"])
    stage.ball.color = (0.1, 0.7, 0.3, 1)
    group = bpy.data.collections.new("Group")
    group.objects.link(stage.ball)
    empty = stage.object("Empty", None, (2.1, 0, 0))
    empty.instance_type, empty.instance_collection = "COLLECTION", group
    empty.color = (0.9, 0.1, 0.1, 1)


feature("mixed/object color of instances", _instancer)

# --- transforms and meshes -----------------------------------------------------------------------------------------


def _bumpy(stage: Stage, **values: Any) -> None:
    noise, bump = stage.node("ShaderNodeTexNoise", Scale=4.0), stage.node("ShaderNodeBump", **values)
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], noise.inputs["Vector"])
    stage.link(noise.outputs[0], bump.inputs["Height"])
    stage.link(bump.outputs[0], stage.tree().nodes["shader"].inputs["Normal"])


feature("mixed/bump on a mirrored object", lambda s: (_bumpy(s), setattr(s.ball, "scale", (-1, 1, 1))))
feature("mixed/bump on a stretched object", lambda s: (_bumpy(s), setattr(s.ball, "scale", (1.5, 0.7, 1))))
feature("mixed/bump turned and stretched", lambda s: (
    _bumpy(s), setattr(s.ball, "scale", (1.4, 0.8, 0.6)),
    setattr(s.ball, "rotation_euler", (0.5, 0.7, 0.2))))  # fmt: skip
feature("mixed/glass mirrored", lambda s: (s.shader("ShaderNodeBsdfGlass"), setattr(s.ball, "scale", (-1, 1, 1))), 2)


def _displaced(method: str) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        stage.material_of_ball.displacement_method = method
        noise, node = stage.node("ShaderNodeTexNoise", Scale=2.0), stage.node("ShaderNodeDisplacement", Scale=0.4)
        stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], noise.inputs["Vector"])
        stage.link(noise.outputs[0], node.inputs["Height"])
        stage.link(node.outputs[0], stage.tree().nodes["output"].inputs["Displacement"])

    return build


for _method in ("BUMP", "DISPLACEMENT", "BOTH"):
    feature(f"mixed/displacement {_method.lower()}", _displaced(_method))


def _sharp(stage: Stage) -> None:
    """Sharp edges and flat faces in one mesh."""
    mesh = stage.ball.data
    values = np.arange(len(mesh.edges)) % 5 == 0
    layer = mesh.attributes.new("sharp_edge", "BOOLEAN", "EDGE")
    layer.data.foreach_set("value", values)


feature("mixed/sharp edges", _sharp)
feature("mixed/empty material slot", lambda s: (s.ball.data.materials.clear(), s.ball.data.materials.append(None)))


def _broken_mesh(stage: Stage) -> None:
    """Faces without area, loose points and edges, a polygon of many corners."""
    data = bpy.data.meshes.new("Broken")
    corners = [(np.cos(a), 0.3 * np.sin(3 * a) * 0, 1 + np.sin(a)) for a in np.linspace(0, 6.1, 12)]
    points = [*corners, (0, 0, 2), (0, 0, 2), (0, 0, 2), (3, 3, 3)]
    data.from_pydata(points, [(12, 15)], [tuple(range(12)), (12, 13, 14)])
    data.materials.append(stage.material_of_ball)
    bpy.data.objects.remove(stage.ball)
    stage.ball = stage.object("Broken", data, (0, 0, 0.1))


feature("mixed/broken mesh", _broken_mesh)
