# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur of Blender's scenes: moving and fixed objects, and the time when the shutter is open."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from spectral_core.scene import Rays  # noqa: E402


@pytest.fixture
def moments(build):
    """The scene's moments from the evaluated depsgraph; checks that the frame is unchanged afterward."""

    def run():
        from blender_addon.translate.camera.motion import with_motion
        from blender_addon.translate.scene import translate_scene

        scene = bpy.context.scene
        if scene.camera is None:
            build.camera()
        scene.frame_set(1)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        plain = translate_scene(depsgraph, is_moving=True)
        found = with_motion(plain, depsgraph, None, lambda frame, part: scene.frame_set(frame, subframe=part))
        assert (scene.frame_current, scene.frame_subframe) == (1, 0.0)
        return found

    bpy.context.scene.render.use_motion_blur = True
    bpy.context.scene.render.motion_blur_shutter = 1.0
    return run


def fly(thing, distance=2.0):
    """Move an object from x = 0 at frame 0 to ``distance`` at frame 2 with constant speed."""
    for frame, x in ((0, 0.0), (2, distance)):
        thing.location.x = x
        thing.keyframe_insert("location", frame=frame)
    make_linear(thing)


def make_linear(thing, later=0.0):
    """Constant speed between the keys, which come ``later`` frames later."""
    bags = getattr(thing.animation_data.action, "fcurves", None)
    if bags is None:  # actions are layered from Blender 5.0 on
        bags = thing.animation_data.action.layers[0].strips[0].channelbags[0].fcurves
    for curve in bags:
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
            point.co.x += later


def places(scene, name):
    return np.array([
        {item.name: item for item in scene.at(moment).instances}[name].world_from_object[0, 3]
        for moment in scene.moments
    ])  # fmt: skip


@pytest.mark.parametrize(("position", "first"), [("START", 1.0), ("CENTER", 0.5), ("END", 0.0)])
def test_the_shutter_opens_when_the_settings_say(build, moments, position, first):
    fly(build.plane())
    bpy.context.scene.render.motion_blur_position = position
    scene = moments()
    count = len(scene.moments)
    assert count >= 8 and np.allclose(places(scene, "Plane"), first + (np.arange(count) + 0.5) / count, atol=0.02)


def test_a_scene_without_motion_has_no_moments(build, moments):
    build.plane()
    assert moments().moments == ()


def test_an_object_without_motion_blur_does_not_move(build, moments):
    thing, other = build.plane(), build.plane("Other")
    fly(thing)
    fly(other)
    thing.cycles.use_motion_blur = False
    scene = moments()
    assert np.ptp(places(scene, "Plane")) == 0 and np.ptp(places(scene, "Other")) > 0.5


