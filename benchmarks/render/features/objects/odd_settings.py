# SPDX-License-Identifier: GPL-3.0-or-later
"""Odd settings of nodes on odd objects, wrong at first: emission by tangents, coats over subsurface light, points."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from benchmarks.render.features import feature
from benchmarks.render.features.objects.unusual_instances import Tree
from benchmarks.render.features.stage import Stage

Build = Callable[[Stage], object]


def _tangent(stage: Stage, scale: tuple[float, float, float]) -> None:
    """A ball that shines as its tangents point, of either sign, in a dark room."""
    stage.glow(stage.node("ShaderNodeTangent", direction_type="UV_MAP").outputs[0])
    stage.ball.scale, stage.ball.rotation_euler = scale, (0.4, 0.2, 0.9)
    stage.lamp.hide_render = True
    stage.set_world((0, 0, 0))


def _coarse_glow(stage: Stage) -> None:
    """A coarse ball in smooth shading that shines as its normals point."""
    bpy.data.objects.remove(stage.ball)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=6, ring_count=4, radius=1.0, location=(0, 0, 1))
    stage.ball = bpy.context.object
    stage.ball.data.materials.append(stage.material_of_ball)
    for face in stage.ball.data.polygons:
        face.use_smooth = True
    facing = stage.node("ShaderNodeLayerWeight", Blend=0.3)
    stage.glow(facing.outputs["Facing"])
    stage.lamp.hide_render = True
    stage.set_world((0, 0, 0))


def _coat(stage: Stage, weight: float, ior: float) -> None:
    node = stage.shader("ShaderNodeBsdfPrincipled", Coat_Weight=1.0, Coat_IOR=ior, Coat_Tint=(0.3, 0.7, 0.9, 1),
                        Subsurface_Weight=weight, Subsurface_Scale=0.5)  # fmt: skip
    node.inputs["Subsurface Radius"].default_value = (0.4, 0.2, 0.1)


def _points(stage: Stage, output: str) -> None:
    """Points of different radii on a flattened object, which show an output of Point Info."""
    stage.ball.hide_render = True
    tree = Tree(stage)
    vector = {"data_type": "FLOAT_VECTOR"}
    place = tree.add("FunctionNodeRandomValue", vector, Min=(-1.0, -0.6, 0.1), Max=(1.0, 0.6, 1.8))
    radius = tree.add("FunctionNodeRandomValue", Min=0.05, Max=0.3, Seed=2)
    points = tree.add("GeometryNodePoints", Count=60, Position=place, Radius=radius)
    points = tree.add("GeometryNodeSetMaterial", Geometry=points, Material=stage.material_of_ball)
    stage.glow(stage.node("ShaderNodePointInfo").outputs[output])
    tree.show(points, (0.2, -0.3, 0.1)).scale = (1.0, 1.0, 0.8)


for _scale in ((1.0, 1.0, 1.0), (-1.0, 1.0, 1.0), (-1.0, 0.6, 1.2)):
    feature(f"odd_settings/emission by tangents, scale {_scale}", lambda stage, scale=_scale: _tangent(stage, scale), 2)
feature("odd_settings/coarse ball that shines where it is seen from the side", _coarse_glow, 2)
for _weight, _ior in ((0.5, 3.0), (1.0, 1.5)):
    feature(f"odd_settings/tinted coat of index {_ior} over subsurface {_weight}",
            lambda stage, weight=_weight, ior=_ior: _coat(stage, weight, ior), 2)  # fmt: skip
for _output in ("Position", "Radius", "Random"):
    feature(f"odd_settings/points by Point Info {_output}", lambda stage, output=_output: _points(stage, output))


def _by_rays(stage: Stage) -> None:
    """A ball that only diffuse rays see, as the one light."""
    stage.glow(stage.node("ShaderNodeLightPath").outputs["Is Diffuse Ray"])
    stage.lamp.hide_render = True
    stage.set_world((0, 0, 0))


feature("odd_settings/emission for diffuse rays alone", _by_rays, 2)


def _by_bump(stage: Stage) -> None:
    """A ball that shines as its bumped normals point, as the one light."""
    bump = stage.node("ShaderNodeBump", Strength=1.0)
    stage.link(stage.node("ShaderNodeTexNoise", Scale=4.0).outputs[0], bump.inputs["Height"])
    stage.glow(bump.outputs["Normal"])
    stage.lamp.hide_render = True
    stage.set_world((0, 0, 0))


feature("odd_settings/emission by bumped normals", _by_bump, 2)


def _color_as_shader(stage: Stage) -> None:
    """A texture linked to the output without a shader, and a number as one shader of a mix."""
    mix = stage.shader("ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.4
    stage.link(stage.node("ShaderNodeTexChecker", Scale=5.0).outputs["Color"], mix.inputs[1])
    stage.link(stage.node("ShaderNodeNewGeometry").outputs["Backfacing"], mix.inputs[2])


feature("odd_settings/colors in place of shaders", _color_as_shader)
