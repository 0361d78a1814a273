# SPDX-License-Identifier: GPL-3.0-or-later
"""Input nodes: coordinates, geometry, object, particle, light path and camera, each as the emission of the ball."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


def _shown(kind: str, output: str, **values: Any) -> Callable[[Stage], None]:
    return lambda stage: stage.glow(stage.node(kind, **values).outputs[output])


def _dirt(stage: Stage) -> Any:
    """Two colors, mixed by how open the surface is, through a ramp as dirt has."""
    node, ramp = stage.node("ShaderNodeAmbientOcclusion", Distance=1.5), stage.node("ShaderNodeValToRGB")
    ramp.color_ramp.elements[0].position, ramp.color_ramp.elements[0].color = 0.4, (0.1, 0.05, 0.02, 1)
    ramp.color_ramp.elements[1].position, ramp.color_ramp.elements[1].color = 0.9, (0.8, 0.7, 0.5, 1)
    stage.link(node.outputs["AO"], ramp.inputs[0])
    return ramp.outputs[0]


for _output in ("Generated", "Normal", "UV", "Object", "Camera", "Window", "Reflection"):
    feature(f"inputs/coordinates {_output}", _shown("ShaderNodeTexCoord", _output))
for _output in ("Position", "Normal", "Tangent", "True Normal", "Incoming", "Parametric", "Backfacing", "Pointiness",
                "Random Per Island"):  # fmt: skip
    feature(f"inputs/geometry {_output}", _shown("ShaderNodeNewGeometry", _output))
for _output in ("Location", "Color", "Alpha", "Object Index", "Material Index", "Random"):
    feature(f"inputs/object {_output}", lambda s, o=_output: (
        _shown("ShaderNodeObjectInfo", o)(s), setattr(s.ball, "color", (0.9, 0.2, 0.4, 0.5)),
        setattr(s.ball, "pass_index", 2), setattr(s.material_of_ball, "pass_index", 3)))  # fmt: skip
for _output in ("View Vector", "View Z Depth", "View Distance"):
    feature(f"inputs/camera {_output}", _shown("ShaderNodeCameraData", _output))
for _output in ("Ray Depth", "Ray Length", "Diffuse Depth", "Transparent Depth"):
    feature(f"inputs/light path {_output}", _shown("ShaderNodeLightPath", _output))
feature("inputs/fresnel", _shown("ShaderNodeFresnel", "Fac", IOR=1.45))
feature("inputs/layer weight fresnel", _shown("ShaderNodeLayerWeight", "Fresnel", Blend=0.3))
feature("inputs/layer weight facing", _shown("ShaderNodeLayerWeight", "Facing", Blend=0.3))
feature("inputs/ambient occlusion", _shown("ShaderNodeAmbientOcclusion", "Color"), 2)
feature("inputs/ambient occlusion factor", _shown("ShaderNodeAmbientOcclusion", "AO", Distance=0.5), 2)
feature(
    "inputs/ambient occlusion inside",
    lambda s: (
        s.cube(s.material("Cube"), (0.7, -0.4, 0.5), 1.0),
        _shown("ShaderNodeAmbientOcclusion", "AO", inside=True)(s),
    ),
    2,
)
feature(
    "inputs/ambient occlusion of the object alone",
    lambda s: (
        s.cube(s.material("Cube"), (0.9, -0.6, 0.5), 1.0),
        _shown("ShaderNodeAmbientOcclusion", "AO", inside=True, only_local=True, Distance=0.7)(s),
    ),
    2,
)
feature("inputs/ambient occlusion of the world's distance", _shown("ShaderNodeAmbientOcclusion", "AO", Distance=0.0), 2)
feature(
    "inputs/ambient occlusion as a mask of dirt",
    lambda s: (s.cube(s.material("Cube"), (1.3, -0.4, 0.5), 1.0), s.into_color(_dirt(s))),
    2,
)
feature("inputs/wireframe", _shown("ShaderNodeWireframe", "Fac", Size=0.05))
feature("inputs/tangent radial", _shown("ShaderNodeTangent", "Tangent"))
feature("inputs/tangent of a uv map", _shown("ShaderNodeTangent", "Tangent", direction_type="UV_MAP"))
feature("inputs/normal node", _shown("ShaderNodeNormal", "Normal"))
feature("inputs/value", _shown("ShaderNodeValue", "Value"))
feature("inputs/rgb", lambda s: (lambda node: (setattr(node.outputs[0], "default_value", (0.2, 0.7, 0.4, 1)),
        s.glow(node.outputs[0])))(s.node("ShaderNodeRGB")))  # fmt: skip
feature("inputs/uv map", _shown("ShaderNodeUVMap", "UV", uv_map="UVMap"))
feature("inputs/hair info", _shown("ShaderNodeHairInfo", "Intercept"))
feature("inputs/particle info", _shown("ShaderNodeParticleInfo", "Random"))
feature("inputs/point info", _shown("ShaderNodePointInfo", "Position"))
feature("inputs/volume info", _shown("ShaderNodeVolumeInfo", "Density"))
feature("inputs/vector of an object", lambda s: (lambda node: (
    setattr(node, "object", s.lamp), s.glow(node.outputs["Object"])))(s.node("ShaderNodeTexCoord")))  # fmt: skip


def _bevel(stage: Stage) -> None:
    bpy.data.objects.remove(stage.ball)
    stage.ball = stage.cube(stage.material_of_ball, (0, 0, 0.75), 1.4, (0, 0, 0.6))
    shader, bevel = stage.tree().nodes["shader"], stage.node("ShaderNodeBevel", Radius=0.3)
    stage.link(bevel.outputs[0], shader.inputs["Normal"])


feature("inputs/bevel", _bevel, 2)


def _particles(output: str, factor: float) -> Callable[[Stage], None]:
    """Cubes that an emitter has let fly, each colored by what Particle Info says of it."""

    def build(stage: Stage) -> None:
        cube = stage.cube(stage.material_of_ball, (3, 30, 0.1), 0.5)
        stage.ball.data.materials[0] = stage.material("Emitter", Color=(0.2, 0.2, 0.2, 1))
        bpy.context.view_layer.objects.active = stage.ball
        with bpy.context.temp_override(object=stage.ball, active_object=stage.ball):
            bpy.ops.object.particle_system_add()
        settings = stage.ball.particle_systems[0].settings
        settings.count, settings.frame_end, settings.lifetime, settings.lifetime_random = 80, 4, 50, 0.5
        settings.render_type, settings.instance_object, settings.particle_size = "OBJECT", cube, 0.5
        for frame in range(1, 9):
            stage.scene.frame_set(frame)
        scale = stage.node("ShaderNodeVectorMath", operation="SCALE")
        scale.inputs["Scale"].default_value = factor
        stage.link(stage.node("ShaderNodeParticleInfo").outputs[output], scale.inputs[0])
        stage.into_color(scale.outputs[0])

    return build


for _output, _factor in (("Random", 1.0), ("Index", 0.0125), ("Age", 0.1), ("Lifetime", 0.02), ("Size", 1.5),
                         ("Location", 0.4), ("Velocity", 0.4)):  # fmt: skip
    feature(f"inputs/particle info {_output} of cubes", _particles(_output, _factor))


def _from_instancer(output: str) -> Callable[[Stage], None]:
    """Small balls on the faces of a sphere, colored by the instancer's coordinates there."""

    def build(stage: Stage) -> None:
        small = stage.sphere(stage.material_of_ball, (0, 0, 0), 0.15)
        stage.ball.data.materials[0] = stage.material("Instancer", Color=(0.2, 0.2, 0.2, 1))
        small.parent, stage.ball.instance_type = stage.ball, "FACES"
        stage.ball.show_instancer_for_render = True
        stage.into_color(stage.node("ShaderNodeTexCoord", from_instancer=True).outputs[output])

    return build


