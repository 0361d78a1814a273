# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees as files from elsewhere have them: linked sockets, unusual modes, several maps, image extensions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


def _noise(stage: Stage, scale: float = 3.0, output: str = "Fac") -> Any:
    node = stage.node("ShaderNodeTexNoise", Scale=scale)
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], node.inputs["Vector"])
    return node.outputs[output]


def _place(stage: Stage, name: str = "Object") -> Any:
    return stage.node("ShaderNodeTexCoord").outputs[name]


def _linked(kind: str, links: dict[str, float], output: int = 0, **values: Any) -> Callable[[Stage], None]:
    """A texture some of whose numbers are driven by noise of the given scales; the ball shows its value."""

    def build(stage: Stage) -> None:
        node = stage.node(kind, **values)
        stage.link(_place(stage), node.inputs["Vector"])
        for name, scale in links.items():
            stage.link(_noise(stage, scale), node.inputs[name])
        stage.into_color([s for s in node.outputs if s.enabled][output])

    return build


_TEXTURES: dict[str, tuple[str, dict[str, float], int, dict[str, Any]]] = {
    "voronoi smoothness": ("TexVoronoi", {"Smoothness": 2, "Exponent": 3}, 0,
                           {"feature": "SMOOTH_F1", "distance": "MINKOWSKI"}),
    "voronoi randomness and detail": ("TexVoronoi", {"Randomness": 2, "Roughness": 3}, 1, {"Detail": 2.0, "Scale": 3}),
    "noise roughness and lacunarity": ("TexNoise", {"Roughness": 2, "Lacunarity": 1.5, "Distortion": 1}, 1,
                                       {"normalize": False, "noise_type": "MULTIFRACTAL"}),
    "hybrid noise gain": ("TexNoise", {"Gain": 2, "Offset": 1}, 0, {"noise_type": "HYBRID_MULTIFRACTAL"}),
    "wave phase": ("TexWave", {"Phase Offset": 2, "Detail Roughness": 1}, 0,
                   {"bands_direction": "DIAGONAL", "wave_profile": "TRI", "Distortion": 4}),
    "brick mortar and bias": ("TexBrick", {"Mortar Size": 2, "Bias": 1}, 0, {"offset": 0.3, "offset_frequency": 3}),
    "magic distortion": ("TexMagic", {"Distortion": 2}, 0, {"turbulence_depth": 5, "Scale": 2}),
    "checker scale": ("TexChecker", {"Scale": 1}, 0, {}),
    "gabor frequency": ("TexGabor", {"Frequency": 1.5, "Anisotropy": 2}, 0, {"Scale": 3}),
}  # fmt: skip
for _name, (_kind, _links, _output, _values) in _TEXTURES.items():
    feature(f"unusual/linked {_name}", _linked(f"ShaderNode{_kind}", _links, _output, **_values))


def _image(stage: Stage, **values: Any) -> Any:
    node = stage.node("ShaderNodeTexImage", **values)
    node.image = stage.image(alpha=True)
    return node


def _extended(extension: str, **values: Any) -> Callable[[Stage], None]:
    """An image that covers a part, mixed over another color by its alpha."""

    def build(stage: Stage) -> None:
        node, mix = _image(stage, extension=extension, **values), stage.node("ShaderNodeMix", data_type="RGBA")
        turn = stage.node("ShaderNodeMapping", Location=(-0.7, -0.4, 0.2), Rotation=(0, 0, 0.4), Scale=(2.6, 1.7, 1.0))
        is_solid = values.get("projection", "FLAT") != "FLAT"
        stage.link(_place(stage, "Generated" if is_solid else "UV"), turn.inputs["Vector"])
        stage.link(turn.outputs[0], node.inputs[0])
        mix.inputs[6].default_value = (0.1, 0.2, 0.6, 1)
        stage.link(node.outputs["Alpha"], mix.inputs[0])
        stage.link(node.outputs["Color"], mix.inputs[7])
        stage.into_color(mix.outputs[2])

    return build


for _way in ("CLIP", "EXTEND", "MIRROR"):
    feature(f"unusual/image {_way.lower()} with alpha", _extended(_way))
    feature(f"unusual/image {_way.lower()} on a box", _extended(_way, projection="BOX", projection_blend=0.3))
for _way in ("SPHERE", "TUBE"):
    feature(f"unusual/image on a {_way.lower()}", _extended("REPEAT", projection=_way))
for _way in ("Closest", "Cubic", "Smart"):
    feature(f"unusual/image interpolated {_way.lower()}", _extended("EXTEND", interpolation=_way))


