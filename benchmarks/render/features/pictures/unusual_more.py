# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that few scenes have: another scene behind, islands, portals, caustics, geometry nodes, packed alpha."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


def _noise(stage: Stage, scale: float = 3.0, output: str = "Fac") -> Any:
    node = stage.node("ShaderNodeTexNoise", Scale=scale)
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], node.inputs["Vector"])
    return node.outputs[output]


# --- geometry nodes ---------------------------------------------------------------------------------------------------


def _geometry(stage: Stage, *steps: tuple[str, dict[str, Any], dict[str, Any]]) -> Any:
    """The ball through a chain of geometry nodes, each with its settings and inputs; returns the tree."""
    tree = bpy.data.node_groups.new("Chain", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    last = tree.nodes.new("NodeGroupInput").outputs[0]
    for kind, settings, inputs in steps:
        node = tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        for socket in node.inputs:
            if socket.enabled and socket.name in inputs:
                value = inputs[socket.name]
                if isinstance(value, str) and value.startswith("node:"):
                    tree.links.new(next(s for s in tree.nodes.new(value[5:]).outputs if s.enabled), socket)
                else:
                    socket.default_value = value
        tree.links.new(last, node.inputs[0])
        last = node.outputs[0]
    tree.links.new(last, tree.nodes.new("NodeGroupOutput").inputs[0])
    stage.ball.modifiers.new("Chain", "NODES").node_group = tree
    return tree


def _stored(kind: str, domain: str, value: Any, output: str = "Color") -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        _geometry(stage, ("GeometryNodeStoreNamedAttribute", {"data_type": kind, "domain": domain},
                          {"Name": "mine", "Value": value}))  # fmt: skip
        node = stage.node("ShaderNodeAttribute", attribute_name="mine")
        scale = stage.node("ShaderNodeVectorMath", operation="FRACTION")
        stage.link(node.outputs[output], scale.inputs[0])
        stage.into_color(scale.outputs[0])

    return build


feature("unusual/stored normals of faces", _stored("FLOAT_VECTOR", "FACE", "node:GeometryNodeInputNormal", "Vector"))
feature("unusual/stored positions of corners", _stored(
    "FLOAT_VECTOR", "CORNER", "node:GeometryNodeInputPosition", "Vector"))  # fmt: skip
feature("unusual/stored numbers of edges", _stored("FLOAT", "EDGE", "node:FunctionNodeRandomValue", "Fac"))
feature("unusual/stored random colors of points", _stored("FLOAT_COLOR", "POINT", "node:FunctionNodeRandomValue"))
feature("unusual/points of a mesh", lambda s: (
    _geometry(s, ("GeometryNodeMeshToPoints", {}, {"Radius": 0.06}),
              ("GeometryNodeSetMaterial", {}, {"Material": s.material_of_ball})),
    s.into_color(_noise(s, 3.0, "Color"))))  # fmt: skip
feature("unusual/dual mesh in flat shading", lambda s: _geometry(
    s, ("GeometryNodeDualMesh", {}, {}), ("GeometryNodeSetShadeSmooth", {}, {"Shade Smooth": False})))  # fmt: skip
feature("unusual/extruded faces", lambda s: _geometry(
    s, ("GeometryNodeExtrudeMesh", {"mode": "FACES"}, {"Offset Scale": 0.15})))  # fmt: skip
feature("unusual/subdivided by nodes", lambda s: _geometry(s, ("GeometryNodeSubdivisionSurface", {}, {"Level": 1})))
feature("unusual/mesh to curves of some radius", lambda s: _geometry(
    s, ("GeometryNodeMeshToCurve", {}, {}), ("GeometryNodeSetCurveRadius", {}, {"Radius": 0.03}),
    ("GeometryNodeSetMaterial", {}, {"Material": s.material_of_ball})), 2)  # fmt: skip


def _islands(stage: Stage) -> None:
    """Cubes of one mesh, each with its own random color."""
    bpy.ops.object.select_all(action="DESELECT")
    cubes = [stage.cube(stage.material_of_ball, (0.7 * k - 1.4, 0, 1.0 + 0.2 * k), 0.5) for k in range(5)]
    for item in cubes:
        item.select_set(True)
    stage.layer.objects.active = cubes[0]
    bpy.ops.object.join()
    stage.ball.hide_render = True
    stage.glow(stage.node("ShaderNodeNewGeometry").outputs["Random Per Island"])


feature("unusual/random per island", _islands)

# --- the scene --------------------------------------------------------------------------------------------------------


def _set_behind(stage: Stage) -> None:
    """Another scene behind this one, with a cube and a lamp."""
    other = bpy.data.scenes.new("Behind")
    cube = stage.cube(stage.material("Behind", Color=(0.1, 0.6, 0.3, 1)), (1.3, -1, 0.5), 0.8, (0, 0, 0.4))
    lamp = stage.light("POINT", 150.0, (-2, -2, 2))
    for item in (cube, lamp):
        stage.scene.collection.objects.unlink(item)
        other.collection.objects.link(item)
    stage.scene.background_set = other


def _exclusive(stage: Stage) -> None:
    """Objects of collections that are hidden in renders, in the view layer and in views."""
    for k, hide in enumerate(("hide_render", "exclude", "hide_viewport")):
        own = bpy.data.collections.new(hide)
        stage.scene.collection.children.link(own)
        cube = stage.cube(stage.material(hide, Color=(0.2 * k, 0.6, 0.3, 1)), (1.3 - 1.3 * k, -1.5, 0.4), 0.6)
        stage.scene.collection.objects.unlink(cube)
        own.objects.link(cube)
        if hide == "exclude":
            stage.layer.layer_collection.children[hide].exclude = True
        else:
            setattr(own, hide, True)


feature("unusual/scene behind", _set_behind)
feature("unusual/collections that are hidden", _exclusive)
feature("unusual/frame between frames", lambda s: (
    [(setattr(s.ball, "location", (x, 0, 1)), s.ball.keyframe_insert("location", frame=f))
     for f, x in ((0, -1), (10, 1))], s.scene.frame_set(3, subframe=0.5)))  # fmt: skip
feature("unusual/small units", lambda s: setattr(s.scene.unit_settings, "scale_length", 0.01))
feature("unusual/children of the simplified particles", lambda s: (
    setattr(s.scene.render, "use_simplify", True), setattr(s.scene.render, "simplify_child_particles_render", 0.2),
    setattr(s.scene.cycles, "texture_limit_render", "128")))  # fmt: skip

# --- lamps and emission -----------------------------------------------------------------------------------------------


def _sampling(way: str, scale: tuple[float, float, float] = (1, 1, 1)) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        glow = stage.material("Glow", "ShaderNodeEmission", Strength=8.0)
        glow.cycles.emission_sampling = way
        made = stage.plane(0.8, glow, (1.2, -1.2, 1.4), (0.4, -0.7, 0.2))
        made.scale = scale

    return build


for _way in ("NONE", "FRONT", "BACK", "FRONT_BACK"):
    feature(f"unusual/emissive plane sampled by {_way.lower()}", _sampling(_way), 2)
feature("unusual/mirrored emissive plane", _sampling("FRONT", (-1, 1, 1)), 2)


def _portal(stage: Stage) -> None:
    stage.lamp.data.cycles.is_portal = True
    stage.lamp.data.size = 3.0


def _front_glow(stage: Stage) -> None:
    """A panel mesh that emits to its front alone, by Backfacing."""
    glow = stage.material("Glow", "ShaderNodeEmission")
    tree = stage.tree(glow)
    side, gain = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeMapRange")
    gain.inputs["To Min"].default_value, gain.inputs["To Max"].default_value = 12.0, 0.0
    tree.links.new(side.outputs["Backfacing"], gain.inputs[0])
    tree.links.new(gain.outputs[0], tree.nodes["shader"].inputs["Strength"])
    stage.plane(0.8, glow, (1.2, -1.2, 1.6), (0.4, -2.4, 0.2))


feature("unusual/portal", _portal)
feature("unusual/emission of the front alone", _front_glow)
feature("unusual/caustics of a lamp through glass", lambda s: (
    s.replace_lamp("POINT", 300.0, shadow_soft_size=0.1), s.shader("ShaderNodeBsdfGlass", Roughness=0.0),
    setattr(s.lamp.data.cycles, "is_caustics_light", True), setattr(s.ball.cycles, "is_caustics_caster", True),
    setattr(s.floor.cycles, "is_caustics_receiver", True)), 4)  # fmt: skip

# --- closures in odd sums ---------------------------------------------------------------------------------------------


def _added(first: str, second: str, how: str = "AddShader", **values: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        tree, add = stage.tree(), stage.node(f"ShaderNode{how}")
        one, other = stage.node(f"ShaderNode{first}"), stage.node(f"ShaderNode{second}")
        for name, value in values.items():
            other.inputs[name.replace("_", " ")].default_value = value
        stage.link(one.outputs[0], add.inputs[-2])
        stage.link(other.outputs[0], add.inputs[-1])
        stage.link(add.outputs[0], tree.nodes["output"].inputs["Surface"])

    return build


feature("unusual/transparent and emission", _added("BsdfTransparent", "Emission", Strength=0.3, Color=(0.2, 0.5, 1, 1)))
feature("unusual/glass and diffuse", _added("BsdfGlass", "BsdfDiffuse", "MixShader", Color=(0.2, 0.1, 0.05, 1)), 3)
feature("unusual/transparent beyond 1", lambda s: s.shader("ShaderNodeBsdfTransparent", Color=(1.5, 0.6, 0.2, 1)))
feature(
    "unusual/translucent and subsurface", _added("BsdfTranslucent", "SubsurfaceScattering", "MixShader", Scale=0.2), 3
)


def _half_hole(stage: Stage) -> None:
    tree, mix = stage.tree(), stage.node("ShaderNodeMixShader")
    stage.link(_noise(stage, 2.0), mix.inputs[0])
    stage.link(tree.nodes["shader"].outputs[0], mix.inputs[1])
    stage.link(stage.node("ShaderNodeHoldout").outputs[0], mix.inputs[2])
    stage.link(mix.outputs[0], tree.nodes["output"].inputs["Surface"])
    stage.scene.render.film_transparent = True


feature("unusual/holdout by noise", _half_hole)

# --- images -----------------------------------------------------------------------------------------------------------


def _alpha(mode: str) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        node, shader = stage.node("ShaderNodeTexImage"), stage.shader("ShaderNodeBsdfPrincipled")
        node.image = stage.image(alpha=True)
        node.image.alpha_mode = mode
        stage.link(node.outputs["Color"], shader.inputs["Base Color"])
        stage.link(node.outputs["Alpha"], shader.inputs["Alpha"])

    return build


def _grid(kind: str) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        node = stage.node("ShaderNodeTexImage")
        node.image = bpy.data.images.new("Grid", 64, 64)
        node.image.generated_type, node.image.generated_color = kind, (0.2, 0.5, 0.7, 1)
        stage.into_color(node.outputs["Color"])

    return build


for _mode in ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"):
    feature(f"unusual/image alpha {_mode.lower()}", _alpha(_mode))
for _kind in ("BLANK", "UV_GRID", "COLOR_GRID"):
    feature(f"unusual/generated image {_kind.lower()}", _grid(_kind))


def _adaptive(stage: Stage) -> None:
    """Adaptive subdivision, if this Blender has it as a setting of the modifier."""
    modifier = stage.ball.modifiers.new("S", "SUBSURF")
    if "use_adaptive_subdivision" in modifier.bl_rna.properties:
        modifier.use_adaptive_subdivision = True
    stage.material_of_ball.displacement_method = "BOTH"
    node = stage.node("ShaderNodeDisplacement", Scale=0.3)
    stage.link(_noise(stage, 2.0), node.inputs["Height"])
    stage.link(node.outputs[0], stage.tree().nodes["output"].inputs["Displacement"])


def _vector_displaced(stage: Stage) -> None:
    stage.material_of_ball.displacement_method = "DISPLACEMENT"
    node = stage.node("ShaderNodeVectorDisplacement", Scale=0.4, space="OBJECT")
    stage.link(_noise(stage, 2.0, "Color"), node.inputs["Vector"])
    node.inputs["Midlevel"].default_value = 0.5
    stage.link(node.outputs[0], stage.tree().nodes["output"].inputs["Displacement"])


def _hard_edges(stage: Stage) -> None:
    """Smooth faces with sharp edges and custom normals of some corners."""
    mesh = stage.ball.data
    sharp = mesh.attributes.new("sharp_edge", "BOOLEAN", "EDGE")
    sharp.data.foreach_set("value", np.arange(len(mesh.edges)) % 5 == 0)


feature("unusual/adaptive subdivision", _adaptive)
feature("unusual/vector displacement of the object", _vector_displaced)
feature("unusual/sharp edges", _hard_edges)
feature("unusual/volume without bounces", lambda s: (
    s.tree().nodes.remove(s.tree().nodes["shader"]), s.link(
        s.node("ShaderNodeVolumeScatter", Density=2.0, Anisotropy=0.4).outputs[0],
        s.tree().nodes["output"].inputs["Volume"]), setattr(s.scene.cycles, "volume_bounces", 0)), 3)  # fmt: skip
