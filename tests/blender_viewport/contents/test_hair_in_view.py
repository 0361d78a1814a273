# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair and points in a view: their meshes are made again only if the hair or the points have changed."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.blender_viewport.edits.test_viewport_edits import shader, updated, whole  # noqa: E402

COUNT = 4


def groomed(stage):
    """Hair curves with the ball's material, and a cloud of points that nodes make of a mesh."""
    data = bpy.data.hair_curves.new("Hair")
    data.add_curves([3] * COUNT)
    comb(data, 0.2)
    data.materials.append(stage.material)
    stage.scene.collection.objects.link(bpy.data.objects.new("Hair", data))
    tree = bpy.data.node_groups.new("Points", "GeometryNodeTree")
    for side in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=side, socket_type="NodeSocketGeometry")
    begin, points, end = (
        tree.nodes.new(kind) for kind in ("NodeGroupInput", "GeometryNodeMeshToPoints", "NodeGroupOutput")
    )
    tree.links.new(begin.outputs[0], points.inputs[0])
    tree.links.new(points.outputs[0], end.inputs[0])
    cloud = bpy.data.objects.new("Cloud", bpy.data.meshes.new("Cloud"))
    cloud.data.from_pydata([(0, 0, 1), (1, 0, 1)], [], [])
    stage.scene.collection.objects.link(cloud)
    cloud.modifiers.new("Points", "NODES").node_group = tree
    updated(stage)


def comb(data, step):
    places = np.cumsum(np.full((COUNT, 3, 3), step), axis=1).reshape(-1)
    data.attributes["position"].data.foreach_set("vector", places.astype(np.float32))
    data.update_tag()


def strands(scene):
    return {mesh.name: mesh.positions for mesh in scene.meshes if mesh.is_strands or mesh.name.startswith("PointCloud")}


@pytest.fixture
def made(stage, monkeypatch):
    """The names of the meshes that the view has made of hair and points, in a scene with both."""
    from blender_addon.translate.strands import placed

    names = []
    for kind in ("curves_mesh", "points_mesh"):
        usual = getattr(placed, kind)
        monkeypatch.setattr(placed, kind, lambda name, *rest, usual=usual: names.append(name) or usual(name, *rest))
    groomed(stage)
    stage.made = names
    assert len(names) == 2
    return stage


def undo_of_a_move():
    bpy.ops.ed.undo_push(message="before")
    bpy.data.objects["Ball"].location.x += 1
    bpy.ops.ed.undo_push(message="moved")
    bpy.ops.ed.undo()


STAYS = {
    "another object hidden": lambda s: bpy.data.objects["Ball"].hide_set(True),
    "frame": lambda s: s.scene.frame_set(7),
    "number of the material": lambda s: setattr(shader(s.material)["Roughness"], "default_value", 0.31),
    "moved": lambda s: setattr(bpy.data.objects["Hair"], "location", (1, 0, 0)),
    "hidden": lambda s: bpy.data.objects["Hair"].hide_set(True),
    "undo": lambda s: undo_of_a_move(),
}
CHANGES = {
    "combed": (lambda s: comb(bpy.data.hair_curves["Hair"], 0.3), "Hair"),
    "cut": (lambda s: bpy.data.hair_curves["Hair"].remove_curves(indices=[0]), "Hair"),
    "points moved": (
        lambda s: (
            setattr(bpy.data.meshes["Cloud"].vertices[0], "co", (0, 0, 2)), bpy.data.meshes["Cloud"].update(),
        ),
        "PointCloud",
    ),
    "radius": (
        lambda s: setattr(
            bpy.data.node_groups["Points"].nodes["Mesh to Points"].inputs["Radius"], "default_value", 0.3
        ),
        "PointCloud",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", STAYS)
def test_no_mesh_is_made_again_where_hair_and_points_stay(made, name):
    """The tubes of 6,000 strands took 140 ms of Blender's main thread at each of these edits."""
    made.made.clear()
    updated(made, STAYS[name])
    updated(made, lambda _stage: bpy.data.objects["Hair"].hide_set(False))
    assert made.made == []


@pytest.mark.parametrize("name", CHANGES)
def test_changed_hair_and_points_are_shown(made, name):
    edit, changed = CHANGES[name]
    made.made.clear()
    updated(made, edit)
    assert [each.partition(" ")[0] for each in made.made] == [changed]
    shown, true = strands(next(iter(made.link.scenes.values()))), strands(whole(made))
    assert shown.keys() == true.keys() and len(shown) == 2
    for key, positions in true.items():
        np.testing.assert_array_equal(shown[key], positions)


def test_meshes_of_deleted_hair_are_freed(made):
    from blender_addon.editing.viewport import session

    kept = session._stages[made.session._stage].kept
    assert len(kept.hair) == 2
    updated(made, lambda _stage: bpy.data.objects.remove(bpy.data.objects["Hair"]))
    assert len(kept.hair) == 1
