# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps whose nodes vary over the lamp, by direction or with distance: projected images, patterns, luminaires."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from benchmarks.render.features import feature
from benchmarks.render.features.light.lamps import IES
from benchmarks.render.features.stage import Stage

Connect = Callable[[Stage, Any, Any], Any]
"""Takes the stage, the lamp's data and its Emission node; links what the scene is about."""


def _lamp(connect: Connect, kind: str = "POINT", energy: float = 300.0, **values: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        lamp = stage.replace_lamp(kind, energy, **{name: value for name, value in values.items() if name != "scale"})
        lamp.scale = values.get("scale", (1.0, 1.0, 1.0))
        connect(stage, lamp.data, next(node for node in stage.tree(lamp.data).nodes if node.type == "EMISSION"))

    return build


def _through(coordinate: tuple[str, str], texture: str, target: str = "Color", mapping: dict[str, Any] | None = None,
             **values: Any) -> Connect:  # fmt: skip
    """A texture by a coordinate of the lamp (node and output), perhaps through a Mapping."""

    def connect(stage: Stage, lamp: Any, emission: Any) -> None:
        node = stage.node(f"ShaderNode{texture}", lamp, **values)
        if hasattr(node, "image"):
            node.image = stage.image(size=(8, 8))
        if coordinate[0]:
            place = stage.node(f"ShaderNode{coordinate[0]}", lamp).outputs[coordinate[1]]
            if mapping is not None:
                turn = stage.node("ShaderNodeMapping", lamp, **mapping)
                stage.link(place, turn.inputs["Vector"])
                place = turn.outputs["Vector"]
            stage.link(place, node.inputs["Vector"])
        stage.link(node.outputs[0], emission.inputs[target])

    return connect


UV, NORMAL, OBJECT = (("TexCoord", name) for name in ("UV", "Normal", "Object"))
SPOT: dict[str, Any] = {"spot_size": 0.8, "spot_blend": 0.2}
feature("lamp trees/image on a spot by UV", _lamp(_through(UV, "TexImage"), "SPOT", **SPOT))
feature("lamp trees/image on a spot by UV, closest", _lamp(
    _through(UV, "TexImage", interpolation="Closest"), "SPOT", **SPOT))  # fmt: skip
feature("lamp trees/image on a scaled spot", _lamp(_through(UV, "TexImage"), "SPOT", scale=(1.6, 0.7, 1), **SPOT))
feature("lamp trees/image on a spot by Normal and Mapping", _lamp(
    _through(NORMAL, "TexImage", mapping={"Scale": (2.0, 2.0, 1.0), "Location": (0.5, 0.5, 0.0)}), "SPOT",
    **SPOT))  # fmt: skip
feature("lamp trees/image on a hard point by UV", _lamp(
    _through(UV, "TexImage"), shadow_soft_size=0.3, use_soft_falloff=False))  # fmt: skip
feature("lamp trees/image on a rectangle by UV", _lamp(
    _through(UV, "TexImage"), "AREA", 150.0, shape="RECTANGLE", size=0.6, size_y=1.8))  # fmt: skip
feature("lamp trees/gradient on a panel by Parametric", _lamp(
    _through(("NewGeometry", "Parametric"), "TexGradient"), "AREA", 150.0, size=1.5))  # fmt: skip
feature("lamp trees/checker on a panel by Object", _lamp(
    _through(OBJECT, "TexChecker", Scale=2.0), "AREA", 150.0, size=2.0, scale=(1.5, 0.8, 1)))  # fmt: skip
feature("lamp trees/image on a wide sun by UV", _lamp(_through(UV, "TexImage"), "SUN", 3.0, angle=0.6))
feature("lamp trees/noise by Normal into strength", _lamp(_through(NORMAL, "TexNoise", "Strength", Scale=3.0)))
feature("lamp trees/checker by Incoming", _lamp(_through(("NewGeometry", "Incoming"), "TexChecker", Scale=4.0)))
feature("lamp trees/voronoi without coordinates", _lamp(_through(("", ""), "TexVoronoi", Scale=9.0), "AREA", 150.0))
feature("lamp trees/noise by Position", _lamp(
    _through(("NewGeometry", "Position"), "TexNoise", Scale=6.0), shadow_soft_size=0.4))  # fmt: skip
feature("lamp trees/noise by Camera", _lamp(
    _through(("TexCoord", "Camera"), "TexNoise", Scale=2.0), "AREA", 150.0, size=2.0))  # fmt: skip
feature("lamp trees/noise by Window", _lamp(
    _through(("TexCoord", "Window"), "TexNoise", Scale=5.0), "AREA", 150.0, size=2.0))  # fmt: skip
feature("lamp trees/magic by Reflection", _lamp(_through(("TexCoord", "Reflection"), "TexMagic", Scale=3.0)))
feature("lamp trees/environment by direction", _lamp(_through(("NewGeometry", "Incoming"), "TexEnvironment")))


def _mathed(operation: str, second: float, kind: str = "LightPath", output: str = "Ray Length") -> Connect:
    def connect(stage: Stage, lamp: Any, emission: Any) -> None:
        math = stage.node("ShaderNodeMath", lamp, operation=operation)
        math.inputs[1].default_value = second
        stage.link(stage.node(f"ShaderNode{kind}", lamp).outputs[output], math.inputs[0])
        stage.link(math.outputs[0], emission.inputs["Strength"])

    return connect


feature("lamp trees/square root of the ray length", _lamp(_mathed("POWER", 0.5)))
feature("lamp trees/ray length on a sun", _lamp(_mathed("LESS_THAN", 1e6), "SUN", 3.0))
feature("lamp trees/light that ends", _lamp(_mathed("LESS_THAN", 4.6)))
feature("lamp trees/bands by the ray length", _lamp(_mathed("SINE", 0.0)))
feature("lamp trees/random number of the lamp", _lamp(_mathed("ADD", 0.2, "ObjectInfo", "Random")))


def _object_color(stage: Stage, lamp: Any, emission: Any) -> None:
    stage.lamp.color = (0.9, 0.3, 0.1, 1.0)
    stage.link(stage.node("ShaderNodeObjectInfo", lamp).outputs["Color"], emission.inputs["Color"])


def _ramp(stage: Stage, lamp: Any, emission: Any) -> None:
    split, ramp = stage.node("ShaderNodeSeparateXYZ", lamp), stage.node("ShaderNodeValToRGB", lamp)
    stage.link(stage.node("ShaderNodeNewGeometry", lamp).outputs["Incoming"], split.inputs[0])
    for element, color in zip(ramp.color_ramp.elements, ((0.9, 0.2, 0.1, 1), (0.1, 0.4, 1.0, 1)), strict=True):
        element.color = color
    absolute = stage.node("ShaderNodeMath", lamp, operation="ABSOLUTE")
    stage.link(split.outputs["Z"], absolute.inputs[0])
    stage.link(absolute.outputs[0], ramp.inputs[0])
    stage.link(ramp.outputs[0], emission.inputs["Color"])


def _warm_and_cold(stage: Stage, lamp: Any, emission: Any) -> None:
    """A black body whose temperature varies with the direction."""
    body, range_of = stage.node("ShaderNodeBlackbody", lamp), stage.node("ShaderNodeMapRange", lamp)
    range_of.inputs["To Min"].default_value, range_of.inputs["To Max"].default_value = 2000.0, 9000.0
    noise = stage.node("ShaderNodeTexNoise", lamp, Scale=4.0)
    stage.link(stage.node("ShaderNodeTexCoord", lamp).outputs["Normal"], noise.inputs["Vector"])
    stage.link(noise.outputs[0], range_of.inputs["Value"])
    stage.link(range_of.outputs[0], body.inputs[0])
    stage.link(body.outputs[0], emission.inputs["Color"])


def _mix_by_pattern(stage: Stage, lamp: Any, emission: Any) -> None:
    """Two emissions, mixed by a pattern; one fades with the distance."""
    tree = emission.id_data
    other, mix = (
        stage.node("ShaderNodeEmission", lamp, Color=(0.1, 0.3, 1.0, 1)),
        stage.node("ShaderNodeMixShader", lamp),
    )
    falloff = stage.node("ShaderNodeLightFalloff", lamp, Strength=0.4, Smooth=0.5)
    checker = stage.node("ShaderNodeTexChecker", lamp, Scale=3.0)
    stage.link(stage.node("ShaderNodeTexCoord", lamp).outputs["Normal"], checker.inputs["Vector"])
    stage.link(falloff.outputs["Linear"], other.inputs["Strength"])
    stage.link(checker.outputs["Fac"], mix.inputs[0])
    stage.link(emission.outputs[0], mix.inputs[1])
    stage.link(other.outputs[0], mix.inputs[2])
    output = next(node for node in tree.nodes if node.type == "OUTPUT_LIGHT")
    stage.link(mix.outputs[0], output.inputs["Surface"])


def _ies(vector: bool, owner: Callable[[Stage, Any], Any] = lambda stage, lamp: lamp) -> Connect:
    def connect(stage: Stage, lamp: Any, emission: Any) -> None:
        given = owner(stage, lamp)
        node = stage.node("ShaderNodeTexIES", given, mode="INTERNAL")
        node.ies = bpy.data.texts.new("lamp.ies")
        node.ies.write(IES)
        if vector:
            turn = stage.node("ShaderNodeMapping", given, Rotation=(0.5, 0.0, 0.0))
            stage.link(stage.node("ShaderNodeTexCoord", given).outputs["Normal"], turn.inputs["Vector"])
            stage.link(turn.outputs["Vector"], node.inputs["Vector"])
        stage.link(node.outputs[0], emission.inputs["Strength"])

    return connect


feature("lamp trees/color of the lamp object", _lamp(_object_color))
feature("lamp trees/ramp by direction", _lamp(_ramp))
feature("lamp trees/temperature by direction", _lamp(_warm_and_cold))
feature("lamp trees/temperature and pattern", _lamp(
    _through(NORMAL, "TexNoise", "Strength", Scale=3.0), use_temperature=True, temperature=3000.0))  # fmt: skip
feature("lamp trees/mix of emissions by a pattern", _lamp(_mix_by_pattern))
feature("lamp trees/luminaire on a panel", _lamp(_ies(False), "AREA", 100.0, size=0.8))
feature("lamp trees/luminaire through a mapping", _lamp(_ies(True)))
feature("lamp trees/layer weight on a panel", _lamp(
    lambda s, lamp, e: s.link(s.node("ShaderNodeLayerWeight", lamp).outputs["Facing"], e.inputs["Strength"]),
    "AREA", 150.0, size=2.0))  # fmt: skip
feature("lamp trees/attribute on a lamp", _lamp(
    lambda s, lamp, e: s.link(s.node("ShaderNodeAttribute", lamp, attribute_name="Any").outputs["Color"],
                              e.inputs["Color"])))  # fmt: skip


def _glowing(connect: Callable[[Stage, Any], None]) -> Callable[[Stage], None]:
    """The ball lights the floor by nodes made for lamps."""

    def build(stage: Stage) -> None:
        bpy.data.objects.remove(stage.lamp)
        stage.set_world((0, 0, 0))
        connect(stage, stage.shader("ShaderNodeEmission", Strength=2.0))

    return build


feature("lamp trees/luminaire on a mesh", _glowing(lambda s, e: (
    setattr(s.ball, "rotation_euler", (-1.3, 0.0, 0.0)), _ies(False)(s, None, e))), 2)  # fmt: skip
feature("lamp trees/luminaire on a mesh through a mapping", _glowing(lambda s, e: _ies(True)(s, None, e)), 2)
for _output in ("Quadratic", "Linear", "Constant"):
    feature(f"lamp trees/{_output} falloff on a mesh", _glowing(
        lambda s, e, name=_output: s.link(s.node("ShaderNodeLightFalloff", Strength=1.5, Smooth=0.4).outputs[name],
                                          e.inputs["Strength"])), 2)  # fmt: skip
feature("lamp trees/ray length on a mesh", _glowing(
    lambda s, e: s.link(s.node("ShaderNodeLightPath").outputs["Ray Length"], e.inputs["Strength"])), 2)  # fmt: skip

# --- lamps around their receivers, and odd numbers ------------------------------------------------------------------


def _around(kind: str, soft: bool, place: tuple[float, float, float], radius: float) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        stage.replace_lamp(kind, 120.0, shadow_soft_size=radius, use_soft_falloff=soft).location = place

    return build


for _kind in ("POINT", "SPOT"):
    for _soft in (True, False):
        _name = f"{_kind.lower()} of {'soft' if _soft else 'hard'} falloff"
        feature(f"lamp trees/{_name} around the ball", _around(_kind, _soft, (0.3, -0.4, 1.6), 2.5), 2)
        feature(f"lamp trees/{_name} that touches the floor", _around(_kind, _soft, (1.6, -0.6, 0.5), 0.8), 2)


def _seen(stage: Stage) -> None:
    stage.replace_lamp("POINT", 60.0, shadow_soft_size=0.7).visible_camera = True
    stage.lamp.location = (0.9, -1.0, 2.4)


def _two_signs(stage: Stage) -> None:
    """A lamp, and another one that takes away some of its light."""
    stage.light("SPOT", -60.0, (0.5, -1.5, 4.0), (0.3, 0.1, 0.0), spot_size=0.5, shadow_soft_size=0.2)


feature("lamp trees/soft lamp seen by the camera", _seen)
feature("lamp trees/lamp that takes light away", _two_signs)
feature("lamp trees/negative strength in the nodes", _lamp(
    lambda s, lamp, e: (s.set_world((0.5, 0.5, 0.5)),
                        setattr(e.inputs["Strength"], "default_value", -0.3))))  # fmt: skip
feature("lamp trees/panel without area", lambda s: s.replace_lamp("AREA", 150.0, size=0.0))
feature("lamp trees/lamp of scale 0", lambda s: setattr(s.replace_lamp("POINT", 300.0), "scale", (0, 0, 0)))
