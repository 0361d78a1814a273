# SPDX-License-Identifier: GPL-3.0-or-later
"""Input nodes: coordinates, geometry, object, particle, light path and camera, each shown as what the ball emits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from benchmarks._features import feature
from benchmarks._features.stage import Stage


def _shown(kind: str, output: str, **values: Any) -> Callable[[Stage], None]:
    return lambda stage: stage.glow(stage.node(kind, **values).outputs[output])


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
