# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds: colors, images, skies, mixes, backgrounds for the camera alone or for a type of ray."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


def _background(stage: Stage) -> Any:
    """The world's Background node, the lamp taken away."""
    bpy.data.objects.remove(stage.lamp)
    return next(node for node in stage.tree(stage.world).nodes if node.type == "BACKGROUND")


def _color_from(kind: str, output: str = "Color", **values: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        background = _background(stage)
        node = stage.node(kind, stage.world, **values)
        stage.link(node.outputs[output], background.inputs["Color"])

    return build


def _environment(mapping: dict[str, Any] | None = None, **values: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        background = _background(stage)
        texture = stage.node("ShaderNodeTexEnvironment", stage.world, **values)
        texture.image = stage.environment()
        stage.link(texture.outputs["Color"], background.inputs["Color"])
        if mapping is not None:
            place = stage.node("ShaderNodeTexCoord", stage.world)
            turn = stage.node("ShaderNodeMapping", stage.world, **mapping)
            stage.link(place.outputs["Generated"], turn.inputs["Vector"])
            stage.link(turn.outputs["Vector"], texture.inputs["Vector"])

    return build


def _combined(kind: str, factor: float | str = 0.5, *, image: bool = False) -> Callable[[Stage], None]:
    """Two backgrounds in a Mix or Add Shader; ``factor`` a number, or an output of the Light Path node."""

    def build(stage: Stage) -> None:
        first, tree = _background(stage), stage.tree(stage.world)
        second = stage.node("ShaderNodeBackground", stage.world, Color=(0.9, 0.2, 0.1, 1), Strength=0.8)
        if image:
            texture = stage.node("ShaderNodeTexEnvironment", stage.world)
            texture.image = stage.environment()
            stage.link(texture.outputs["Color"], first.inputs["Color"])
        node = stage.node(kind, stage.world)
        inputs = [socket for socket in node.inputs if socket.type == "SHADER"]
        stage.link(first.outputs[0], inputs[0])
        stage.link(second.outputs[0], inputs[1])
        if isinstance(factor, str):
            stage.link(stage.node("ShaderNodeLightPath", stage.world).outputs[factor], node.inputs[0])
        elif kind == "ShaderNodeMixShader":
            node.inputs[0].default_value = factor
        output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
        stage.link(node.outputs[0], output.inputs["Surface"])

    return build


def _mixed_colors(image: bool) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        background = _background(stage)
        mix = stage.node("ShaderNodeMixRGB", stage.world)
        mix.inputs[0].default_value = 0.4
        mix.inputs[2].default_value = (0.8, 0.2, 0.1, 1)
        if image:
            texture = stage.node("ShaderNodeTexEnvironment", stage.world)
            texture.image = stage.environment()
            stage.link(texture.outputs["Color"], mix.inputs[1])
        stage.link(mix.outputs[0], background.inputs["Color"])

    return build


def _gradient(kind: str) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        background = _background(stage)
        place = stage.node("ShaderNodeTexCoord", stage.world)
        texture = stage.node("ShaderNodeTexGradient", stage.world, gradient_type=kind)
        ramp = stage.node("ShaderNodeValToRGB", stage.world)
        ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.1, 0.2, 0.5, 1), (1.0, 0.8, 0.5, 1)
        stage.link(place.outputs["Generated"], texture.inputs["Vector"])
        stage.link(texture.outputs["Color"], ramp.inputs[0])
        stage.link(ramp.outputs["Color"], background.inputs["Color"])

    return build


def _height(stage: Stage) -> None:
    """The usual studio gradient: the height of the direction drives a mix."""
    background = _background(stage)
    place, split = stage.node("ShaderNodeTexCoord", stage.world), stage.node("ShaderNodeSeparateXYZ", stage.world)
    spread = stage.node("ShaderNodeMapRange", stage.world)
    spread.inputs["From Min"].default_value = -1.0
    stage.link(place.outputs["Generated"], split.inputs[0])
    stage.link(split.outputs["Z"], spread.inputs["Value"])
    stage.link(spread.outputs["Result"], background.inputs["Color"])


def _strength_from(kind: str, output: str, **values: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        background = _background(stage)
        stage.link(stage.node(kind, stage.world, **values).outputs[output], background.inputs["Strength"])

    return build


def _alone(change: Callable[[Stage], object]) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        _background(stage)
        change(stage)

    return build


feature("world/color", _alone(lambda stage: stage.set_world((0.3, 0.5, 0.7))))
feature("world/strength", _alone(lambda stage: stage.set_world((0.3, 0.5, 0.7), 2.5)))
feature("world/none", lambda stage: setattr(stage.scene, "world", None))
feature("world/empty tree", lambda stage: stage.tree(stage.world).nodes.clear())
feature("world/image", _environment())
feature("world/image turned", _environment({"Rotation": (0.3, 0.2, 0.7)}))
feature("world/image turned as texture", _environment({"vector_type": "TEXTURE", "Rotation": (0.3, 0.2, 0.7)}))
feature("world/image mirrored", _environment({"Scale": (-1.0, 1.0, 1.0)}))
feature("world/image stretched", _environment({"Scale": (1.0, 1.0, 2.5)}))
feature("world/image moved", _environment({"Location": (0.0, 0.0, 0.4)}))
feature("world/image mirror ball", _environment(projection="MIRROR_BALL"))


def _through_panel(stage: Stage) -> None:
    """The Texture Mapping of the sidebar, which turns and stretches the image."""
    _environment()(stage)
    panel = next(n for n in stage.tree(stage.world).nodes if n.type == "TEX_ENVIRONMENT").texture_mapping
    panel.rotation, panel.scale = (0.3, 0.2, 0.7), (1.0, 1.5, 1.0)


feature("world/image through its panel", _through_panel)
feature("world/image closest", _environment(interpolation="Closest"))
feature("world/mix of backgrounds", _combined("ShaderNodeMixShader", 0.3))
feature("world/mix of image and color", _combined("ShaderNodeMixShader", 0.3, image=True))
feature("world/sum of backgrounds", _combined("ShaderNodeAddShader"))
feature("world/sum of image and color", _combined("ShaderNodeAddShader", image=True))
for _ray in ("Is Camera Ray", "Is Diffuse Ray", "Is Glossy Ray", "Is Shadow Ray", "Is Transmission Ray"):
    feature(f"world/mix by {_ray}", _combined("ShaderNodeMixShader", _ray))
feature("world/mix by Is Camera Ray with image", _combined("ShaderNodeMixShader", "Is Camera Ray", image=True))
feature("world/strength by Is Camera Ray", _strength_from("ShaderNodeLightPath", "Is Camera Ray"))
feature("world/mixed colors", _mixed_colors(False))
feature("world/image mixed with a color", _mixed_colors(True))
for _kind in ("LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "SPHERICAL", "QUADRATIC_SPHERE", "RADIAL"):
    feature(f"world/gradient {_kind.lower()}", _gradient(_kind))
feature("world/gradient by height", _height)
for _sky in ("SINGLE_SCATTERING", "MULTIPLE_SCATTERING", "PREETHAM", "HOSEK_WILKIE"):
    _values = {"sky_type": _sky, "sun_elevation": 0.5, "sun_rotation": 2.0}
    feature(f"world/sky {_sky.lower()}", lambda s, v=_values: (
        _color_from("ShaderNodeTexSky", **v)(s), setattr(s.scene.cycles, "film_exposure", 0.05)))  # fmt: skip
feature("world/sky without disc", lambda s: (
    _color_from("ShaderNodeTexSky", sky_type="MULTIPLE_SCATTERING", sun_disc=False)(s),
    setattr(s.scene.cycles, "film_exposure", 0.05)))  # fmt: skip
feature("world/noise", _color_from("ShaderNodeTexNoise", Scale=3.0))
feature("world/checker", _color_from("ShaderNodeTexChecker", Scale=3.0))
feature("world/voronoi", _color_from("ShaderNodeTexVoronoi", Scale=3.0))
feature("world/blackbody", _color_from("ShaderNodeBlackbody", Temperature=3500.0))
feature("world/texture coordinate as color", _color_from("ShaderNodeTexCoord", "Generated"))
feature("world/camera coordinate as color", _color_from("ShaderNodeTexCoord", "Camera"))
feature("world/window coordinate as color", _color_from("ShaderNodeTexCoord", "Window"))
feature("world/ambient occlusion as color", _color_from("ShaderNodeAmbientOcclusion"))
feature("world/volume scatter", lambda s: s.link(
    s.node("ShaderNodeVolumeScatter", s.world, Density=0.08).outputs[0],
    next(n for n in s.tree(s.world).nodes if n.type == "OUTPUT_WORLD").inputs["Volume"]), 2)  # fmt: skip
feature("world/volume absorption", lambda s: s.link(
    s.node("ShaderNodeVolumeAbsorption", s.world, Density=0.08).outputs[0],
    next(n for n in s.tree(s.world).nodes if n.type == "OUTPUT_WORLD").inputs["Volume"]))  # fmt: skip
for _flag in ("camera", "diffuse", "glossy", "transmission", "scatter"):

    def _unseen(stage: Stage, flag: str = _flag) -> None:
        shader = {"glossy": "ShaderNodeBsdfAnisotropic", "transmission": "ShaderNodeBsdfGlass"}.get(flag)
        if shader:
            stage.shader(shader)
        setattr(stage.world.cycles_visibility, flag, False)

    feature(f"world/not visible to {_flag}", _unseen)
feature("world/sampling none", lambda s: (_environment()(s), setattr(s.world.cycles, "sampling_method", "NONE")), 4)
feature("world/sampling manual", lambda s: (_environment()(s), setattr(s.world.cycles, "sampling_method", "MANUAL")))
for _bounces in (0, 1):
    feature(f"world/max bounces {_bounces}", lambda s, n=_bounces: setattr(s.world.cycles, "max_bounces", n))
feature("world/sun threshold", lambda s: _environment()(s))
feature("world/light group", lambda s: (s.layer.lightgroups.add(name="sky"), setattr(s.world, "lightgroup", "sky")))
