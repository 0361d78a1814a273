# SPDX-License-Identifier: GPL-3.0-or-later
"""Notes on faces that overlap in one plane."""

from __future__ import annotations

import math

import pytest

bpy = pytest.importorskip("bpy")
from mathutils import Euler, Matrix  # noqa: E402


def overlap_told(translate):
    return [note.subject for note in translate().notes if "in one plane" in note.message]


@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.9, 0.0, 0.4), (0.3, -1.2, 2.0)])
def test_faces_that_overlap_in_part_get_a_note(build, translate, turn):
    """In any plane and with any triangles: Cycles darkens them by chance, ours look like a single face."""
    place = Euler(turn).to_matrix().to_4x4()
    floor = build.plane(name="Floor", size=4.0)
    poster = build.plane(name="Poster", size=1.0)
    floor.matrix_world = place
    inside = Matrix.Translation((0.4, -0.7, 0.0)) @ Matrix.Rotation(0.5, 4, "Z")
    poster.matrix_world = place @ inside
    assert overlap_told(translate) == ["Poster"]
    poster.matrix_world = place @ Matrix.Translation((0.0, 0.0, 1e-3)) @ inside
    assert not overlap_told(translate)
    poster.matrix_world = place @ Matrix.Translation((2.5, 0.0, 0.0))  # they share an edge
    assert not overlap_told(translate)
    poster.matrix_world = place @ Matrix.Translation((2.4, 0.0, 0.0))
    assert overlap_told(translate) == ["Poster"]
    poster.matrix_world = place @ inside @ Matrix.Rotation(math.pi, 4, "X")  # a sheet of two sides
    assert overlap_told(translate) == ["Poster"]


def test_boxes_that_stand_on_each_other_touch_without_a_note(build, translate):
    """No light reaches faces that look at each other; tops and sides that overlap do have a note."""
    build.plane(name="Floor", size=10.0)
    boxes = []
    for place in ((0.0, 0.0, 0.5), (1.0, 0.3, 0.5), (0.2, 0.0, 1.5)):
        bpy.ops.mesh.primitive_cube_add(size=1.0, location=place)
        boxes.append(bpy.context.object)
    assert not overlap_told(translate)
    boxes[1].location.x = 0.8
    assert overlap_told(translate) == [boxes[1].name]
    boxes[1].location.z = 0.51
    assert not overlap_told(translate)


def test_parts_of_one_mesh_that_overlap_get_a_note_and_fine_grids_are_compared(build, translate):
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=80, y_subdivisions=80, size=4.0)
    assert not overlap_told(translate)
    grid = bpy.context.object
    poster = build.plane(name="Poster", size=0.5)
    poster.location = 0.613, 0.341, 0.0
    assert overlap_told(translate) == ["Poster"] or overlap_told(translate) == [grid.name]
    bpy.data.objects.remove(poster)
    bpy.data.objects.remove(grid)
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    cube = bpy.context.object
    cube.modifiers.new("Array", "ARRAY").relative_offset_displace[0] = 1.0
    assert not overlap_told(translate)
    cube.modifiers["Array"].relative_offset_displace[0] = 0.7
    assert overlap_told(translate) == [cube.name]


def test_areas_that_triangles_share_are_those_of_a_count_of_points():
    import numpy as np

    from blender_addon.translate.faces.shared_areas import shared_areas

    first, second = np.random.default_rng(88).uniform(size=(2, 60, 3, 2))
    second[:6] = first[:6, ::-1]  # the same ones, clockwise
    second[6:12, :2] = first[6:12, :2]  # they have an edge in common
    areas, middles = shared_areas(first, second, 1e-9)
    points = (np.mgrid[:300, :300].reshape(2, -1).T + 0.5) / 300

    def within(triangle, at):
        edges = np.roll(triangle, -1, axis=0) - triangle
        away = at[:, None] - triangle
        sides = edges[:, 0] * away[..., 1] - edges[:, 1] * away[..., 0]
        return (sides > 0).all(axis=1) | (sides < 0).all(axis=1)

    counted = np.array([np.mean(within(a, points) & within(b, points)) for a, b in zip(first, second, strict=True)])
    assert np.count_nonzero(counted > 0.01) > 15
    assert np.count_nonzero(counted == 0.0) > 5
    assert np.abs(areas - counted).max() < 1e-3
    shared = areas > 0.01
    assert all(within(a, m[None]).all() for a, m in zip(first[shared], middles[shared], strict=True))


def test_instances_of_an_object_that_overlap_have_one_note(build, translate):
    """Scattered leaves on a floor had a note for each leaf."""
    build.plane(name="Floor", size=8.0)
    leaf = build.plane(name="Leaf", size=0.5)
    leaves = bpy.data.collections.new("Leaves")
    bpy.context.scene.collection.objects.unlink(leaf)
    leaves.objects.link(leaf)
    for number in range(12):
        empty = bpy.data.objects.new(f"Empty {number}", None)
        empty.location = 0.3 * (number % 4), 0.35 * (number // 4), 0.0
        empty.instance_type, empty.instance_collection = "COLLECTION", leaves
        bpy.context.scene.collection.objects.link(empty)
    told = [note for note in translate().notes if "in one plane" in note.message]
    assert {note.subject for note in told} == {"Leaf"}
    assert len(told) <= 2
    assert any("'Floor'" in note.message for note in told)


def test_flattened_curves_on_the_vertices_of_a_mesh_have_one_note(build, translate):
    """Blender gives their faces a matrix of zeros: each instance had a note about the last row of its matrix."""
    parent = build.plane(name="Parent")
    bpy.ops.curve.primitive_bezier_circle_add(radius=0.3)
    child = bpy.context.object
    child.data.bevel_depth, child.scale = 0.1, (1.0, 1.0, 0.0)
    child.parent, parent.instance_type = parent, "VERTS"
    (note,) = [note for note in translate().notes if "left out" in note.message]
    assert note.subject == child.name
    assert "scale of 0" in note.message
