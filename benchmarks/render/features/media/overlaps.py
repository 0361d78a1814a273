# SPDX-License-Identifier: GPL-3.0-or-later
"""Media that overlap, lie in each other, or lie in the world's medium; and the camera inside of media."""

from __future__ import annotations

from typing import Any

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage

WARM, COLD = (0.9, 0.5, 0.25, 1), (0.25, 0.55, 0.9, 1)


def _fill(stage: Stage, owner: Any, kind: str, **inputs: Any) -> None:
    """Give a material a volume shader instead of its surface."""
    tree = stage.tree(owner)
    if "shader" in tree.nodes:
        tree.nodes.remove(tree.nodes["shader"])
    node = tree.nodes.new(kind)
    for key, value in inputs.items():
        node.inputs[key.replace("_", " ")].default_value = value
    tree.links.new(node.outputs[0], tree.nodes["output"].inputs["Volume"])
    stage.scene.cycles.volume_biased = False


def _ball(stage: Stage, kind: str, **inputs: Any) -> None:
    _fill(stage, None, kind, **inputs)


def _cube(stage: Stage, location: Any, size: float, kind: str, **inputs: Any) -> Any:
    material = stage.material("Cube")
    _fill(stage, material, kind, **inputs)
    return stage.cube(material, location, size)


def _world_fog(stage: Stage, kind: str, **inputs: Any) -> None:
    tree = stage.tree(stage.scene.world)
    node = tree.nodes.new(kind)
    for key, value in inputs.items():
        node.inputs[key.replace("_", " ")].default_value = value
    output = next(item for item in tree.nodes if item.type == "OUTPUT_WORLD")
    tree.links.new(node.outputs[0], output.inputs["Volume"])
    stage.scene.cycles.volume_biased = False


SCATTER, ABSORB = "ShaderNodeVolumeScatter", "ShaderNodeVolumeAbsorption"


def absorbing_pair(stage: Stage) -> None:
    """Two absorbing bodies that overlap."""
    _ball(stage, ABSORB, Color=WARM, Density=0.8)
    _cube(stage, (0.7, 0.0, 1.0), 1.6, ABSORB, Color=COLD, Density=0.8)


def scattering_pair(stage: Stage) -> None:
    """Two scattering bodies that overlap."""
    _ball(stage, SCATTER, Color=WARM, Density=0.8)
    _cube(stage, (0.7, 0.0, 1.0), 1.6, SCATTER, Color=COLD, Density=0.8)


def nested(stage: Stage) -> None:
    """A dense cube in a ball of thin fog."""
    _ball(stage, SCATTER, Color=(1, 1, 1, 1), Density=0.4)
    _cube(stage, (0.0, 0.0, 1.0), 0.8, SCATTER, Color=COLD, Density=1.5)


def same_material(stage: Stage) -> None:
    """Two objects of one material count twice where they overlap."""
    _ball(stage, ABSORB, Color=WARM, Density=0.8)
    stage.cube(stage.material_of_ball, (0.7, 0.0, 1.0), 1.6)


def phases(stage: Stage) -> None:
    """Forward and backward scattering media in each other."""
    _ball(stage, SCATTER, Color=(1, 1, 1, 1), Density=0.7, Anisotropy=0.7)
    _cube(stage, (0.5, 0.0, 1.0), 1.6, SCATTER, Color=(1, 1, 1, 1), Density=0.7, Anisotropy=-0.5)


def emission_in_absorption(stage: Stage) -> None:
    """An emissive medium in an absorbing one."""
    _ball(stage, ABSORB, Color=WARM, Density=0.7)
    _cube(stage, (0.4, 0.0, 1.0), 1.2, "ShaderNodeEmission", Color=COLD, Strength=0.5)


def in_world_fog(stage: Stage) -> None:
    """A cloud in the world's fog, which goes on in it."""
    _ball(stage, SCATTER, Color=COLD, Density=1.0)
    _world_fog(stage, SCATTER, Color=(1, 1, 1, 1), Density=0.04)
    stage.scene.cycles.max_bounces = stage.scene.cycles.volume_bounces = 4


def in_absorbing_world(stage: Stage) -> None:
    """An absorbing ball in an absorbing world."""
    _ball(stage, ABSORB, Color=COLD, Density=1.0)
    _world_fog(stage, ABSORB, Color=WARM, Density=0.08)


def camera_inside(stage: Stage) -> None:
    """The camera in a large box of fog, with a denser ball in front."""
    _ball(stage, ABSORB, Color=COLD, Density=0.8)
    _cube(stage, (0.0, -2.0, 2.0), 12.0, ABSORB, Color=WARM, Density=0.05)


def noise_in_fog(stage: Stage) -> None:
    """A medium that varies, overlapped by one that does not."""
    _ball(stage, SCATTER, Color=WARM)
    tree = stage.tree()
    noise = tree.nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = 2.0
    scatter = next(node for node in tree.nodes if node.type == "VOLUME_SCATTER")
    place = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(place.outputs["Object"], noise.inputs["Vector"])
    tree.links.new(noise.outputs[0], scatter.inputs["Density"])
    _cube(stage, (0.7, 0.0, 1.0), 1.6, SCATTER, Color=COLD, Density=0.5)


def drink_in_glass(stage: Stage) -> None:
    """Glass with a colored body around an absorbing core."""
    stage.shader("ShaderNodeBsdfGlass", IOR=1.3)
    tree = stage.tree()
    node = tree.nodes.new(ABSORB)
    node.inputs["Color"].default_value, node.inputs["Density"].default_value = COLD, 0.4
    tree.links.new(node.outputs[0], tree.nodes["output"].inputs["Volume"])
    _cube(stage, (0.0, 0.0, 1.0), 0.8, ABSORB, Color=WARM, Density=1.0)


for _build in (
    absorbing_pair, scattering_pair, nested, same_material, phases, emission_in_absorption, in_world_fog,
    in_absorbing_world, camera_inside, noise_in_fog, drink_in_glass,
):  # fmt: skip
    feature(f"overlaps/{_build.__name__.replace('_', ' ')}", _build, 4)
