# SPDX-License-Identifier: GPL-3.0-or-later
"""Math, vector, color and converter nodes: every mode, over a value that varies on the ball."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


def _modes(kind: str, name: str) -> list[str]:
    """Identifiers of a node's choices."""
    return [item.identifier for item in getattr(bpy.types, kind).bl_rna.properties[name].enum_items]


def _picture(stage: Stage) -> Any:
    """The color output of an image on the ball's UV map."""
    texture = stage.node("ShaderNodeTexImage")
    texture.image = stage.image()
    return texture.outputs["Color"]


def _through(kind: str, target: str | int, output: str | int = 0, **values: Any) -> Callable[[Stage], None]:
    """The image passes through a node; the ball emits the result."""

    def build(stage: Stage) -> None:
        node = stage.node(kind, **values)
        stage.link(_picture(stage), node.inputs[target])
        stage.glow(node.outputs[output])

    return build


def _math(operation: str, clamp: bool = False) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        node = stage.node("ShaderNodeMath", operation=operation, use_clamp=clamp)
        stage.link(_picture(stage), node.inputs[0])
        node.inputs[1].default_value, node.inputs[2].default_value = 0.37, 0.21
        stage.glow(node.outputs[0])

    return build


def _vector_math(operation: str) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        node = stage.node("ShaderNodeVectorMath", operation=operation)
        stage.link(_picture(stage), node.inputs[0])
        node.inputs[1].default_value, node.inputs[2].default_value = (0.3, -0.5, 0.7), (0.2, 0.4, 0.1)
        next(socket for socket in node.inputs if socket.identifier == "Scale").default_value = 0.6
        output = next(socket for socket in node.outputs if socket.enabled)
        stage.glow(output)

    return build


def _mix(blend: str, *, clamp: bool = False, legacy: bool = False) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        if legacy:
            node = stage.node("ShaderNodeMixRGB", blend_type=blend)
            factor, first, second, result = *node.inputs[:3], node.outputs[0]
        else:
            node = stage.node("ShaderNodeMix", data_type="RGBA", blend_type=blend, clamp_result=clamp)
            factor, first, second = node.inputs[0], node.inputs[6], node.inputs[7]
            result = node.outputs[2]
        factor.default_value, second.default_value = 0.7, (0.4, 0.7, 0.2, 1)
        stage.link(_picture(stage), first)
        stage.glow(result)

    return build


for _operation in _modes("ShaderNodeMath", "operation"):
    feature(f"math/{_operation.lower()}", _math(_operation))
feature("math/clamped", _math("MULTIPLY_ADD", True))
for _operation in _modes("ShaderNodeVectorMath", "operation"):
    feature(f"vector math/{_operation.lower()}", _vector_math(_operation))
for _blend in _modes("ShaderNodeMix", "blend_type"):
    feature(f"mix/{_blend.lower()}", _mix(_blend))
feature("mix/clamped", _mix("ADD", clamp=True))
feature("mix/legacy", _mix("OVERLAY", legacy=True))


def _mix_data(kind: str) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        node = stage.node("ShaderNodeMix", data_type=kind)
        enabled = [socket for socket in node.inputs if socket.enabled]
        enabled[0].default_value = 0.3
        stage.link(_picture(stage), enabled[1])
        stage.glow(next(socket for socket in node.outputs if socket.enabled))

    return build


feature("mix/float", _mix_data("FLOAT"))
feature("mix/vector", _mix_data("VECTOR"))
for _kind in _modes("ShaderNodeMapRange", "interpolation_type"):
    feature(f"converter/map range {_kind.lower()}", _through(
        "ShaderNodeMapRange", 0, interpolation_type=_kind, From_Min=0.2, From_Max=0.7, To_Max=0.8))  # fmt: skip
feature("converter/map range vector", _through("ShaderNodeMapRange", "Vector", "Vector", data_type="FLOAT_VECTOR"))
for _kind in _modes("ShaderNodeClamp", "clamp_type"):
    feature(f"converter/clamp {_kind.lower()}", _through("ShaderNodeClamp", 0, clamp_type=_kind, Min=0.6, Max=0.3))
feature("converter/rgb to bw", _through("ShaderNodeRGBToBW", 0))
for _mode in ("RGB", "HSV", "HSL"):
    feature(f"converter/separate {_mode}", _through("ShaderNodeSeparateColor", 0, 1, mode=_mode))
    feature(f"converter/combine {_mode}", _through("ShaderNodeCombineColor", 1, 0, mode=_mode, Red=0.3, Blue=0.6))
