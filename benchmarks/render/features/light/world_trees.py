# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds of several nodes: textures into strengths and mixes, coordinates, corrections of environments."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage

Connect = Callable[[Stage, Any], Any]
"""Takes the stage and the world's Background node."""


def _world(connect: Connect, lit: bool = False) -> Callable[[Stage], None]:
    """A world alone, or (``lit``) with the stage's lamp."""

    def build(stage: Stage) -> None:
        if not lit:
            bpy.data.objects.remove(stage.lamp)
        background = next(node for node in stage.tree(stage.world).nodes if node.type == "BACKGROUND")
        connect(stage, background)

    return build


def _node(stage: Stage, kind: str, **values: Any) -> Any:
    return stage.node(f"ShaderNode{kind}", stage.world, **values)


def _pattern(kind: str, coordinate: str, target: str = "Color", output: int = 0, **values: Any) -> Connect:
    def connect(stage: Stage, background: Any) -> None:
        texture = _node(stage, kind, **values)
        stage.link(_node(stage, "TexCoord").outputs[coordinate], texture.inputs["Vector"])
        stage.link(texture.outputs[output], background.inputs[target])

    return connect


for _coordinate in ("Generated", "Normal", "Object", "Camera", "Window", "Reflection"):
    feature(f"world trees/noise by {_coordinate}", _world(_pattern("TexNoise", _coordinate, Scale=4.0)))
feature("world trees/voronoi into strength", _world(_pattern("TexVoronoi", "Generated", "Strength", Scale=3.0)))
feature("world trees/wave into strength", _world(_pattern("TexWave", "Object", "Strength", 1, Scale=1.5)))
feature("world trees/brick", _world(_pattern("TexBrick", "Generated", Scale=2.0)))
feature("world trees/magic", _world(_pattern("TexMagic", "Normal", Scale=2.0)))
feature("world trees/white noise", _world(_pattern("TexWhiteNoise", "Generated")))
feature("world trees/gabor", _world(_pattern("TexGabor", "Generated", "Strength", Scale=2.0)))


def _environment(stage: Stage) -> Any:
    texture = _node(stage, "TexEnvironment")
    texture.image = stage.environment()
    return texture


def _corrected(kind: str, **values: Any) -> Connect:
    """An environment through a color node."""

    def connect(stage: Stage, background: Any) -> None:
        node = _node(stage, kind, **values)
        source = next(s for s in node.inputs if s.type in ("RGBA",))
        stage.link(_environment(stage).outputs[0], source)
        stage.link(node.outputs[0], background.inputs["Color"])

    return connect


feature("world trees/environment with more saturation", _world(_corrected("HueSaturation", Saturation=1.6, Value=0.7)))
feature("world trees/environment with gamma", _world(_corrected("Gamma", Gamma=1.8)))
feature("world trees/environment inverted", _world(_corrected("Invert", Fac=0.6)))
feature("world trees/environment with contrast", _world(_corrected("BrightContrast", Contrast=0.4)))


def _exposed(stage: Stage, background: Any) -> None:
    """The exposure of an environment by a power of 2."""
    power = _node(stage, "Math", operation="POWER")
    power.inputs[0].default_value, power.inputs[1].default_value = 2.0, -1.5
    stage.link(_environment(stage).outputs[0], background.inputs["Color"])
    stage.link(power.outputs[0], background.inputs["Strength"])


