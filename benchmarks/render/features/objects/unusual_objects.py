# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects as files from elsewhere have them: text, surfaces, metaballs, particles, drivers, constraints, libraries."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


def _hide_ball(stage: Stage) -> None:
    stage.ball.hide_render = True


def _with_material(stage: Stage, thing: Any) -> Any:
    thing.data.materials.append(stage.material_of_ball)
    return thing


def _generated(stage: Stage) -> None:
    """Colors of the generated coordinates on the ball's material."""
    stage.into_color(stage.node("ShaderNodeTexCoord").outputs["Generated"])


def _text(stage: Stage, **values: Any) -> Any:
    _hide_ball(stage)
    data = bpy.data.curves.new("Text", "FONT")
    data.body, data.extrude, data.bevel_depth, data.align_x, data.size = "Rg8", 0.15, 0.03, "CENTER", 1.4
    for name, value in values.items():
        setattr(data, name, value)
    return _with_material(stage, stage.object("Text", data, (0, 0, 0.4), (1.4, 0, 0.3)))


def _curve(stage: Stage, kind: str = "BEZIER", **values: Any) -> Any:
    _hide_ball(stage)
    data = bpy.data.curves.new("Curve", "CURVE")
    data.dimensions, data.bevel_depth, data.bevel_resolution = "3D", 0.15, 3
    for name, value in values.items():
        setattr(data, name, value)
    spline = data.splines.new(kind)
    places = [(-1.2, 0, 0.5), (-0.4, 0.4, 1.6), (0.4, -0.4, 0.6), (1.2, 0, 1.5)]
    if kind == "BEZIER":
        spline.bezier_points.add(len(places) - 1)
        for point, place in zip(spline.bezier_points, places, strict=True):
            point.co, point.handle_left_type, point.handle_right_type = place, "AUTO", "AUTO"
            point.tilt, point.radius = place[0], 1.0 + 0.5 * place[0]
    else:
        spline.points.add(len(places) - 1)
        for point, place in zip(spline.points, places, strict=True):
            point.co = (*place, 1.0)
        spline.use_endpoint_u = True
    return _with_material(stage, stage.object("Curve", data))


def _surface(stage: Stage) -> None:
    _hide_ball(stage)
    bpy.ops.surface.primitive_nurbs_surface_torus_add(radius=1.0, location=(0, 0, 1))
    _with_material(stage, bpy.context.object).rotation_euler = (0.9, 0.2, 0)


def _metaballs(stage: Stage) -> None:
    _hide_ball(stage)
    data = bpy.data.metaballs.new("Meta")
    data.render_resolution = data.resolution = 0.12
    for x, kind in ((-0.5, "BALL"), (0.5, "ELLIPSOID"), (0.0, "CUBE")):
        part = data.elements.new(type=kind)
        part.co, part.radius = (x, 0, 0.4 * abs(x)), 0.9
    _with_material(stage, stage.object("Meta", data, (0, 0, 1)))


feature("unusual/text", _text)
feature("unusual/text by generated coordinates", lambda s: (_text(s), _generated(s)))
feature("unusual/text on a curve", lambda s: setattr(_text(s).data, "follow_curve", _bent(s)))
feature("unusual/curve with a bevel and radii", _curve)
feature("unusual/curve by generated coordinates", lambda s: (_curve(s), _generated(s)))
feature("unusual/curve by UV", lambda s: (_curve(s), s.into_color(s.node("ShaderNodeTexCoord").outputs["UV"])))
feature("unusual/poly curve half filled", lambda s: _curve(s, "POLY", bevel_factor_end=0.6, use_fill_caps=True))
feature("unusual/NURBS curve extruded", lambda s: _curve(s, "NURBS", bevel_depth=0.0, extrude=0.4))
feature("unusual/NURBS surface", _surface)
feature("unusual/metaballs", _metaballs)


def _bent(stage: Stage) -> Any:
    made = _curve(stage, bevel_depth=0.0)
    made.hide_render = True
    return made


# --- instances ------------------------------------------------------------------------------------------------------


def _small(stage: Stage) -> Any:
    """A colored cone to be instanced, with a face color."""
    bpy.ops.mesh.primitive_cone_add(vertices=6, radius1=0.15, depth=0.4, location=(0, 0, 0))
    made = bpy.context.object
    made.data.materials.append(stage.material("Cone", "ShaderNodeBsdfPrincipled", Base_Color=(0.1, 0.4, 0.7, 1)))
    return made


