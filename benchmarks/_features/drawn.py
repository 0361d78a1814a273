# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that another suite, drawn anew from Blender's types, found wrong at first."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from benchmarks._features import feature
from benchmarks._features.stage import Stage

Build = Callable[[Stage], object]


def _displaced_edges(method: str) -> Build:
    """A displaced cylinder with sharp edges, at which the faces of Cycles come apart before Blender 5.2."""

    def build(stage: Stage) -> None:
        bpy.data.objects.remove(stage.ball)
        bpy.ops.mesh.primitive_cylinder_add(
            vertices=32, radius=0.8, depth=1.4, location=(0, 0, 1), rotation=(0.4, 0.2, 0)
        )
        bpy.ops.object.shade_smooth_by_angle(angle=0.7)
        stage.ball = bpy.context.object
        stage.ball.data.materials.append(stage.material_of_ball)
        stage.material_of_ball.displacement_method = method
        raised = stage.node("ShaderNodeDisplacement", Height=1.0, Midlevel=0.0, Scale=0.15)
        stage.link(raised.outputs[0], stage.tree().nodes["output"].inputs["Displacement"])

    return build


for _method in ("DISPLACEMENT", "BOTH"):
    feature(f"drawn/sharp edges of {_method.lower()}", _displaced_edges(_method))


def _tangent_of(kind: str, node: str) -> Build:
    """A tangent where no mesh defines it: around an axis of the lamp or of the world."""

    def build(stage: Stage) -> None:
        if kind == "world":
            owner, target = stage.world, "BACKGROUND"
        else:
            owner, target = stage.replace_lamp(kind, {"SUN": 3.0, "SPOT": 600.0}.get(kind, 200.0)).data, "EMISSION"
        tree = stage.tree(owner)
        made = stage.node(node, owner)
        tree.links.new(made.outputs["Tangent"], next(n for n in tree.nodes if n.type == target).inputs["Color"])

    return build


for _kind in ("POINT", "SPOT", "AREA", "SUN", "world"):
    for _node in ("ShaderNodeTangent", "ShaderNodeNewGeometry"):
        feature(f"drawn/{_node[10:]} tangent of {_kind.lower()}", _tangent_of(_kind, _node))
