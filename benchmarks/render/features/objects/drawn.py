# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that another suite, drawn anew from Blender's types, found wrong at first."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage

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


def _coarse_world(interpolation: str, projection: str, scale: float = 1.0) -> Build:
    """A world of a coarse picture in bytes, whose filter counts."""

    def build(stage: Stage) -> None:
        tree = stage.tree(stage.world)
        node = stage.node("ShaderNodeTexEnvironment", stage.world, interpolation=interpolation, projection=projection)
        moved = stage.node("ShaderNodeMapping", stage.world, Rotation=(0.4, 0.2, 0.9), Scale=(1.0, scale, 1.0))
        node.image = stage.image()
        tree.links.new(stage.node("ShaderNodeTexCoord", stage.world).outputs["Generated"], moved.inputs["Vector"])
        tree.links.new(moved.outputs[0], node.inputs["Vector"])
        tree.links.new(node.outputs[0], next(n for n in tree.nodes if n.type == "BACKGROUND").inputs["Color"])

    return build


for _filter, _shape, _scale in (
    ("Linear", "EQUIRECTANGULAR", 1.0), ("Closest", "EQUIRECTANGULAR", 1.7), ("Cubic", "MIRROR_BALL", 1.0)
):  # fmt: skip
    feature(f"drawn/coarse {_shape.lower()} world, {_filter.lower()}", _coarse_world(_filter, _shape, _scale))


def _ball_in_tree(stage: Stage) -> None:
    """The picture of a mirror ball among other nodes, on a surface."""
    node = stage.node("ShaderNodeTexEnvironment", projection="MIRROR_BALL")
    node.image = stage.image()
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Normal"], node.inputs["Vector"])
    stage.into_color(node.outputs[0])


feature("drawn/mirror ball on a surface", _ball_in_tree)


def _shifted_camera(**values: float) -> Build:
    def build(stage: Stage) -> None:
        data = stage.camera.data
        for name, value in values.items():
            setattr(data.dof if name in ("use_dof", "focus_distance", "aperture_fstop") else data, name, value)

    return build


feature("drawn/camera that ends soon after its start", _shifted_camera(clip_start=5.2, clip_end=7.0))
feature(
    "drawn/focus before the start clip",
    _shifted_camera(clip_start=5.5, use_dof=1, focus_distance=3.0, aperture_fstop=0.8),
)


def _strength_of_points(kind: str) -> Build:
    """A lamp of size 0 whose power is not divided by its area."""

    def build(stage: Stage) -> None:
        data = stage.replace_lamp(kind, {"SUN": 3.0, "SPOT": 150.0}.get(kind, 40.0)).data
        data.normalize = False
        setattr(data, "angle" if kind == "SUN" else "shadow_soft_size", 0.0)

    return build


for _kind in ("POINT", "SPOT", "SUN"):
    feature(f"drawn/{_kind.lower()} of size 0 and plain strength", _strength_of_points(_kind))


def _wide_sun(stage: Stage) -> None:
    """A sky whose sun is 35° wide and half set."""
    bpy.data.objects.remove(stage.lamp)
    node = stage.node("ShaderNodeTexSky", stage.world, sun_size=0.6, sun_elevation=0.1, sun_rotation=2.4)
    tree = stage.tree(stage.world)
    background = next(n for n in tree.nodes if n.type == "BACKGROUND")
    background.inputs["Strength"].default_value = 0.1
    tree.links.new(node.outputs[0], background.inputs["Color"])


feature("drawn/wide sun at the horizon", _wide_sun)


def _far_magic(stage: Stage) -> None:
    """A Magic Texture of camera coordinates beyond 2π, where it has a seam."""
    node = stage.node("ShaderNodeTexMagic", Scale=1.7)
    moved = stage.node("ShaderNodeMapping", Location=(6.0, 6.0, 0.0))
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], moved.inputs["Vector"])
    stage.link(moved.outputs[0], node.inputs["Vector"])
    stage.into_color(node.outputs["Color"])


feature("drawn/seams of a magic texture", _far_magic)


def _edge_attribute(kind: str) -> Build:
    """Values of edges, which Blender gives to Cycles at the vertices."""

    def build(stage: Stage) -> None:
        made = stage.ball.data.attributes.new("Edges", kind, "EDGE")
        values = np.random.default_rng(8).random(len(made.data))
        made.data.foreach_set("value", values < 0.3 if kind == "BOOLEAN" else np.floor(3 * values).astype(np.int32))
        stage.into_color(stage.node("ShaderNodeAttribute", attribute_name="Edges").outputs["Fac"])

    return build


for _kind in ("BOOLEAN", "INT", "INT8"):
    feature(f"drawn/{_kind.lower()} of edges", _edge_attribute(_kind))


def _twice(stage: Stage) -> None:
    """A copy of the ball in the same position."""
    stage.scene.collection.objects.link(stage.ball.copy())


def _mirrored_onto_itself(stage: Stage) -> None:
    """A mirrored half that lies on the other one."""
    stage.ball.modifiers.new("Mirror", "MIRROR").use_mirror_merge = False


feature("drawn/ball that is there twice", _twice)
feature("drawn/mirror onto itself", _mirrored_onto_itself)