def _on_parts(kind: str, **values: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=0.9, location=(0, 0, 1))
        parent, child = bpy.context.object, _small(stage)
        _hide_ball(stage)
        child.parent, parent.instance_type = parent, kind
        for name, value in values.items():
            setattr(parent, name, value)

    return build


def _particles(stage: Stage, **values: Any) -> Any:
    shown = _small(stage)
    shown.location = (0, 30, 0)
    settings = stage.ball.modifiers.new("P", "PARTICLE_SYSTEM").particle_system.settings
    settings.count, settings.frame_start, settings.frame_end, settings.lifetime = 60, 1, 1, 100
    settings.physics_type, settings.render_type, settings.instance_object = "NO", "OBJECT", shown
    settings.particle_size, settings.size_random, settings.use_rotations = 0.8, 0.5, True
    settings.rotation_factor_random = 0.3
    for name, value in values.items():
        setattr(settings, name, value)
    return settings


def _particle_group(stage: Stage) -> None:
    group = bpy.data.collections.new("Group")
    first, second = _small(stage), stage.cube(stage.material("Cube", Color=(0.7, 0.6, 0.1, 1)), (0, 0, 0), 0.2)
    for item in (first, second):
        stage.scene.collection.objects.unlink(item)
        group.objects.link(item)
    settings = _particles(stage, render_type="COLLECTION")
    settings.instance_collection = group
    settings.use_collection_pick_random = True


def _random_colors(stage: Stage) -> None:
    """Instances colored by the Random output and by their place."""
    settings = _particles(stage)
    material = settings.instance_object.data.materials[0]
    tree = stage.tree(material)
    info = tree.nodes.new("ShaderNodeObjectInfo")
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    ramp.color_ramp.elements[0].color = (0.8, 0.1, 0.1, 1)
    tree.links.new(info.outputs["Random"], ramp.inputs[0])
    tree.links.new(ramp.outputs[0], tree.nodes["shader"].inputs[0])


feature("unusual/instances on vertices, turned", _on_parts("VERTS", use_instance_vertices_rotation=True))
feature("unusual/instances on faces, scaled", _on_parts("FACES", use_instance_faces_scale=True,
        instance_faces_scale=1.5, show_instancer_for_render=False))  # fmt: skip
feature("unusual/particles that show an object", _particles)
feature("unusual/particles that show a collection", _particle_group)
feature("unusual/particles with random colors", _random_colors)
feature("unusual/particles along their speed", lambda s: _particles(
    s, physics_type="NEWTON", normal_factor=1.0, rotation_mode="VEL"))  # fmt: skip


def _nested(stage: Stage) -> None:
    """A collection instance in a collection that is instanced by a squeezed, turned, mirrored empty."""
    inner, outer = (bpy.data.collections.new(name) for name in ("Inner", "Outer"))
    cone = _small(stage)
    stage.scene.collection.objects.unlink(cone)
    inner.objects.link(cone)
    inner.instance_offset = (0.1, 0, -0.1)
    for k in range(3):
        empty = bpy.data.objects.new(f"In {k}", None)
        empty.location, empty.rotation_euler = (0.8 * k - 0.8, 0, 0.2), (0.4 * k, 0.3, 0)
        empty.instance_type, empty.instance_collection = "COLLECTION", inner
        outer.objects.link(empty)
    shown = stage.object("Out", None, (0, -1.4, 0.8), (0.2, 0.5, 0.3))
    shown.scale = (-1.5, 1.0, 2.0)
    shown.instance_type, shown.instance_collection = "COLLECTION", outer


feature("unusual/instances within mirrored instances", _nested)

# --- modifiers, drivers, constraints ----------------------------------------------------------------------------------