def _two_maps(stage: Stage) -> None:
    """A normal map of a second UV map over a color of the first; the second is chosen for rendering."""
    layers = stage.ball.data.uv_layers
    uv = np.zeros(2 * len(stage.ball.data.loops), np.float32)
    layers[0].uv.foreach_get("vector", uv)
    second = layers.new(name="Second")
    second.uv.foreach_set("vector", (uv.reshape(-1, 2)[:, ::-1] * (2.0, 3.0)).astype(np.float32).ravel())
    second.active_render = True
    colored, bent = _image(stage), stage.node("ShaderNodeTexImage")
    bent.image = stage.image("Normals", is_data=True)
    stage.link(stage.node("ShaderNodeUVMap", uv_map=layers[0].name).outputs[0], colored.inputs[0])
    turned = stage.node("ShaderNodeNormalMap", uv_map="Second", Strength=0.6)
    stage.link(bent.outputs[0], turned.inputs["Color"])
    shader = stage.shader("ShaderNodeBsdfPrincipled", Roughness=0.4)
    stage.link(colored.outputs[0], shader.inputs["Base Color"])
    stage.link(turned.outputs[0], shader.inputs["Normal"])


def _bump_of_bump(stage: Stage) -> None:
    shader, normal = stage.shader("ShaderNodeBsdfPrincipled", Roughness=0.3), None
    for scale, strength in ((2.0, 0.4), (9.0, 0.2)):
        node = stage.node("ShaderNodeBump", Strength=strength, Distance=0.2)
        stage.link(_noise(stage, scale), node.inputs["Height"])
        if normal is not None:
            stage.link(normal, node.inputs["Normal"])
        normal = node.outputs[0]
    stage.link(normal, shader.inputs["Normal"])


def _shell(stage: Stage) -> None:
    """Fresnel mixes a clear coat over a mix of cloth and metal by a checker."""
    tree = stage.tree()
    checker, fresnel = stage.node("ShaderNodeTexChecker", Scale=6.0), stage.node("ShaderNodeFresnel", IOR=1.6)
    inner, outer = stage.node("ShaderNodeMixShader"), stage.node("ShaderNodeMixShader")
    metal = stage.node("ShaderNodeBsdfMetallic", Roughness=0.3)
    coat = stage.node("ShaderNodeBsdfAnisotropic", Roughness=0.1)
    stage.link(checker.outputs["Fac"], inner.inputs[0])
    stage.link(tree.nodes["shader"].outputs[0], inner.inputs[1])
    stage.link(metal.outputs[0], inner.inputs[2])
    stage.link(fresnel.outputs[0], outer.inputs[0])
    stage.link(inner.outputs[0], outer.inputs[1])
    stage.link(coat.outputs[0], outer.inputs[2])
    stage.link(outer.outputs[0], tree.nodes["output"].inputs[0])


def _principled(links: dict[str, tuple[float, str]], **values: Any) -> Callable[[Stage], None]:
    """Principled with sockets driven by noise."""

    def build(stage: Stage) -> None:
        shader = stage.shader("ShaderNodeBsdfPrincipled", **values)
        for name, (scale, output) in links.items():
            stage.link(_noise(stage, scale, output), shader.inputs[name])

    return build


feature("unusual/normals of a second UV map", _two_maps)
feature("unusual/bump of a bump", _bump_of_bump)
feature("unusual/coat over cloth and metal", _shell, 2)
feature("unusual/principled alpha and metal", _principled({"Alpha": (2, "Fac"), "Metallic": (3, "Fac")}, Roughness=0.3))
feature("unusual/principled transmission by noise", _principled(
    {"Transmission Weight": (2, "Fac"), "Roughness": (3, "Fac")}, Base_Color=(0.8, 0.9, 0.7, 1)), 3)  # fmt: skip
feature("unusual/principled emission by noise", _principled(
    {"Emission Color": (2, "Color"), "Emission Strength": (3, "Fac")}))  # fmt: skip
feature("unusual/principled subsurface by noise", _principled(
    {"Subsurface Weight": (2, "Fac"), "Base Color": (3, "Color")}, Subsurface_Scale=0.1), 3)  # fmt: skip
feature("unusual/principled sheen and coat by noise", _principled(
    {"Sheen Weight": (2, "Fac"), "Coat Weight": (3, "Fac"), "Coat Roughness": (1, "Fac")}), 2)  # fmt: skip
feature("unusual/principled anisotropy by noise", _principled(
    {"Anisotropic": (2, "Fac"), "Anisotropic Rotation": (1, "Fac")}, Metallic=1.0, Roughness=0.4), 2)  # fmt: skip


def _node(kind: str, setup: Callable[[Stage, Any], Any], **values: Any) -> Callable[[Stage], None]:
    """The ball shows an output of a node that ``setup`` connects and returns."""
    return lambda stage: stage.into_color(setup(stage, stage.node(kind, **values)))