def _shown_by_an_empty(build):
    """A plane in a collection that a flying empty shows; returns both."""
    thing, group = build.plane(), bpy.data.collections.new("Group")
    group.objects.link(thing)
    bpy.context.scene.collection.objects.unlink(thing)
    empty = build.object("Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", group
    fly(empty)
    return thing, empty


@pytest.mark.parametrize("still", [0, 1])
def test_motion_blur_of_what_another_object_shows_is_switched_off_by_either(build, moments, still):
    owners = _shown_by_an_empty(build)
    assert len(moments().moments) > 0
    owners[still].cycles.use_motion_blur = False
    assert moments().moments == ()


@pytest.mark.parametrize("finer", [0, 1])
def test_what_another_object_shows_moves_in_the_more_steps_of_the_two(build, moments, finer):
    owners = _shown_by_an_empty(build)
    for frame, height in ((0, 0), (1.25, 1), (3, 0)):
        owners[1].location.y = height
        owners[1].keyframe_insert("location", frame=frame)
    make_linear(owners[1])
    bpy.context.scene.render.motion_blur_position = "START"
    bpy.context.scene.spectral.render.samples = 128
    owners[finer].cycles.motion_steps = 2
    found = moments()
    placed = [item.world_from_object[1, 3] for each in found.moments for item in found.at(each).instances]
    assert max(placed) > 0.97  # 0.75 and less in two steps


def test_an_object_moves_where_its_mesh_of_the_same_name_changes_its_number_of_vertices(build, moments):
    thing = build.plane("Mesh")
    wire = thing.modifiers.new("Wire", "SUBSURF")
    wire.subdivision_type, wire.render_levels = "SIMPLE", 1
    for frame, levels in ((0, 1), (1, 1), (1.5, 3)):
        wire.levels = levels
        wire.keyframe_insert("levels", frame=frame)
    fly(thing)
    scene = moments()
    assert [mesh.name for mesh in scene.meshes] == ["Mesh"] and np.ptp(places(scene, "Mesh")) > 0.5
    assert [note.subject for note in scene.notes if "number of vertices" in note.message] == ["Mesh"]


def test_what_is_hidden_at_first_stays_there_as_in_the_middle(build, moments):
    thing = build.plane()
    for frame, hidden in ((0, True), (1, False)):
        thing.hide_viewport = hidden
        thing.keyframe_insert("hide_viewport", frame=frame)
    fly(thing)
    scene = moments()
    count = len(scene.moments)
    expected = np.maximum(1.0, 0.5 + (np.arange(count) + 0.5) / count)
    np.testing.assert_allclose(places(scene, "Plane"), expected, atol=1e-6)
    assert [note.subject for note in scene.notes if "all the time" in note.message] == ["Plane"]


def test_objects_and_lamps_are_those_of_the_middle_of_the_time(build, moments):
    """As in Cycles: their settings, and whether they are there; materials are those of the frame."""
    things = [build.plane(material=build.material()) for _ in range(3)]
    for thing, name in zip(things, ("Changing", "Early", "Late"), strict=True):
        thing.name = thing.data.materials[0].name = name
    changing, early, late = things
    lamps = build.light("POINT"), build.light("SPOT")
    for thing, hidden in ((early, False), (lamps[0], False), (late, True), (lamps[1], True)):
        for frame, value in ((1, hidden), (2, not hidden)):
            thing.hide_viewport = value
            thing.keyframe_insert("hide_viewport", frame=frame)
    for frame, share in ((1, 0.0), (2, 1.0)):
        changing.color, changing.visible_glossy = (share, 0, 0, 1), not share
        for name in ("color", "visible_glossy"):
            changing.keyframe_insert(name, frame=frame)
    fly(changing)
    bpy.context.scene.render.motion_blur_position, bpy.context.scene.render.motion_blur_shutter = "START", 2.0
    scene = moments()
    shown = {item.name: item for item in scene.instances}
    assert list(shown) == ["Changing", "Late"] and shown["Late"].materials == ("Late",)
    assert shown["Changing"].color[0] == pytest.approx(1.0) and shown["Changing"].hidden_from == Rays.GLOSSY
    assert [type(light).__name__ for light in scene.lights] == ["SpotLight"]


def test_a_moving_camera_and_a_fixed_lamp(build, moments):
    build.plane()
    lamp = build.light("POINT")
    fly(lamp)
    assert moments().moments == ()
    assert moments().lights[0].world_from_light[0, 3] == pytest.approx(1.0)
    bpy.context.scene.render.motion_blur_position = "START"
    shown = moments()  # as in Cycles, what is not blurred stands where it is in the middle of the time
    assert shown.moments == () and shown.lights[0].world_from_light[0, 3] == pytest.approx(1.5)
    build.camera()
    fly(bpy.context.scene.camera)
    scene = moments()
    assert np.ptp([moment.camera.world_from_camera[0, 3] for moment in scene.moments]) > 0.5


@pytest.mark.parametrize(("steps", "height"), [(1, 0.75), (2, 1.0)])
def test_motion_is_interpolated_between_as_many_instants_as_in_cycles(build, moments, steps, height):
    """From frame 1 to 2: three instants cut the corner at 1.25, five meet it. Turns do not shrink the object."""
    thing, scene = build.plane(), bpy.context.scene
    for frame, place, angle in ((0, (0, 0, 0), 0.0), (1, (1, 1, 0), 1.5), (2, (2, 0, 0), 3.0)):
        thing.location, thing.rotation_euler = place, (0, 0, angle)
        thing.keyframe_insert("location", frame=frame)
        thing.keyframe_insert("rotation_euler", frame=frame)
    make_linear(thing, later=0.25)
    scene.render.motion_blur_position, scene.spectral.render.samples = "START", 128
    thing.cycles.motion_steps = steps
    found = moments()
    assert len(found.moments) == 32
    placed = [
        {item.name: item for item in found.at(each).instances}["Plane"].world_from_object for each in found.moments
    ]
    assert max(matrix[1, 3] for matrix in placed) == pytest.approx(height, abs=0.02)
    for matrix in placed:
        np.testing.assert_allclose(matrix[:3, :3].T @ matrix[:3, :3], np.eye(3), atol=1e-5)


def test_scale_and_shear_are_interpolated_apart_from_the_turn():
    from mathutils import Matrix

    from blender_addon.translate.camera.between import between

    stretch = np.array([[2.0, 0.3, 0.1], [0, 0.5, -0.2], [0, 0, 1.5]])
    ends = [np.eye(4), np.eye(4)]
    ends[1][:3, :3] = np.array(Matrix.Rotation(2.0, 3, "Y")) @ stretch
    ends[1][:3, 3] = 4, 5, 6
    middle = between(ends[0], ends[1], 0.5)
    np.testing.assert_allclose(middle[:3, 3], (2, 2.5, 3))
    expected = np.array(Matrix.Rotation(1.0, 3, "Y")) @ (np.eye(3) + stretch) / 2
    np.testing.assert_allclose(middle[:3, :3], expected, atol=1e-6)
    mirrored = [matrix @ np.diag([-1.0, 1, 1, 1]) for matrix in ends]
    np.testing.assert_allclose(between(*mirrored, 1.0), mirrored[1], atol=1e-6)


def test_a_mesh_that_changes_its_shape(build, moments):
    thing = build.plane()
    thing.shape_key_add(name="Basis")
    key = thing.shape_key_add(name="Wide")
    for point in key.data:
        point.co.x *= 3
    for frame, value in ((0, 0.0), (2, 1.0)):
        key.value = value
        key.keyframe_insert("value", frame=frame)
    scene = moments()
    widths = [np.ptp(scene.at(moment).meshes[0].positions[:, 0]) for moment in scene.moments]
    assert np.all(np.diff(widths) > 0)
    thing.cycles.use_deform_motion = False
    assert moments().moments == ()


def test_a_shutter_curve_weighs_the_time(build, moments):
    from blender_addon.translate.camera.motion import instants

    curve = bpy.context.scene.render.motion_blur_shutter_curve
    for point, height in zip(curve.curves[0].points, (1.0, 1.0), strict=False):
        point.location.y = height
    curve.update()
    assert np.allclose(instants(bpy.context.scene.render, 4), [0.125, 0.375, 0.625, 0.875], atol=0.01)
    first, last = curve.curves[0].points[0], curve.curves[0].points[-1]
    first.location, last.location = (0.0, 0.0), (1.0, 1.0)
    for point in (first, last):
        point.handle_type = "VECTOR"
    curve.update()
    assert instants(bpy.context.scene.render, 4).mean() > 0.55


@pytest.mark.parametrize("kind", ["mesh", "points", "hair"])
def test_the_attribute_velocity_blurs_as_in_cycles(build, moments, kind):
    """4 units per second at 24 frames per second, about the place in the middle of the open time."""
    if kind == "mesh":
        thing = build.plane(material=build.material())
    elif kind == "points":  # nodes make a point of each vertex, which keeps its velocity
        thing = build.plane()
        tree = bpy.data.node_groups.new("Points", "GeometryNodeTree")
        for way in ("INPUT", "OUTPUT"):
            tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
        ends = [tree.nodes.new(name) for name in ("NodeGroupInput", "GeometryNodeMeshToPoints", "NodeGroupOutput")]
        for one, other in pairwise(ends):
            tree.links.new(one.outputs[0], other.inputs[0])
        thing.modifiers.new("Points", "NODES").node_group = tree
    else:
        curves = bpy.data.hair_curves.new("Hair")
        curves.add_curves([2])
        curves.attributes["position"].data.foreach_set("vector", np.array([0, 0, 0, 0, 0, 1], np.float32))
        thing = build.object("Hair", curves)
    stored = thing.data.attributes.get("velocity") or thing.data.attributes.new("velocity", "FLOAT_VECTOR", "POINT")
    stored.data.foreach_set("vector", np.tile(np.array([4.0, 0, 0], np.float32), len(stored.data)))
    bpy.context.scene.render.fps, bpy.context.scene.render.motion_blur_shutter = 24, 0.5
    scene = moments()
    (mesh,) = scene.meshes
    shifts = np.array([scene.at(moment).meshes[0].positions[:, 0] - mesh.positions[:, 0] for moment in scene.moments])
    count = len(scene.moments)
    expected = 4.0 * 0.5 / 24 * ((np.arange(count) + 0.5) / count - 0.5)
    np.testing.assert_allclose(shifts, np.broadcast_to(expected[:, None], shifts.shape), atol=1e-6)


def test_an_object_without_deformation_blur_ignores_its_velocity(build, moments):
    thing = build.plane(material=build.material())
    thing.data.attributes.new("velocity", "FLOAT_VECTOR", "POINT").data.foreach_set("vector", [4.0, 0, 0] * 4)
    thing.cycles.use_deform_motion = False
    assert moments().moments == ()
