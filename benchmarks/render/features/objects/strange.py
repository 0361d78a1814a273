# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that a suite with other shapes, cameras and random settings of every type of Blender found wrong at first."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from benchmarks.render.features import feature
from benchmarks.render.features.shading import normals
from benchmarks.render.features.stage import Stage

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

feature("strange/bump by Normal coordinates", _bump_by("ShaderNodeTexCoord", "Normal"))


def _wide_bump(stage: Stage) -> None:
    """A checkerboard of heights, whose edges are as wide as the filter."""
    checker, bump = stage.node("ShaderNodeTexChecker", Scale=6.0), stage.node("ShaderNodeBump", Distance=0.3)
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Generated"], checker.inputs["Vector"])
    bump.inputs["Filter Width"].default_value = 2.0
    stage.link(checker.outputs["Factor"], bump.inputs["Height"])
    stage.link(bump.outputs[0], stage.tree().nodes["shader"].inputs["Normal"])


feature("strange/bump of a wide filter", _wide_bump, 2)


def _tiled(sides: float, roundness: float, output: str) -> Build:
    def build(stage: Stage) -> None:
        node = stage.node("ShaderNodeRadialTiling", normalize=True, Sides=sides, Roundness=roundness)
        stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], node.inputs["Vector"])
        stage.into_color(node.outputs[output])

    return build


feature("strange/radial tiling", _tiled(5.0, 0.4, "Segment Coordinates"))
feature("strange/radial tiling of uneven sides", _tiled(5.4, 0.7, "Segment Coordinates"))
feature("strange/radial tiling width", _tiled(4.6, 0.2, "Segment Width"))


def _offset_terminator(stage: Stage) -> None:
    """A coarse smooth ball with both offsets of its shadow terminator."""
    bpy.data.objects.remove(stage.ball)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=6, location=(0, 0, 1))
    stage.ball = bpy.context.object
    stage.ball.data.polygons.foreach_set("use_smooth", [True] * len(stage.ball.data.polygons))
    stage.ball.data.materials.append(stage.material_of_ball)
    stage.ball.shadow_terminator_geometry_offset = 0.3
    stage.ball.shadow_terminator_shading_offset = 0.8


feature("strange/shadow terminator offsets", _offset_terminator)


def _culled(stage: Stage) -> None:
    """Simplify culls a wall behind the camera and a ball far from it, which lit and shaded the scene."""
    wall = stage.plane(20.0, stage.material("Wall", "ShaderNodeEmission", Strength=1.0), (0, -9, 0), (-1.57, 0, 0))
    far = stage.cube(stage.material_of_ball, (2.5, 6, 1), 2.0)
    cycles = stage.scene.cycles
    stage.scene.render.use_simplify = cycles.use_camera_cull = cycles.use_distance_cull = True
    cycles.distance_cull_margin = 9.0
    wall.cycles.use_camera_cull = far.cycles.use_distance_cull = True


feature("strange/culled objects", _culled)


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


# --- values and closures --------------------------------------------------------------------------------------------


def _alpha_of(kind: str, name: str) -> Build:
    """The alpha of an attribute, which is 0, 1 or the last of four numbers where the attribute is missing or short."""

    def build(stage: Stage) -> None:
        stage.ball.color = (0.3, 0.4, 0.5, 0.6)
        node = stage.node("ShaderNodeAttribute", attribute_type=kind, attribute_name=name)
        stage.into_color(node.outputs["Alpha"])

    return build


for _kind, _name in (("OBJECT", "color"), ("OBJECT", "none"), ("GEOMETRY", "none"), ("VIEW_LAYER", "none")):
    feature(f"strange/alpha of {_kind.lower()} attribute {_name}", _alpha_of(_kind, _name))


def _hair_on_mesh(**inputs: float) -> Build:
    """Hair of a mesh lies along an edge of each triangle; its sides reject part of a lamp's light."""

    def build(stage: Stage) -> None:
        stage.shader("ShaderNodeBsdfHairPrincipled", Color=(0.7, 0.7, 0.2, 1))
        for name, value in inputs.items():
            stage.tree().nodes["shader"].inputs[name].default_value = value
        bpy.data.objects.remove(stage.ball)
        bpy.ops.mesh.primitive_torus_add(
            major_radius=0.7, minor_radius=0.3, major_segments=36, minor_segments=14, location=(0, 0, 1),
            rotation=(0.8, 0.2, 0),
        )  # fmt: skip
        stage.ball = bpy.context.object
        stage.ball.data.materials.append(stage.material_of_ball)

    return build


feature("strange/hair on a torus", _hair_on_mesh(IOR=3.2), 2)
feature("strange/random hair on a torus", _hair_on_mesh(**{"Random Roughness": 0.6, "Random": 0.9}), 2)


def _dark_emission(stage: Stage) -> None:
    stage.shader("ShaderNodeBsdfPrincipled", Emission_Color=(1, 1, 1, 1), Emission_Strength=-1.0)


feature("strange/negative emission of a Principled BSDF", _dark_emission)


def _thin_metal(stage: Stage) -> None:
    """A metal that is darker toward grazing angles than its facing color and a tint of 1 would be."""
    node = stage.shader("ShaderNodeBsdfMetallic", Roughness=0.4)
    node.fresnel_type = "PHYSICAL_CONDUCTOR"
    node.inputs["IOR"].default_value, node.inputs["Extinction"].default_value = (0.5, 1.3, 0.8), (0.0, 0.1, 0.0)


feature("strange/metal of little extinction", _thin_metal, 2)


def _luminaire_of_place(stage: Stage) -> None:
    """An IES Texture on a surface, with directions up to the pole above and none at all."""
    node, gradient = stage.node("ShaderNodeTexIES"), stage.node("ShaderNodeTexGradient", gradient_type="SPHERICAL")
    node.mode, node.ies = "INTERNAL", bpy.data.texts.new("Luminaire")
    node.ies.write(
        "IESNA:LM-63-1995\nTILT=NONE\n1 1000 1 5 3 1 2 0 0 0\n1 1 100\n0 30 60 90 180\n0 45 90\n"
        "900 800 500 100 0\n700 900 300 200 50\n400 300 900 100 0\n"
    )
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Generated"], gradient.inputs["Vector"])
    stage.link(gradient.outputs["Color"], node.inputs["Vector"])
    node.inputs["Strength"].default_value = 0.1
    stage.glow(node.outputs[0])


feature("strange/luminaire of coordinates", _luminaire_of_place)
