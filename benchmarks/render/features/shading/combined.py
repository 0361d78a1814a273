# SPDX-License-Identifier: GPL-3.0-or-later
"""Combinations of real files: odd values, attributes of every domain, groups with unlinked inputs, hidden emitters."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


def _noise(stage: Stage, scale: float = 4.0, output: int = 0) -> Any:
    node = stage.node("ShaderNodeTexNoise", Scale=scale)
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], node.inputs["Vector"])
    return node.outputs[output]


# --- normals that lean far away -------------------------------------------------------------------------------------


def _bump(invert: bool, distance: float, shader: str) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        made = stage.shader(shader)
        node = stage.node("ShaderNodeBump", Strength=1.6, Distance=distance, invert=invert)
        stage.link(_noise(stage), node.inputs["Height"])
        stage.link(node.outputs[0], made.inputs["Normal"])

    return build


for _shader in ("BsdfDiffuse", "BsdfPrincipled"):
    feature(f"combined/steep bump of {_shader}", _bump(False, 1.0, f"ShaderNode{_shader}"))
    feature(f"combined/steep bump of {_shader}, inverted", _bump(True, 1.0, f"ShaderNode{_shader}"))


def _two_maps(stage: Stage) -> None:
    layers = stage.ball.data.uv_layers
    uv = np.zeros(2 * len(stage.ball.data.loops), np.float32)
    layers[0].uv.foreach_get("vector", uv)
    turned = uv.reshape(-1, 2)[:, ::-1] * (3.0, -1.7) + (0.2, 0.4)
    layers.new(name="Second").uv.foreach_set("vector", turned.astype(np.float32).ravel())


def _named_tangent(stage: Stage) -> None:
    _two_maps(stage)
    shader = stage.shader("ShaderNodeBsdfAnisotropic", Roughness=0.35, Anisotropy=0.8)
    node = stage.node("ShaderNodeTangent", direction_type="UV_MAP", uv_map="Second")
    stage.link(node.outputs[0], shader.inputs["Tangent"])


def _radial_tangent(axis: str) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        shader = stage.shader("ShaderNodeBsdfAnisotropic", Roughness=0.4, Anisotropy=-0.7)
        node = stage.node("ShaderNodeTangent", direction_type="RADIAL", axis=axis)
        stage.link(node.outputs[0], shader.inputs["Tangent"])

    return build


feature("combined/tangent of a UV map by name", _named_tangent)
for _axis in "XY":
    feature(f"combined/radial tangent around {_axis}", _radial_tangent(_axis))

# --- colors beyond 1 ------------------------------------------------------------------------------------------------

for _shader, _name in (("BsdfDiffuse", "Color"), ("BsdfPrincipled", "Base_Color"), ("BsdfTranslucent", "Color")):
    _bright: dict[str, Any] = {_name: (1.5, 0.7, 0.2, 1)}
    feature(f"combined/{_shader} that reflects more than arrives",
            lambda s, shader=_shader, given=_bright: s.shader(f"ShaderNode{shader}", **given))  # fmt: skip
feature("combined/specular tint beyond 1",
        lambda s: s.shader("ShaderNodeBsdfPrincipled", Specular_Tint=(3, 1, 0.4, 1), Roughness=0.3))  # fmt: skip


def _bright_texture(stage: Stage) -> None:
    node = stage.node("ShaderNodeVectorMath", operation="SCALE")
    node.inputs["Scale"].default_value = 3.0
    stage.link(_noise(stage, 3.0, 1), node.inputs[0])
    stage.into_color(node.outputs[0])


feature("combined/texture beyond 1", _bright_texture)

# --- attributes -----------------------------------------------------------------------------------------------------


def _attribute(kind: str, domain: str, output: str) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        layer = stage.ball.data.attributes.new("Mine", kind, domain)
        count = len(layer.data)
        ramp = (np.arange(count) % 13) / 13
        if kind == "INT":
            layer.data.foreach_set("value", (np.arange(count) % 3).astype(np.int32))
        else:
            values = np.stack([ramp, 1 - ramp], axis=-1)[:, : 2 if kind == "FLOAT2" else 1]
            layer.data.foreach_set("vector" if kind == "FLOAT2" else "value", values.astype(np.float32).ravel())
        stage.glow(stage.node("ShaderNodeAttribute", attribute_name="Mine").outputs[output])

    return build


for _kind, _domain, _output in (
    ("INT", "FACE", "Color"), ("FLOAT2", "CORNER", "Fac"), ("FLOAT2", "POINT", "Vector"), ("FLOAT", "EDGE", "Fac"),
):  # fmt: skip
    feature(f"combined/attribute {_kind.lower()} {_domain.lower()} {_output}", _attribute(_kind, _domain, _output))


def _vertex_group(stage: Stage) -> None:
    group = stage.ball.vertex_groups.new(name="Weights")
    group.add(list(range(0, len(stage.ball.data.vertices), 2)), 0.8, "REPLACE")
    stage.glow(stage.node("ShaderNodeAttribute", attribute_name="Weights").outputs["Fac"])


feature("combined/attribute of a vertex group", _vertex_group)


def _stored_on_instances(stage: Stage) -> None:
    """Geometry nodes put balls on a grid and store a color on each instance."""
    tree = bpy.data.node_groups.new("Instances", "GeometryNodeTree")
    for way in ("OUTPUT", "INPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    new = tree.nodes.new
    grid, ball, place = (new(f"GeometryNode{k}") for k in ("MeshGrid", "MeshUVSphere", "InstanceOnPoints"))
    for socket, value in zip(grid.inputs, (3.0, 3.0, 4, 4), strict=False):
        socket.default_value = value
    ball.inputs["Radius"].default_value = 0.35
    painted, stored, random = new("GeometryNodeSetMaterial"), new("GeometryNodeStoreNamedAttribute"), None
    painted.inputs["Material"].default_value = stage.material_of_ball
    stored.domain, stored.data_type = "INSTANCE", "FLOAT_COLOR"
    stored.inputs["Name"].default_value = "own"
    random = new("FunctionNodeRandomValue")
    random.data_type = "FLOAT_VECTOR"
    value = next(socket for socket in stored.inputs if socket.name == "Value" and socket.enabled)
    for source, target in (
        (grid.outputs[0], place.inputs["Points"]), (ball.outputs[0], painted.inputs[0]),
        (painted.outputs[0], place.inputs["Instance"]), (place.outputs[0], stored.inputs[0]),
        (random.outputs[0], value), (stored.outputs[0], new("NodeGroupOutput").inputs[0]),
    ):  # fmt: skip
        tree.links.new(source, target)
    made = stage.object("Instances", bpy.data.meshes.new("Empty"), (0, -1, 0.6))
    made.modifiers.new("Instances", "NODES").node_group = tree
    node = stage.node("ShaderNodeAttribute", attribute_name="own", attribute_type="INSTANCER")
    stage.into_color(node.outputs["Color"])


feature("combined/attribute stored on instances", _stored_on_instances)

# --- node groups ----------------------------------------------------------------------------------------------------


def _unlinked_vector(stage: Stage) -> None:
    """A texture in a group whose Vector nobody links: it has the group's value, not the generated coordinates."""
    tree = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    vector = tree.interface.new_socket("Vector", in_out="INPUT", socket_type="NodeSocketVector")
    vector.default_value, vector.hide_value = (0.3, 0.1, 0.7), True
    tree.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    noise = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(start.outputs[0], noise.inputs["Vector"])
    tree.links.new(noise.outputs["Color"], end.inputs[0])
    node = stage.node("ShaderNodeGroup")
    node.node_tree = tree
    stage.into_color(node.outputs[0])