for _output in ("UV", "Generated"):
    feature(f"inputs/coordinates {_output} of the instancer", _from_instancer(_output))
feature(
    "inputs/uv map of the instancer",
    lambda s: s.link(s.node("ShaderNodeUVMap", from_instancer=True).outputs[0], s.tree().nodes["shader"].inputs[0]),
)
feature("inputs/wireframe of a cube", lambda s: (_as_cube(s), s.into_color(_wires(s))))


def _as_cube(stage: Stage) -> None:
    bpy.data.objects.remove(stage.ball)
    stage.ball = stage.cube(stage.material_of_ball, (0, 0, 0.75), 1.4, (0, 0, 0.6))


def _wires(stage: Stage) -> Any:
    return stage.node("ShaderNodeWireframe", Size=0.1).outputs[0]


def _attribute(kind: str, domain: str, node: str = "ShaderNodeAttribute") -> Callable[[Stage], None]:
    """A mesh attribute that follows the height of its vertex, shown by the Attribute or Color Attribute node."""

    def build(stage: Stage) -> None:
        mesh = stage.ball.data
        heights = np.array([v.co.z for v in mesh.vertices]) * 0.5 + 0.5
        if domain == "CORNER":
            heights = heights[[loop.vertex_index for loop in mesh.loops]]
        elif domain == "FACE":
            heights = np.array([heights[list(polygon.vertices)].mean() for polygon in mesh.polygons])
        made = mesh.attributes.new("height", kind, domain)
        if kind == "FLOAT":
            made.data.foreach_set("value", heights.astype(np.float32))
        elif kind == "FLOAT_VECTOR":
            made.data.foreach_set("vector", np.stack([heights, 1 - heights, 0 * heights], 1).astype(np.float32).ravel())
        else:
            colors = np.stack([heights, 1 - heights, 0 * heights, 0 * heights + 1], 1)
            made.data.foreach_set("color", colors.astype(np.float32).ravel())
        shown = stage.node(node)
        if node == "ShaderNodeAttribute":
            shown.attribute_name = "height"
        else:
            shown.layer_name = "height"
        stage.glow(shown.outputs["Color"])

    return build


for _domain in ("POINT", "CORNER"):
    for _kind in ("FLOAT_COLOR", "BYTE_COLOR"):
        feature(
            f"inputs/color attribute {_kind.lower()} {_domain.lower()}",
            _attribute(_kind, _domain, "ShaderNodeVertexColor"),
        )
for _kind in ("FLOAT", "FLOAT_VECTOR"):
    for _domain in ("POINT", "FACE"):
        feature(f"inputs/attribute {_kind.lower()} {_domain.lower()}", _attribute(_kind, _domain))


def _property(where: str) -> Callable[[Stage], None]:
    """A custom property read by the Attribute node of an object, instancer or view layer."""

    def build(stage: Stage) -> None:
        owner = {"OBJECT": stage.ball, "VIEW_LAYER": stage.scene, "INSTANCER": stage.ball}[where]
        owner["tint"] = (0.2, 0.7, 0.4)
        shown = stage.node("ShaderNodeAttribute", attribute_type=where, attribute_name="tint")
        stage.glow(shown.outputs["Vector"])

    return build


for _where in ("OBJECT", "VIEW_LAYER", "INSTANCER"):
    feature(f"inputs/attribute of the {_where.lower()}", _property(_where))