def _curves(stage: Stage, node: Any) -> Any:
    curve = node.mapping.curves[3 if len(node.mapping.curves) > 3 else 0]
    curve.points[0].location, curve.points[-1].location = (0.0, 0.8), (1.0, 0.1)
    curve.points.new(0.4, 0.2).handle_type = "VECTOR"
    node.mapping.update()
    stage.link(_noise(stage, 2.0), node.inputs[0])
    stage.link(_noise(stage, 3.0, "Color"), node.inputs[-1])
    return node.outputs[0]


def _mixed(stage: Stage, node: Any) -> Any:
    free = [socket for socket in node.inputs if socket.enabled]
    for socket, scale in zip(free, (1.0, 2.0, 3.0), strict=False):
        stage.link(_noise(stage, scale, "Color"), socket)
    return next(socket for socket in node.outputs if socket.enabled)


feature("unusual/RGB curves with a linked factor", _node("ShaderNodeRGBCurve", _curves))
feature("unusual/vector curves with a linked factor", _node("ShaderNodeVectorCurve", _curves))
feature("unusual/mix of vectors with three factors", _node(
    "ShaderNodeMix", _mixed, data_type="VECTOR", factor_mode="NON_UNIFORM", clamp_factor=False))  # fmt: skip
for _blend in ("SOFT_LIGHT", "VALUE", "EXCLUSION", "DODGE", "BURN"):
    feature(f"unusual/mix {_blend.lower()} with linked inputs, clamped", _node(
        "ShaderNodeMix", _mixed, data_type="RGBA", blend_type=_blend, clamp_result=True))  # fmt: skip
feature("unusual/map range of vectors, stepped", _node(
    "ShaderNodeMapRange", _mixed, data_type="FLOAT_VECTOR", interpolation_type="STEPPED"))  # fmt: skip
feature("unusual/vector rotate with linked sockets", _node("ShaderNodeVectorRotate", _mixed))
feature("unusual/mapping of normals with linked sockets", _node("ShaderNodeMapping", _mixed, vector_type="NORMAL"))
feature("unusual/hue with linked sockets", _node("ShaderNodeHueSaturation", _mixed))


def _bytes(stage: Stage) -> None:
    """Byte colors with alpha at the corners, by the Color Attribute node."""
    layer = stage.ball.data.color_attributes.new("Paint", "BYTE_COLOR", "CORNER")
    count = len(layer.data)
    ramp = (np.arange(count) % 29) / 29
    layer.data.foreach_set("color_srgb", np.stack([ramp, 1 - ramp, ramp**2, 0.3 + 0.7 * ramp], -1).ravel().astype("f"))
    node, mix = stage.node("ShaderNodeVertexColor", layer_name="Paint"), stage.node("ShaderNodeMix", data_type="RGBA")
    stage.link(node.outputs["Alpha"], mix.inputs[0])
    stage.link(node.outputs["Color"], mix.inputs[7])
    stage.into_color(mix.outputs[2])


def _of_the_layer(stage: Stage) -> None:
    """Properties of the scene and the view layer, added."""
    stage.scene["tone"], stage.layer["tint"] = 0.4, (0.1, 0.5, 0.9)
    first, second = (
        stage.node("ShaderNodeAttribute", attribute_type="VIEW_LAYER", attribute_name=n) for n in ("tone", "tint")
    )
    mix = stage.node("ShaderNodeVectorMath", operation="MULTIPLY")
    stage.link(first.outputs["Fac"], mix.inputs[0])
    stage.link(second.outputs["Color"], mix.inputs[1])
    stage.into_color(mix.outputs[0])


def _own_slots(stage: Stage) -> None:
    """Slots linked to the object, faces beyond the last slot, and an empty slot."""
    green = stage.material("Green", Color=(0.2, 0.6, 0.1, 1))
    stage.ball.material_slots[0].link = "OBJECT"
    stage.ball.material_slots[0].material = green
    stage.ball.data.materials.append(None)
    count = len(stage.ball.data.polygons)
    stage.ball.data.polygons.foreach_set("material_index", (np.arange(count) * 4 // count).astype(np.int32))
    stage.ball.data.update()


feature("unusual/byte colors with alpha", _bytes)
feature("unusual/properties of scene and view layer", _of_the_layer)
feature("unusual/slots of the object and faces beyond them", _own_slots)
feature("unusual/muted and rerouted", lambda s: (lambda gamma, reroute: (
    setattr(gamma, "mute", True), s.link(_noise(s, 3.0, "Color"), gamma.inputs[0]), s.link(gamma.outputs[0],
    reroute.inputs[0]), s.into_color(reroute.outputs[0])))(
    s.node("ShaderNodeGamma", Gamma=3.0), s.node("NodeReroute")))  # fmt: skip