feature("combined/group whose vector is not linked", _unlinked_vector)


def _panel_limits(stage: Stage) -> None:
    node = stage.node("ShaderNodeTexNoise", Scale=3.0)
    node.texture_mapping.use_min, node.texture_mapping.min = True, (0.0, 0.0, 0.0)
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], node.inputs[0])
    stage.glow(node.outputs[1])


feature("combined/texture mapping with a lower limit", _panel_limits)

# --- rays and emitters ----------------------------------------------------------------------------------------------


def _cube(stage: Stage, strength: float = 15.0) -> Any:
    return stage.cube(stage.material("Glow", "ShaderNodeEmission", Strength=strength), (1.6, -1.0, 1.0), 0.5)


def _linked_cube(stage: Stage) -> None:
    chosen = bpy.data.collections.new("Receivers")
    chosen.objects.link(stage.floor)
    _cube(stage).light_linking.receiver_collection = chosen


def _opaque_shadow(stage: Stage) -> None:
    material = stage.material("Clear", "ShaderNodeBsdfTransparent", Color=(0.8, 0.5, 0.9, 1))
    material.use_transparent_shadow = False
    stage.plane(2.5, material, (0.5, -0.6, 2.2), (0.3, 0.1, 0))


def _transparent_once(stage: Stage) -> None:
    tree = stage.tree()
    path, clear, mix = (stage.node(f"ShaderNode{k}") for k in ("LightPath", "BsdfTransparent", "MixShader"))
    above = stage.node("ShaderNodeMath", operation="GREATER_THAN")
    stage.link(path.outputs["Transparent Depth"], above.inputs[0])
    for source, target in zip((above, clear, tree.nodes["shader"]), mix.inputs, strict=True):
        stage.link(source.outputs[0], target)
    stage.link(mix.outputs[0], tree.nodes["output"].inputs[0])


