# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the object that shows an instance: visibility, holdout, shadow catcher, collections, light linking."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")


def shown_by_an_empty(thing):
    """Move an object into a collection of its own, and show that by an empty; returns the empty."""
    group = bpy.data.collections.new("Group")
    bpy.context.scene.collection.objects.unlink(thing)
    group.objects.link(thing)
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", group
    bpy.context.scene.collection.objects.link(empty)
    return empty


@pytest.fixture
def shown(build):
    """A plane in a collection, and the empty that shows it."""
    plane = build.plane()
    empty = shown_by_an_empty(plane)
    return plane, empty


def test_an_instance_is_a_holdout_if_what_shows_it_is_one(shown, translate):
    """Not if its own object is one: Cycles reads the instancer's alone."""
    plane, empty = shown
    plane.is_holdout = True
    assert not translate().instances[0].is_holdout
    empty.is_holdout, plane.is_holdout = True, False
    assert translate().instances[0].is_holdout


def test_an_instance_is_hidden_or_a_catcher_if_either_is(shown, translate):
    from spectral_core.scene import Rays

    plane, empty = shown
    assert translate().instances[0].hidden_from is Rays.NONE
    plane.visible_diffuse = empty.visible_camera = False
    assert translate().instances[0].hidden_from == Rays.DIFFUSE | Rays.CAMERA
    for each in shown:
        each.is_shadow_catcher = True
        assert translate().instances[0].is_shadow_catcher
        each.is_shadow_catcher = False
    assert not translate().instances[0].is_shadow_catcher


@pytest.mark.parametrize("setting", ["holdout", "indirect_only"])
def test_an_instance_follows_the_collection_of_what_shows_it(shown, translate, setting):
    from spectral_core.scene import Rays

    collection = bpy.data.collections.new("Of the empty")
    bpy.context.scene.collection.children.link(collection)
    bpy.context.scene.collection.objects.unlink(shown[1])
    collection.objects.link(shown[1])
    bpy.context.view_layer.update()
    setattr(bpy.context.view_layer.layer_collection.children[collection.name], setting, True)
    (found,) = translate().instances
    assert found.is_holdout == (setting == "holdout")
    assert (found.hidden_from == Rays.CAMERA) == (setting == "indirect_only")


def test_an_instance_is_lit_by_the_lights_of_what_shows_it(shown, build, translate):
    """Unless a light's collection names the object itself."""
    plane, empty = shown
    lamp = build.light("POINT")
    lamp.light_linking.receiver_collection = linked = bpy.data.collections.new("Lit")
    linked.objects.link(empty)
    assert translate().instances[0].unlit_by == ()
    linked.objects.unlink(empty)
    linked.objects.link(plane)
    assert translate().instances[0].unlit_by == ()
    linked.objects.unlink(plane)
    linked.objects.link(lamp)
    assert translate().instances[0].unlit_by == (lamp.name,)


@pytest.fixture
def shown_lamp(build):
    """A lamp that the camera sees, in a collection, and the empty that shows it."""
    lamp = build.light("POINT", shadow_soft_size=0.5)
    lamp.visible_camera, lamp.is_shadow_catcher = True, False
    empty = shown_by_an_empty(lamp)
    return lamp, empty


def test_a_lamp_is_hidden_from_the_rays_that_what_shows_it_is_hidden_from(shown_lamp, translate):
    from spectral_core.scene import Rays

    _, empty = shown_lamp
    (light,) = translate().lights
    assert light.camera_visible and light.hidden_from is Rays.NONE and not light.is_in_footage
    empty.visible_camera = empty.visible_diffuse = False
    empty.is_shadow_catcher = True
    (light,) = translate().lights
    assert not light.camera_visible and light.hidden_from == Rays.DIFFUSE and light.is_in_footage


def test_before_4_5_a_lamp_has_its_own_visibility_alone(shown_lamp, translate, monkeypatch):
    from blender_addon import compat

    _, empty = shown_lamp
    empty.visible_camera = False
    monkeypatch.setattr(compat, "lamps_follow_instancers", lambda: False)
    assert translate().lights[0].camera_visible


@pytest.mark.parametrize("is_holdout", [False, True])
@pytest.mark.parametrize("kind", ["mesh", "lamp"])
def test_an_indirect_collection_hides_meshes_and_lamps_from_the_camera_unless_it_is_a_holdout(
    build, translate, kind, is_holdout
):
    from spectral_core.scene import Rays

    thing = build.plane() if kind == "mesh" else build.light("POINT", shadow_soft_size=0.5)
    thing.visible_camera = True
    collection = bpy.data.collections.new("Indirect")
    bpy.context.scene.collection.children.link(collection)
    bpy.context.scene.collection.objects.unlink(thing)
    collection.objects.link(thing)
    bpy.context.view_layer.update()
    layer = bpy.context.view_layer.layer_collection.children[collection.name]
    layer.indirect_only, layer.holdout = True, is_holdout
    scene = translate()
    if kind == "lamp":
        assert scene.lights[0].camera_visible == is_holdout
    else:
        assert scene.instances[0].is_holdout == is_holdout
        assert bool(scene.instances[0].hidden_from & Rays.CAMERA) != is_holdout
