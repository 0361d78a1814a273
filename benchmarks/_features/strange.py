# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that a suite with other shapes, cameras and random settings of every type of Blender found wrong at first."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from benchmarks._features import feature, normals
from benchmarks._features.stage import Stage

Build = Callable[[Stage], object]


# --- normals --------------------------------------------------------------------------------------------------------


def _raised_cup(shader: str, **inputs: float) -> Build:
    """The smooth-shaded cup above the floor: where faces coincide, Cycles loses light."""

    def build(stage: Stage) -> None:
        normals.cup(smooth=True, shader=shader)(stage)
        stage.ball.location.z = 0.3
        for name, value in inputs.items():
            stage.tree().nodes["shader"].inputs[name.replace("_", " ")].default_value = value

    return build


feature("strange/smooth cup of glass", _raised_cup("ShaderNodeBsdfGlass"), 4)
feature("strange/smooth cup of rough glass", _raised_cup("ShaderNodeBsdfGlass", Roughness=0.3), 4)
feature("strange/smooth cup that refracts", _raised_cup("ShaderNodeBsdfRefraction"), 3)
feature("strange/smooth cup of transmission", _raised_cup("ShaderNodeBsdfPrincipled", Transmission_Weight=1.0), 3)
feature("strange/smooth cup as a mirror", _raised_cup("ShaderNodeBsdfAnisotropic", Roughness=0.0), 2)


def _partly_smooth(kind: str, every: int) -> Build:
    """Some faces flat, the others smooth, and no sharp edge: smooth faces have the normals of their vertices."""

    def build(stage: Stage) -> None:
        bpy.data.objects.remove(stage.ball)
        getattr(bpy.ops.mesh, f"primitive_{kind}_add")(location=(0, 0, 1.1), rotation=(0.5, 0.4, 0.3))
        stage.ball = bpy.context.object
        faces = stage.ball.data.polygons
        faces.foreach_set("use_smooth", np.arange(len(faces)) % every > 0)
        stage.ball.data.materials.append(stage.material_of_ball)

    return build


feature("strange/cube of smooth and flat faces", _partly_smooth("cube", 2))
feature("strange/cylinder of smooth and flat faces", _partly_smooth("cylinder", 3))


def _displaced_with_normal_map(stage: Stage) -> None:
    """Displacement that bends, under a normal map: the map turns the smooth normal."""
    material, wave = stage.material_of_ball, stage.node("ShaderNodeTexWave", Scale=1.5)
    material.displacement_method = "BUMP"
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], wave.inputs["Vector"])
    raised = stage.node("ShaderNodeDisplacement", Scale=0.3)
    stage.link(wave.outputs["Fac"], raised.inputs["Height"])
    stage.link(raised.outputs[0], stage.tree().nodes["output"].inputs["Displacement"])
    mapped, image = stage.node("ShaderNodeNormalMap", Strength=0.6), stage.node("ShaderNodeTexImage")
    image.image = stage.image()
    blue = stage.node("ShaderNodeMixRGB", Fac=0.7, Color2=(0.5, 0.5, 1.0, 1.0))  # as normal maps are
    stage.link(image.outputs["Color"], blue.inputs["Color1"])
    stage.link(blue.outputs[0], mapped.inputs["Color"])
    stage.link(mapped.outputs[0], stage.tree().nodes["shader"].inputs["Normal"])


feature("strange/normal map on a displacement that bends", _displaced_with_normal_map)


# --- images, worlds, media ------------------------------------------------------------------------------------------


def _box_without_coordinates(stage: Stage) -> None:
    node = stage.node("ShaderNodeTexImage", projection="BOX", projection_blend=0.4)
    node.image = stage.image()
    stage.into_color(node.outputs["Color"])


feature("strange/box projection without coordinates", _box_without_coordinates)


def _panel_of_normals(stage: Stage) -> None:
    """A Texture Mapping panel of type Normal, which gives directions of length 1."""
    noise = stage.node("ShaderNodeTexNoise", Scale=4.0)
    panel = noise.texture_mapping
    panel.vector_type, panel.rotation, panel.scale = "NORMAL", (0.3, 0.5, 0.2), (1.5, 0.7, 1.0)
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], noise.inputs["Vector"])
    stage.into_color(noise.outputs["Color"])


feature("strange/texture mapping panel of directions", _panel_of_normals)


def _bump_by(coordinates: str, output: str) -> Build:
    def build(stage: Stage) -> None:
        wave, bump = stage.node("ShaderNodeTexWave", Scale=3.0), stage.node("ShaderNodeBump", Distance=0.2)
        stage.link(stage.node(coordinates).outputs[output], wave.inputs["Vector"])
        stage.link(wave.outputs["Fac"], bump.inputs["Height"])
        stage.link(bump.outputs[0], stage.tree().nodes["shader"].inputs["Normal"])

    return build


feature("strange/bump by window", _bump_by("ShaderNodeTexCoord", "Window"))
feature("strange/bump by camera", _bump_by("ShaderNodeTexCoord", "Camera"))
feature("strange/bump by view vector", _bump_by("ShaderNodeCameraData", "View Vector"))


def _camera_data_of_world(output: str) -> Build:
    def build(stage: Stage) -> None:
        tree = stage.tree(stage.world)
        data, part = stage.node("ShaderNodeCameraData", stage.world), stage.node("ShaderNodeMath", stage.world)
        part.operation = "FRACT"
        tree.links.new(data.outputs[output], part.inputs[0])
        tree.links.new(part.outputs[0], next(n for n in tree.nodes if n.type == "BACKGROUND").inputs["Color"])

    return build


for _output in ("View Z Depth", "View Distance"):
    feature(f"strange/world by {_output}", _camera_data_of_world(_output))


def _open_medium(shader: str, **inputs: Any) -> Build:
    """A medium in a mesh with a hole, which rays leave unnoticed."""

    def build(stage: Stage) -> None:
        tree = stage.tree()
        tree.nodes.remove(tree.nodes["shader"])
        made = stage.node(shader, **inputs)
        stage.link(made.outputs[0], tree.nodes["output"].inputs["Volume"])
        data = stage.ball.data
        mask = stage.ball.modifiers.new("Open", "MASK")
        group = stage.ball.vertex_groups.new(name="Kept")
        group.add([vertex.index for vertex in data.vertices if vertex.co.z < 0.6], 1.0, "REPLACE")
        mask.vertex_group = group.name

    return build


feature("strange/emission in an open mesh", _open_medium("ShaderNodeEmission", Strength=0.5))
feature("strange/absorption in an open mesh", _open_medium("ShaderNodeVolumeAbsorption", Density=1.0))
