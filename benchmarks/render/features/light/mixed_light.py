# SPDX-License-Identifier: GPL-3.0-or-later
"""Patterns that emit light, many lamps, leaves with shadows, media among other objects."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage

# --- light ---------------------------------------------------------------------------------------------------------


def _emissive(kind: str) -> Callable[[Stage], None]:
    """The ball lights the floor with a pattern."""

    def build(stage: Stage) -> None:
        bpy.data.objects.remove(stage.lamp)
        stage.set_world((0, 0, 0))
        shader = stage.shader("ShaderNodeEmission", Strength=3.0)
        if kind == "image":
            node = stage.node("ShaderNodeTexImage")
            node.image = stage.image()
            output = node.outputs["Color"]
        elif kind == "generated":
            output = stage.node("ShaderNodeTexCoord").outputs["Generated"]
        elif kind == "attribute":
            mesh = stage.ball.data
            layer = mesh.color_attributes.new("Tint", "FLOAT_COLOR", "POINT")
            height = np.empty(len(mesh.vertices) * 3, np.float32)
            mesh.attributes["position"].data.foreach_get("vector", height)
            z = height.reshape(-1, 3)[:, 2] > 0
            values = np.where(z[:, None], (0.1, 0.2, 1.0, 1.0), (1.0, 0.3, 0.1, 1.0))
            layer.data.foreach_set("color", values.astype(np.float32).ravel())
            output = stage.node("ShaderNodeVertexColor", layer_name="Tint").outputs["Color"]
        elif kind == "noise":
            output = stage.node("ShaderNodeTexNoise", Scale=2.0).outputs["Color"]
        elif kind == "facing":
            output = stage.node("ShaderNodeLayerWeight").outputs["Facing"]
        elif kind == "back faces":
            output = stage.node("ShaderNodeNewGeometry").outputs["Backfacing"]
        else:
            output = stage.node("ShaderNodeBlackbody", Temperature=2500.0).outputs[0]
        stage.link(output, shader.inputs["Color"])

    return build


for _kind in ("image", "generated", "attribute", "noise", "facing", "back faces", "blackbody"):
    feature(f"mixed/emission by {_kind}", _emissive(_kind), 2)


def _many_lamps(stage: Stage) -> None:
    for k in range(12):
        stage.light("POINT", 20.0, (2 * np.cos(k), 2 * np.sin(k), 1.5), color=(1.0, 0.1 * (k % 5), 0.2))


feature("mixed/many lamps", _many_lamps)
feature("mixed/lamp without power", lambda s: setattr(s.lamp.data, "energy", 0.0))
feature("mixed/lamp behind a wall", lambda s: s.plane(6.0, s.floor.data.materials[0], (1.0, -1.0, 2.5), (0.5, 0.4, 0)))
feature("mixed/leaf with shadow", lambda s: (
    s.plane(2.0, (lambda m: (_leaf(s, m), m)[1])(s.material("Leaf", "ShaderNodeBsdfPrincipled")), (0.5, -0.8, 2.2)),
    None))  # fmt: skip


def _leaf(stage: Stage, material: Any) -> None:
    tree = stage.tree(material)
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = stage.image("Leaf", alpha=True)
    tree.links.new(node.outputs["Color"], tree.nodes["shader"].inputs["Base Color"])
    tree.links.new(node.outputs["Alpha"], tree.nodes["shader"].inputs["Alpha"])


# --- media and cameras ---------------------------------------------------------------------------------------------


def _volume(stage: Stage, material: Any, kind: str = "ShaderNodeVolumeScatter", **inputs: Any) -> None:
    tree = stage.tree(material)
    node = tree.nodes.new(kind)
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    if "shader" in tree.nodes:
        tree.nodes.remove(tree.nodes["shader"])
    tree.links.new(node.outputs[0], tree.nodes["output"].inputs["Volume"])


def _fog_with_ball(stage: Stage) -> None:
    """A box of fog around the ball, the lamp and the camera."""
    fog = stage.material("Fog")
    _volume(stage, fog, Density=0.06)
    stage.cube(fog, (0, 0, 2), 15.0)


def _fog_with_filled_ball(stage: Stage) -> None:
    _fog_with_ball(stage)
    _volume(stage, stage.material_of_ball, "ShaderNodeVolumeAbsorption", Color=(0.2, 0.5, 0.9, 1), Density=1.5)


feature("mixed/fog around everything", _fog_with_ball, 2)
feature("mixed/medium in fog", _fog_with_filled_ball, 2)
feature("mixed/medium mirrored", lambda s: (
    _volume(s, s.material_of_ball, Density=1.0), setattr(s.ball, "scale", (-1, 1, 1))), 2)  # fmt: skip
feature("mixed/medium on a transparent film", lambda s: (
    _volume(s, s.material_of_ball, Density=1.0), setattr(s.scene.render, "film_transparent", True)), 2)  # fmt: skip
feature("mixed/medium with depth of field", lambda s: (
    _volume(s, s.material_of_ball, Density=1.0), setattr(s.camera.data.dof, "use_dof", True),
    setattr(s.camera.data.dof, "focus_distance", 4.0),
    setattr(s.camera.data.dof, "aperture_fstop", 0.2)), 2)  # fmt: skip
feature("mixed/panorama with motion", lambda s: (
    setattr(s.camera.data, "type", "PANO"), s.ball.keyframe_insert("location", frame=0),
    setattr(s.ball, "location", (1, 0, 1)), s.ball.keyframe_insert("location", frame=2), s.scene.frame_set(1),
    setattr(s.scene.render, "use_motion_blur", True)), 2)  # fmt: skip
