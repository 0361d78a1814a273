# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects that a 3D view does not show, as in Cycles: those of hidden types, and those of hidden collections."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.translate.viewport.shown import SWITCHES  # noqa: E402
from tests.blender_viewport.edits.test_viewport_edits import updated as edited  # noqa: E402
from tests.blender_viewport.test_look import updated  # noqa: E402


def sent(stage):
    """Lamps and instances of the scene of the latest request."""
    scene = stage.link.scenes[stage.link.requests[-1].stage]
    return {light.name for light in scene.lights}, {instance.name.split("#")[0].strip() for instance in scene.instances}


def test_a_view_hides_objects_of_a_type_and_shows_them_again(stage):
    space = stage.context.space_data
    updated(stage)
    assert sent(stage) == ({"Lamp"}, {"Floor", "Ball"})
    space.show_object_viewport_light = False
    updated(stage)
    assert sent(stage) == (set(), {"Floor", "Ball"})
    space.show_object_viewport_light, space.show_object_viewport_mesh = True, False
    updated(stage)
    assert sent(stage) == ({"Lamp"}, set())
    space.show_object_viewport_mesh = True
    updated(stage)
    assert sent(stage) == ({"Lamp"}, {"Floor", "Ball"})


def test_copies_are_hidden_by_their_own_type(stage):
    space, scene = stage.context.space_data, stage.scene
    balls = bpy.data.collections.new("Balls")
    balls.objects.link(bpy.data.objects["Ball"])
    scene.collection.objects.unlink(bpy.data.objects["Ball"])
    empty = bpy.data.objects.new("Copies", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", balls
    scene.collection.objects.link(empty)
    space.show_object_viewport_empty = False
    updated(stage)
    assert len(sent(stage)[1]) == 2, "a hidden empty shows its copies"
    space.show_object_viewport_mesh = False
    updated(stage)
    assert sent(stage) == ({"Lamp"}, set())


@pytest.fixture
def real_space(stage):
    """The settings of a 3D view of Blender, in place of the stand-in."""
    windows = bpy.context.window_manager.windows
    stage.context.space_data = next(each.spaces.active for each in windows[0].screen.areas if each.type == "VIEW_3D")
    return stage.context.space_data


def in_collection(scene, name):
    """The ball and an empty that shows a copy of another ball, in a collection of their own; its eye."""
    own, library = bpy.data.collections.new(name), bpy.data.collections.new("Library")
    scene.collection.children.link(own)
    scene.collection.objects.unlink(bpy.data.objects["Ball"])
    library.objects.link(bpy.data.objects.new("Inner", bpy.data.objects["Ball"].data))
    empty = bpy.data.objects.new("Copy", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", library
    for each in (bpy.data.objects["Ball"], empty):
        own.objects.link(each)
    return bpy.context.view_layer.layer_collection.children[name]


@pytest.mark.parametrize("is_real", [True, False])
def test_the_eye_of_a_collection_hides_its_objects_and_copies(stage, request, is_real):
    """Blender keeps them in the depsgraph, since another view may have collections of its own."""
    if is_real:
        request.getfixturevalue("real_space")
    eye = in_collection(stage.scene, "Props")
    edited(stage)
    assert sent(stage) == ({"Lamp"}, {"Floor", "Ball", "Inner"})
    edited(stage, lambda _: setattr(eye, "hide_viewport", True))
    assert sent(stage) == ({"Lamp"}, {"Floor"})
    edited(stage, lambda _: setattr(bpy.data.objects["Ball"], "location", (0, 0, 5)))
    assert sent(stage) == ({"Lamp"}, {"Floor"})
    edited(stage, lambda _: setattr(eye, "hide_viewport", False))
    assert sent(stage) == ({"Lamp"}, {"Floor", "Ball", "Inner"})


def test_the_switches_are_those_of_blender():
    names = {each.identifier for each in bpy.types.SpaceView3D.bl_rna.properties}
    kinds = {each.identifier for each in bpy.types.Object.bl_rna.properties["type"].enum_items}
    assert {f"show_object_viewport_{name}" for name in SWITCHES.values()} <= names
    assert set(SWITCHES) <= kinds