def _mixed_by_height(stage: Stage, background: Any) -> None:
    """A ground below the horizon, an environment above it."""
    tree, split = stage.tree(stage.world), _node(stage, "SeparateXYZ")
    above = _node(stage, "Math", operation="GREATER_THAN")
    above.inputs[1].default_value = 0.0
    ground, mix = _node(stage, "Background", Color=(0.2, 0.15, 0.1, 1)), _node(stage, "MixShader")
    stage.link(_node(stage, "TexCoord").outputs["Generated"], split.inputs[0])
    stage.link(split.outputs["Z"], above.inputs[0])
    stage.link(above.outputs[0], mix.inputs[0])
    stage.link(_environment(stage).outputs[0], background.inputs["Color"])
    stage.link(ground.outputs[0], mix.inputs[1])
    stage.link(background.outputs[0], mix.inputs[2])
    stage.link(mix.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_WORLD").inputs[0])


def _bright_for_light(stage: Stage, background: Any) -> None:
    """An environment that the camera sees three times darker than it lights."""
    path, range_of = _node(stage, "LightPath"), _node(stage, "MapRange")
    range_of.inputs["To Min"].default_value, range_of.inputs["To Max"].default_value = 1.5, 0.5
    stage.link(path.outputs["Is Camera Ray"], range_of.inputs[0])
    stage.link(_environment(stage).outputs[0], background.inputs["Color"])
    stage.link(range_of.outputs[0], background.inputs["Strength"])


def _emission(stage: Stage, background: Any) -> None:
    tree = stage.tree(stage.world)
    emission = _node(stage, "Emission", Color=(0.3, 0.6, 0.9, 1), Strength=0.8)
    stage.link(emission.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_WORLD").inputs[0])


def _turned_by_vector(stage: Stage, background: Any) -> None:
    turn = _node(stage, "VectorRotate", rotation_type="Z_AXIS", Angle=1.1)
    texture = _environment(stage)
    stage.link(_node(stage, "TexCoord").outputs["Generated"], turn.inputs["Vector"])
    stage.link(turn.outputs[0], texture.inputs["Vector"])
    stage.link(texture.outputs[0], background.inputs["Color"])


def _by_object(stage: Stage, background: Any) -> None:
    """Coordinates of an empty that turns the environment."""
    empty = stage.object("Turner", None, (0, 0, 0), (0.2, 0.3, 0.9))
    place, texture = _node(stage, "TexCoord"), _environment(stage)
    place.object = empty
    stage.link(place.outputs["Object"], texture.inputs["Vector"])
    stage.link(texture.outputs[0], background.inputs["Color"])


def _three(stage: Stage, background: Any) -> None:
    """A sum of a mix and a color."""
    tree = stage.tree(stage.world)
    second, third = (_node(stage, "Background", Color=color) for color in ((0.5, 0.1, 0.1, 1), (0.05, 0.1, 0.2, 1)))
    mix, add = _node(stage, "MixShader", Fac=0.35), _node(stage, "AddShader")
    stage.link(_environment(stage).outputs[0], background.inputs["Color"])
    stage.link(background.outputs[0], mix.inputs[1])
    stage.link(second.outputs[0], mix.inputs[2])
    stage.link(mix.outputs[0], add.inputs[0])
    stage.link(third.outputs[0], add.inputs[1])
    stage.link(add.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_WORLD").inputs[0])


def _temperature(stage: Stage, background: Any) -> None:
    """A sky from warm at the horizon to cold above."""
    body, split, range_of = (_node(stage, kind) for kind in ("Blackbody", "SeparateXYZ", "MapRange"))
    range_of.inputs["To Min"].default_value, range_of.inputs["To Max"].default_value = 3000.0, 9000.0
    stage.link(_node(stage, "TexCoord").outputs["Generated"], split.inputs[0])
    stage.link(split.outputs["Z"], range_of.inputs[0])
    stage.link(range_of.outputs[0], body.inputs[0])
    stage.link(body.outputs[0], background.inputs["Color"])


feature("world trees/environment with an exposure", _world(_exposed))
feature("world trees/ground and environment", _world(_mixed_by_height))
feature("world trees/environment darker for the camera", _world(_bright_for_light))
feature("world trees/emission", _world(_emission))
feature("world trees/environment by Vector Rotate", _world(_turned_by_vector))
feature("world trees/environment by the coordinates of an empty", _world(_by_object))
feature("world trees/sum of a mix and a color", _world(_three))
feature("world trees/temperature by height", _world(_temperature))
feature(
    "world trees/negative strength", _world(lambda s, b: setattr(b.inputs["Strength"], "default_value", -1.0), True)
)
feature("world trees/environment and lamp", _world(lambda s, b: s.link(
    _environment(s).outputs[0], b.inputs["Color"]), True))  # fmt: skip
feature("world trees/background without a link to the output", _world(lambda s, b: s.tree(s.world).links.clear(), True))
feature("world trees/ray length", _world(lambda s, b: (
    lambda math: (setattr(math, "operation", "GREATER_THAN"), setattr(math.inputs[1], "default_value", 100.0),
                  s.link(_node(s, "LightPath").outputs["Ray Length"], math.inputs[0]),
                  s.link(math.outputs[0], b.inputs["Strength"])))(_node(s, "Math"))))  # fmt: skip
feature("world trees/sky turned by a mapping", _world(lambda s, b: (
    setattr(s.scene.cycles, "film_exposure", 0.05),
    (lambda place, turn, sky: (s.link(place.outputs["Generated"], turn.inputs[0]),
                               s.link(turn.outputs[0], sky.inputs[0]), s.link(sky.outputs[0], b.inputs[0])))(
        _node(s, "TexCoord"), _node(s, "Mapping", Rotation=(0.3, 0.0, 0.5)),
        _node(s, "TexSky", sky_type="SINGLE_SCATTERING", sun_disc=False)))))  # fmt: skip
feature("world trees/low sun with a large disk", _world(lambda s, b: (
    setattr(s.scene.cycles, "film_exposure", 0.05),
    s.link(_node(s, "TexSky", sky_type="MULTIPLE_SCATTERING", sun_elevation=0.1, sun_size=0.1,
                 sun_rotation=2.6).outputs[0], b.inputs[0]))))  # fmt: skip