feature("converter/separate xyz", _through("ShaderNodeSeparateXYZ", 0, 1))
feature("converter/combine xyz", _through("ShaderNodeCombineXYZ", 1, 0))
feature("converter/blackbody", _through("ShaderNodeBlackbody", 0))
feature("converter/wavelength", lambda s: s.glow(s.node("ShaderNodeWavelength", Wavelength=580.0).outputs[0]))
feature("converter/blackbody constant", lambda s: s.glow(s.node("ShaderNodeBlackbody", Temperature=3000.0).outputs[0]))
feature("converter/blackbody on a surface", lambda s: s.into_color(
    s.node("ShaderNodeBlackbody", Temperature=3000.0).outputs[0]))  # fmt: skip
feature("color/hue saturation value", _through("ShaderNodeHueSaturation", "Color", Hue=0.7, Saturation=1.4, Value=0.8))
feature("color/invert", _through("ShaderNodeInvert", "Color", Fac=0.8))
feature("color/gamma", _through("ShaderNodeGamma", "Color", Gamma=2.2))
feature("color/bright contrast", _through("ShaderNodeBrightContrast", "Color", Bright=0.1, Contrast=0.5))


def _ramp(interpolation: str, mode: str = "RGB") -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        node = stage.node("ShaderNodeValToRGB")
        ramp = node.color_ramp
        ramp.color_mode = mode
        if mode == "RGB":
            ramp.interpolation = interpolation
        else:
            ramp.hue_interpolation = interpolation
        ramp.elements.new(0.4).color = (0.8, 0.2, 0.1, 1)
        ramp.elements[0].color, ramp.elements[-1].color = (0.1, 0.1, 0.6, 1), (0.9, 0.9, 0.3, 1)
        stage.link(_picture(stage), node.inputs[0])
        stage.glow(node.outputs[0])

    return build


for _kind in ("LINEAR", "CONSTANT", "EASE", "CARDINAL", "B_SPLINE"):
    feature(f"color/ramp {_kind.lower()}", _ramp(_kind))
feature("color/ramp hsv", _ramp("NEAR", "HSV"))
feature("color/ramp hsl far", _ramp("FAR", "HSL"))


def _curve(kind: str, channel: int, target: str) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        node = stage.node(kind)
        curve = node.mapping.curves[channel]
        curve.points.new(0.3, 0.7)
        curve.points[-1].location = (1.0, 0.6)
        node.mapping.update()
        stage.link(_picture(stage), node.inputs[target])
        stage.glow(node.outputs[0])

    return build


feature("color/rgb curves", _curve("ShaderNodeRGBCurve", 3, "Color"))
feature("color/rgb curves red", _curve("ShaderNodeRGBCurve", 0, "Color"))
feature("color/float curve", _curve("ShaderNodeFloatCurve", 0, "Value"))
feature("color/vector curves", _curve("ShaderNodeVectorCurve", 0, "Vector"))
for _kind in _modes("ShaderNodeVectorRotate", "rotation_type"):
    _turn = {"Rotation": (0.3, 0.5, 0.8)} if _kind == "EULER_XYZ" else {"Angle": 0.8}
    feature(f"vector/rotate {_kind.lower()}", _through(
        "ShaderNodeVectorRotate", "Vector", rotation_type=_kind, **_turn))  # fmt: skip
for _kind in _modes("ShaderNodeMapping", "vector_type"):
    _moved = {"Location": (0.1, 0.2, 0.3)} if _kind in ("POINT", "TEXTURE") else {}
    feature(f"vector/mapping {_kind.lower()}", _through("ShaderNodeMapping", "Vector", vector_type=_kind,
            Rotation=(0.1, 0.2, 0.3), Scale=(1.2, 0.8, 1.5), **_moved))  # fmt: skip
for _kind in _modes("ShaderNodeVectorTransform", "vector_type"):
    feature(f"vector/transform {_kind.lower()}", _through(
        "ShaderNodeVectorTransform", 0, vector_type=_kind, convert_from="WORLD", convert_to="CAMERA"))  # fmt: skip


def _group(stage: Stage) -> None:
    tree = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    tree.interface.new_socket("In", in_out="INPUT", socket_type="NodeSocketColor")
    tree.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
    enter, leave = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    gamma = tree.nodes.new("ShaderNodeGamma")
    gamma.inputs[1].default_value = 1.8
    tree.links.new(enter.outputs[0], gamma.inputs[0])
    tree.links.new(gamma.outputs[0], leave.inputs[0])
    node = stage.node("ShaderNodeGroup")
    node.node_tree = tree
    stage.link(_picture(stage), node.inputs[0])
    stage.glow(node.outputs[0])


feature("color/node group", _group)
feature("color/muted node", _through("ShaderNodeGamma", "Color", Gamma=3.0, mute=True))