def _modified(kind: str, **values: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        if kind == "SKIN":  # around the edges of the fine ball it takes Blender minutes
            bpy.data.objects.remove(stage.ball)
            stage.ball = stage.cube(stage.material_of_ball, (0, 0, 1), 1.2)
        modifier = stage.ball.modifiers.new("M", kind)
        for name, value in values.items():
            setattr(modifier, name, value)
        _generated(stage)

    return build


for _name, _kind, _values in (
    ("wave", "WAVE", {"height": 0.4, "time_offset": -20.0}), ("screw", "SCREW", {"angle": 2.0, "screw_offset": 0.5}),
    ("mask by nothing", "MASK", {}), ("smooth", "LAPLACIANSMOOTH", {"lambda_factor": 2.0}),
    ("ocean", "OCEAN", {"geometry_mode": "GENERATE", "resolution": 6, "spatial_size": 8, "wave_scale": 0.3}),
    ("triangles and bevel", "BEVEL", {"width": 0.03, "segments": 2, "harden_normals": True}),
    ("build", "BUILD", {"frame_start": -50.0, "frame_duration": 100.0}), ("skin", "SKIN", {}),
    ("normals from a cylinder", "NORMAL_EDIT", {"mode": "DIRECTIONAL"}),
):  # fmt: skip
    feature(f"unusual/modifier {_name}", _modified(_kind, **_values))


def _boolean(stage: Stage) -> None:
    cutter = stage.cube(stage.material("Cut", Color=(0.1, 0.6, 0.2, 1)), (0.5, -0.7, 1.4), 1.2, (0.3, 0.2, 0.1))
    cutter.hide_render = True
    modifier = stage.ball.modifiers.new("B", "BOOLEAN")
    modifier.object, modifier.operation = cutter, "DIFFERENCE"


def _armature(stage: Stage) -> None:
    data = bpy.data.armatures.new("Rig")
    rig = stage.object("Rig", data)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    low, high = data.edit_bones.new("low"), data.edit_bones.new("high")
    low.head, low.tail, high.head, high.tail = (0, 0, 0), (0, 0, 1), (0, 0, 1), (0, 0, 2)
    high.parent = low
    bpy.ops.object.mode_set(mode="OBJECT")
    heights = np.array([v.co.z for v in stage.ball.data.vertices])
    for name, chosen in (("low", heights <= 0.1), ("high", heights > 0.1)):
        stage.ball.vertex_groups.new(name=name).add([int(k) for k in np.flatnonzero(chosen)], 1.0, "REPLACE")
    stage.ball.modifiers.new("A", "ARMATURE").object = rig
    rig.pose.bones["high"].rotation_mode = "XYZ"
    rig.pose.bones["high"].rotation_euler = (0.3, 0.0, 0.6)
    _generated(stage)


def _shape_key(stage: Stage) -> None:
    stage.ball.shape_key_add(name="Basis")
    key = stage.ball.shape_key_add(name="Tall")
    for point in key.data:
        point.co.z *= 1.6
    key.value = 0.7
    _generated(stage)


def _driver(stage: Stage) -> None:
    """The material's color and the ball's place by drivers of the frame."""
    value = stage.node("ShaderNodeValue")
    curve = value.outputs[0].driver_add("default_value")
    curve.driver.expression = "0.1 * frame"
    stage.into_color(value.outputs[0])
    stage.ball.driver_add("location", 0).driver.expression = "frame / 10"
    stage.scene.frame_set(5)


def _constraints(stage: Stage) -> None:
    cone = _small(stage)
    cone.location, cone.scale = (-1.3, -1, 1), (3, 3, 3)
    track = cone.constraints.new("TRACK_TO")
    track.target, track.track_axis, track.up_axis = stage.camera, "TRACK_Z", "UP_Y"
    follow = stage.lamp.constraints.new("DAMPED_TRACK")
    follow.target, follow.track_axis = stage.ball, "TRACK_NEGATIVE_Z"
    limit = stage.ball.constraints.new("LIMIT_LOCATION")
    limit.use_max_z, limit.max_z = True, 0.7


def _library(*, overridden: bool) -> Callable[[Stage], None]:
    """The ball's copy from another file, linked, and with an override of its place."""

    def build(stage: Stage) -> None:
        stage.ball.name = "From elsewhere"
        noise = stage.node("ShaderNodeTexNoise", Scale=4.0)
        stage.link(stage.node("ShaderNodeTexCoord").outputs["Object"], noise.inputs["Vector"])
        stage.into_color(noise.outputs["Color"])
        path = Path(tempfile.mkdtemp()) / "library.blend"
        bpy.data.libraries.write(str(path), {stage.ball})
        bpy.data.objects.remove(stage.ball)
        with bpy.data.libraries.load(str(path), link=True) as (_, to):
            to.objects = ["From elsewhere"]
        linked = to.objects[0]
        stage.scene.collection.objects.link(linked)
        if overridden:
            made = linked.override_create(remap_local_usages=True)
            made.location.x, made.scale = 0.4, (1.0, 1.0, 0.7)

    return build


feature("unusual/boolean", _boolean)
feature("unusual/armature", _armature)
feature("unusual/shape key by generated coordinates", _shape_key)
feature("unusual/drivers", _driver)
feature("unusual/constraints", _constraints)
feature("unusual/object of a library", _library(overridden=False))
feature("unusual/override of an object of a library", _library(overridden=True))
