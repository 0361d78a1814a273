# SPDX-License-Identifier: GPL-3.0-or-later
"""Object Types Visibility of a 3D view: as in Cycles, it hides objects of a type in this view alone."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.translate.viewport.shown import SWITCHES  # noqa: E402
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


def test_the_switches_are_those_of_blender():
    names = {each.identifier for each in bpy.types.SpaceView3D.bl_rna.properties}
    kinds = {each.identifier for each in bpy.types.Object.bl_rna.properties["type"].enum_items}
    assert {f"show_object_viewport_{name}" for name in SWITCHES.values()} <= names
    assert set(SWITCHES) <= kinds
