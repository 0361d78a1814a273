# SPDX-License-Identifier: GPL-3.0-or-later
"""Views of one area in local view, as those of a quad view: they share a scene, which is translated once."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.blender_viewport.edits.test_viewport_edits import EDITS, shader, updated  # noqa: E402


@pytest.fixture
def quad(stage, monkeypatch):
    """Four views of an area that shows the ball and the lamp in local view, and the objects that walks visit."""
    from blender_addon.editing.viewport import stages
    from blender_addon.editing.viewport.session import ViewSession
    from blender_addon.translate import objects

    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    override = {"window": window, "area": area, "region": next(each for each in area.regions if each.type == "WINDOW")}
    visited, visit = [], objects._visit

    def counted(found, instance, *rest):
        visited.append(instance.object.name)
        visit(found, instance, *rest)

    monkeypatch.setattr(objects, "_visit", counted)
    for obj in bpy.data.objects:
        obj.select_set(obj.name in ("Ball", "Lamp"))
    stage.context.space_data, stage.area = area.spaces.active, override
    with bpy.context.temp_override(**override):
        bpy.ops.view3d.localview(frame_selected=False)
    stage.sessions = [ViewSession(lambda: None) for _ in range(4)]
    rounds = []
    monkeypatch.setattr(stages, "round_number", lambda: len(rounds))  # Blender has rounds only with a window

    def update(*call):
        rounds.append(1)
        for each in stage.sessions:
            each.update(*call)

    stage.session = SimpleNamespace(
        update=update,
        look=lambda *call: [each.look(*call) for each in stage.sessions],
    )
    yield stage, visited
    for session in stage.sessions:
        session.leave()
    with bpy.context.temp_override(**override):
        bpy.ops.view3d.localview(frame_selected=False)


def shown(stage):
    (scene,) = stage.link.scenes.values()
    return {item.name for item in (*scene.instances, *scene.lights)}


def test_the_views_of_a_quad_view_translate_a_local_view_once(quad):
    stage, visited = quad
    updated(stage)
    assert shown(stage) == {"Ball", "Lamp"}
    assert len({request.stage for request in stage.link.requests}) == 1
    visited.clear()
    updated(stage, EDITS["mesh"])
    assert len(visited) == len(bpy.data.objects), "one walk over the objects, not one for each view"
    visited.clear()
    updated(stage, EDITS["color"])
    updated(stage, EDITS["move"])
    updated(stage, EDITS["power"])
    assert visited == [], "edits of numbers need no walk"
    (scene,) = stage.link.scenes.values()
    assert next(item for item in scene.instances if item.name == "Ball").world_from_object[0, 3] == 1


def test_a_material_that_hidden_objects_share_needs_no_walk_in_local_view(quad):
    stage, visited = quad
    paint = bpy.data.objects["Ball"].data.materials[0]
    hidden = [bpy.data.objects.new(f"Away {number}", bpy.data.objects["Ball"].data) for number in range(3)]
    for each in hidden:
        bpy.context.scene.collection.objects.link(each)
        each.local_view_set(stage.context.space_data, False)  # without a window Blender adds them to it
    updated(stage)
    visited.clear()
    updated(stage, lambda _: setattr(shader(paint)["Roughness"], "default_value", 0.77))
    assert visited == [], "Blender reports the hidden objects of an edited material, too"
    updated(stage, lambda _: setattr(hidden[0], "location", (0, 0, 9)))
    assert shown(stage) == {"Ball", "Lamp"}


def removed(stage):
    for obj in bpy.data.objects:
        obj.select_set(obj.name == "Ball")
    with bpy.context.temp_override(**stage.area):
        bpy.ops.view3d.localview_remove_from()


def test_the_views_of_a_scene_request_new_pictures_after_a_change_that_the_first_has_sent(quad):
    """The corner of the others said that their pictures were current, and their looks were of the next picture."""
    stage, _ = quad
    updated(stage)
    updated(stage)
    before = [session._sides[0].generation for session in stage.sessions]
    frames = {session._sides[0].name: session._sides[0].generation for session in stage.sessions}
    stage.link.latest = lambda name: SimpleNamespace(frame=SimpleNamespace(generation=frames[name], how=""), first=0.0)
    settings = stage.scene.spectral.viewport
    settings.look.kind, settings.look.lamp, settings.look.adapts = "LAMP", "blackbody 2000", True
    updated(stage, EDITS["power"])
    assert all(now._sides[0].generation > old for now, old in zip(stage.sessions, before, strict=True))
    depsgraph = bpy.context.view_layer.depsgraph
    for session in stage.sessions:
        (picture,) = session.look(stage.context, depsgraph)
        assert not picture.is_current
        assert np.array_equal(picture.matrix, np.eye(3)), "that of the picture before the change"
    frames |= {session._sides[0].name: session._sides[0].generation for session in stage.sessions}
    for session in stage.sessions:
        (picture,) = session.look(stage.context, depsgraph)
        assert picture.is_current
        assert not np.allclose(picture.matrix, np.eye(3), atol=0.1)


def test_what_has_to_be_read_at_each_evaluation_is_read_once_for_all_views(quad):
    """Blender reports no change of custom properties, so that every object is visited again after each edit."""
    stage, visited = quad
    attribute = stage.material.node_tree.nodes.new("ShaderNodeAttribute")
    attribute.attribute_type, attribute.attribute_name = "OBJECT", "shade"
    stage.material.node_tree.links.new(attribute.outputs["Fac"], shader(stage.material)["Roughness"])
    updated(stage)
    for edit in ("color", "power"):
        visited.clear()
        updated(stage, EDITS[edit])
        assert len(visited) == len(bpy.data.objects)


def test_views_follow_the_objects_of_their_local_view(quad):
    stage, _ = quad
    updated(stage)
    space = stage.context.space_data
    updated(stage, removed)
    assert shown(stage) == {"Lamp"}
    updated(stage, lambda _stage: bpy.data.objects["Floor"].local_view_set(space, True))
    assert shown(stage) == {"Lamp", "Floor"}
    space.show_object_viewport_light = False
    updated(stage, EDITS["color"])
    assert shown(stage) == {"Floor"}
    space.show_object_viewport_light = True