def _lamp_in_medium(stage: Stage) -> None:
    stage.shader("ShaderNodeBsdfGlass", IOR=1.1)
    node = stage.node("ShaderNodeVolumeAbsorption", Color=(0.3, 0.8, 0.4, 1), Density=1.5)
    stage.link(node.outputs[0], stage.tree().nodes["output"].inputs["Volume"])
    stage.light("POINT", 40.0, (0, 0, 1), shadow_soft_size=0.2)


def _plate(stage: Stage) -> None:
    """The camera sees an image over its frame, the scene is lit by another color."""
    background, world = stage.set_world((1, 1, 1)), stage.world
    place, picture, path, mix = (
        stage.node(f"ShaderNode{k}", world) for k in ("TexCoord", "TexImage", "LightPath", "Mix")
    )
    picture.image, mix.data_type = stage.image(), "RGBA"
    mix.inputs[6].default_value = (0.2, 0.2, 0.3, 1)
    stage.link(place.outputs["Window"], picture.inputs[0])
    stage.link(path.outputs["Is Camera Ray"], mix.inputs[0])
    stage.link(picture.outputs[0], mix.inputs[7])
    stage.link(mix.outputs[2], background.inputs[0])


feature("combined/emissive cube not visible to diffuse", lambda s: setattr(_cube(s), "visible_diffuse", False))
feature("combined/emissive cube linked to the floor", _linked_cube)
feature("combined/transparent without transparent shadows", _opaque_shadow)
feature("combined/transparent by Transparent Depth", _transparent_once)
feature("combined/lamp in a medium in glass", _lamp_in_medium, 3)
feature("combined/window coordinates of the world", _plate)
feature("combined/subsurface of scale 0", lambda s: s.shader("ShaderNodeSubsurfaceScattering", Scale=0.0))
feature("combined/lamp whose output is not linked", lambda s: s.tree(s.replace_lamp("POINT", 300.0).data).links.clear())


def _filtered(shader: str, strength: float, **values: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        stage.replace_lamp("AREA", 90.0, size=0.6)
        stage.set_world((0.02, 0.02, 0.02))
        stage.shader(shader, **values)
        stage.scene.cycles.blur_glossy = strength

    return build


for _strength in (0.1, 1.0, 5.0):
    feature(
        f"combined/filter glossy {_strength:g}, mirror",
        _filtered("ShaderNodeBsdfAnisotropic", _strength, Roughness=0.0),
        4,
    )
    feature(
        f"combined/filter glossy {_strength:g}, glass", _filtered("ShaderNodeBsdfGlass", _strength, Roughness=0.0), 4
    )
