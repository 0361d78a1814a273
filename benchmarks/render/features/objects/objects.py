# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects: kinds, transforms, modifiers, instances, normals, visibility, hair and points."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


def _ball(**values: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        for name, value in values.items():
            setattr(stage.ball, name, value)

    return build


def _cycles(**values: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        for name, value in values.items():
            setattr(stage.ball.cycles, name, value)

    return build


def _modified(kind: str, **values: Any) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        modifier = stage.ball.modifiers.new("M", kind)
        for name, value in values.items():
            setattr(modifier, name, value)

    return build


feature(
    "objects/flat shaded",
    lambda s: s.ball.data.polygons.foreach_set("use_smooth", np.zeros(len(s.ball.data.polygons), bool)),
)
feature("objects/scaled", _ball(scale=(1.5, 0.6, 0.8)))
feature("objects/mirrored", _ball(scale=(-1.0, 1.0, 1.0)))
feature("objects/sheared by a parent", lambda s: (lambda parent: (
    setattr(parent, "scale", (2.0, 1.0, 0.5)), setattr(s.ball, "parent", parent),
    setattr(s.ball, "rotation_euler", (0.5, 0.5, 0.5))))(s.object("Parent", None)))  # fmt: skip
feature("objects/hidden in renders", _ball(hide_render=True))
feature("objects/display as wire", _ball(display_type="WIRE"))
feature("objects/subdivision", _modified("SUBSURF", render_levels=1))
feature("objects/array", _modified("ARRAY", count=3, relative_offset_displace=(0.6, 0.0, 0.0)))
feature("objects/mirror modifier", _modified("MIRROR", use_bisect_axis=(True, False, False)))
feature("objects/solidify", _modified("SOLIDIFY", thickness=0.2))
feature("objects/bevel", _modified("BEVEL", width=0.05))
feature("objects/decimate", _modified("DECIMATE", ratio=0.1))
feature("objects/displace", _modified("DISPLACE", strength=0.3))
feature("objects/edge split", _modified("EDGE_SPLIT", split_angle=0.1))
feature("objects/wireframe", _modified("WIREFRAME", thickness=0.1))
feature("objects/remesh", _modified("REMESH", mode="VOXEL", voxel_size=0.15))
feature("objects/cast", _modified("CAST", cast_type="CUBOID", factor=0.7))
feature("objects/simple deform", _modified("SIMPLE_DEFORM", deform_method="TWIST", angle=1.0))
feature("objects/weighted normals", _modified("WEIGHTED_NORMAL"))


def _wound_both_ways(shader: str, **inputs: Any) -> Callable[[Stage], None]:
    """A smooth ball some of whose faces point inward, as in files that passed through several programs."""

    def change(stage: Stage) -> None:
        for polygon in list(stage.ball.data.polygons)[::4]:
            polygon.flip()
        stage.ball.data.update()
        stage.shader(shader, **inputs)

    return change


for _shader in ("ShaderNodeBsdfDiffuse", "ShaderNodeBsdfGlossy", "ShaderNodeBsdfPrincipled", "ShaderNodeBsdfToon"):
    feature(f"objects/faces of both windings, {_shader[14:]}", _wound_both_ways(_shader))
for _ray in ("camera", "diffuse", "glossy", "transmission", "shadow", "volume_scatter"):

    def _unseen(stage: Stage, ray: str = _ray) -> None:
        shader = {"glossy": "ShaderNodeBsdfAnisotropic", "transmission": "ShaderNodeBsdfGlass"}.get(ray)
        if shader:  # the floor shows its reflection or transmission
            tree = stage.tree(stage.floor.data.materials[0])
            node = tree.nodes.new(shader)
            tree.links.new(node.outputs[0], tree.nodes["output"].inputs["Surface"])
        setattr(stage.ball, f"visible_{ray}", False)

    feature(f"objects/not visible to {_ray}", _unseen, 2)
feature("objects/holdout", _ball(is_holdout=True))
feature("objects/shadow catcher", _ball(is_shadow_catcher=True))
feature("objects/shadow catcher below", lambda s: setattr(s.floor, "is_shadow_catcher", True), 2)


def _added_lamp(stage: Stage, *, and_footage: bool) -> None:
    """A lamp that is not in the footage: it brightens the catcher, which a picture cannot show."""
    stage.floor.is_shadow_catcher, stage.lamp.is_shadow_catcher = True, False
    stage.scene.render.film_transparent = True
    if and_footage:
        stage.light("POINT", 200.0, (-2, -2, 3))


feature("objects/shadow catcher under an added lamp", lambda s: _added_lamp(s, and_footage=False), 2)
feature("objects/shadow catcher under two kinds of lamps", lambda s: _added_lamp(s, and_footage=True), 2)
feature(
    "objects/shadow catcher below a mirror",
    lambda s: (setattr(s.floor, "is_shadow_catcher", True), s.shader("ShaderNodeBsdfGlossy", Roughness=0.2)),
    2,
)
feature(
    "objects/shadow catcher beside an emissive ball",
    lambda s: (
        setattr(s.floor, "is_shadow_catcher", True),
        setattr(s.scene.render, "film_transparent", True),
        s.sphere(s.material("Glow", "ShaderNodeEmission", Color=(1, 0.6, 0.3, 1), Strength=6.0), (1.5, -1.2, 0.4), 0.4),
    ),
    2,
)
feature("objects/shadow terminator offset", _cycles(shadow_terminator_offset=0.3))
feature("objects/shadow terminator geometry offset", _cycles(shadow_terminator_geometry_offset=0.5))
feature("objects/ambient occlusion distance", _cycles(ao_distance=1.0))


def _kind(make: Callable[[Stage], Any]) -> Callable[[Stage], None]:
    """Something else in place of the ball."""

    def build(stage: Stage) -> None:
        bpy.data.objects.remove(stage.ball)
        stage.ball = make(stage)
        stage.ball.data.materials.append(stage.material_of_ball)

    return build


def _primitive(operator: str, **values: Any) -> Callable[[Stage], Any]:
    def make(stage: Stage) -> Any:
        module, name = operator.split(".")
        getattr(getattr(bpy.ops, module), name)(location=(0, 0, 1), **values)
        return bpy.context.object

    return make


feature("objects/curve with bevel", _kind(lambda s: (lambda o: (setattr(o.data, "bevel_depth", 0.2), o)[1])(
    _primitive("curve.primitive_bezier_circle_add")(s))))  # fmt: skip
feature("objects/text", _kind(lambda s: (lambda o: (setattr(o.data, "extrude", 0.2), setattr(
    o, "rotation_euler", (1.5, 0, 0)), o)[2])(_primitive("object.text_add")(s))))  # fmt: skip
feature("objects/metaball", _kind(_primitive("object.metaball_add")))
feature("objects/surface", _kind(_primitive("surface.primitive_nurbs_surface_sphere_add")))
feature("objects/suzanne", _kind(_primitive("mesh.primitive_monkey_add")))


def _slots(stage: Stage) -> None:
    stage.ball.data.materials.append(stage.material("Second", Color=(0.1, 0.5, 0.2, 1)))
    count = len(stage.ball.data.polygons)
    stage.ball.data.polygons.foreach_set("material_index", (np.arange(count) % 2).astype(np.int32))


feature("objects/material slots", _slots)


def _object_slot(stage: Stage) -> None:
    slot = stage.ball.material_slots[0]
    slot.link = "OBJECT"
    slot.material = stage.material("Own", Color=(0.1, 0.5, 0.2, 1))


feature("objects/material of the object", _object_slot)


def _shape_key(stage: Stage) -> None:
    stage.ball.shape_key_add(name="Basis")
    key = stage.ball.shape_key_add(name="Wide")
    for point in key.data:
        point.co.x *= 1.6
    key.value = 0.7


feature("objects/shape key", _shape_key)


def _custom_normals(stage: Stage) -> None:
    mesh = stage.ball.data
    mesh.normals_split_custom_set([(0.3, -0.6, 0.7)] * len(mesh.loops))


feature("objects/custom normals", _custom_normals)


def _instances(kind: str) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        if kind == "COLLECTION":
            group = bpy.data.collections.new("Group")
            group.objects.link(stage.ball)
            for x in (-2.2, 2.2):
                empty = stage.object(f"Empty {x}", None, (x, 0, 0), (0, 0, 0.5))
                empty.instance_type, empty.instance_collection = "COLLECTION", group
            return
        small = stage.cube(stage.material("Small", Color=(0.2, 0.4, 0.7, 1)), (0, 0, 0), 0.15)
        small.parent = stage.ball
        stage.ball.instance_type = kind

    return build


for _kind_of in ("COLLECTION", "VERTS", "FACES"):
    feature(f"objects/instances {_kind_of.lower()}", _instances(_kind_of))


def _particles(render_type: str) -> Callable[[Stage], None]:
    def build(stage: Stage) -> None:
        small = stage.cube(stage.material("Small", Color=(0.2, 0.4, 0.7, 1)), (0, 0, -5), 1.0)
        stage.ball.modifiers.new("P", "PARTICLE_SYSTEM")
        settings = stage.ball.particle_systems[0].settings
        settings.type, settings.count, settings.hair_length = "HAIR", 300, 0.6
        settings.render_type, settings.particle_size = render_type, 0.1
        if render_type == "OBJECT":
            settings.instance_object = small

    return build


feature("objects/particle objects", _particles("OBJECT"))
feature("objects/particle hair", _particles("PATH"))


def _curves(stage: Stage) -> None:
    curves = bpy.data.hair_curves.new("Curves")
    curves.add_curves([4] * 200)
    rng = np.random.default_rng(1)
    roots = rng.normal(size=(200, 3))
    roots /= np.linalg.norm(roots, axis=1, keepdims=True)
    points = (roots[:, None, :] * np.linspace(1.0, 1.6, 4)[None, :, None]).reshape(-1, 3) + np.array([0, 0, 1])
    curves.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    radii = curves.attributes.new("radius", "FLOAT", "POINT")
    radii.data.foreach_set("value", np.full(800, 0.02, np.float32))
    curves.materials.append(stage.material_of_ball)
    stage.object("Curves", curves)


feature("objects/hair curves", _curves)


def _nodes(stage: Stage, *kinds: str) -> tuple[Any, list[Any]]:
    """A geometry node tree on the ball; the nodes of the given types."""
    tree = bpy.data.node_groups.new("Geometry", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    stage.ball.modifiers.new("G", "NODES").node_group = tree
    nodes = [tree.nodes.new(kind) for kind in ("NodeGroupInput", *kinds, "NodeGroupOutput")]
    for before, after in itertools.pairwise(nodes):
        tree.links.new(before.outputs[0], after.inputs[0])
    return tree, nodes[1:-1]


def _point_cloud(stage: Stage) -> None:
    _, (points,) = _nodes(stage, "GeometryNodeMeshToPoints")
    points.inputs["Radius"].default_value = 0.06


def _instances_on_points(stage: Stage) -> None:
    tree, (instances,) = _nodes(stage, "GeometryNodeInstanceOnPoints")
    cube = tree.nodes.new("GeometryNodeMeshCube")
    cube.inputs["Size"].default_value = (0.1, 0.1, 0.1)
    tree.links.new(cube.outputs[0], instances.inputs["Instance"])


feature("objects/point cloud", _point_cloud)
feature("objects/instances on points", _instances_on_points)
feature("objects/geometry nodes subdivide", lambda s: _nodes(s, "GeometryNodeSubdivisionSurface"))
feature(
    "objects/glass slot that no face uses",
    lambda s: s.ball.data.materials.append(s.material("Glass", "ShaderNodeBsdfGlass")),
)
feature("objects/grease pencil", lambda s: bpy.ops.object.grease_pencil_add(type="MONKEY", location=(0, -1, 1)))
feature("objects/empty image", lambda s: s.object("Empty", None))
feature("objects/tiny scale", lambda s: _rescaled(s, 1e-3))
feature("objects/huge scale", lambda s: _rescaled(s, 1e3))


def _rescaled(stage: Stage, factor: float) -> None:
    """The whole stage smaller or larger, its light with it."""
    for item in (stage.ball, stage.floor, stage.camera, stage.lamp):
        item.location *= factor
    stage.ball.scale = stage.floor.scale = (factor,) * 3
    stage.lamp.data.size *= factor
    stage.lamp.data.energy *= factor**2
    stage.camera.data.clip_start *= factor
    stage.camera.data.clip_end *= factor
