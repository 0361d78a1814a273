# SPDX-License-Identifier: GPL-3.0-or-later
"""An update that takes long continues in the next redraws, and ends with the same scene."""

from __future__ import annotations

import time

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
from tests.blender_viewport.edits.test_walks import instanced  # noqa: E402

MOST_REDRAWS = 60


@pytest.fixture
def slow(coarse, monkeypatch):
    """A view whose updates have no time left after one new part."""
    from blender_addon.editing.viewport import session
    from blender_addon.translate.viewport import kept

    monkeypatch.setattr(session, "UPDATE_S", -1.0)
    monkeypatch.setattr(kept, "NEW_SHARE", 0.0)
    coarse.redraws = []
    coarse.session._redraw = lambda: coarse.redraws.append(1)
    return coarse


def redrawn(stage):
    """Pictures of one redraw."""
    return stage.session.look(stage.context, bpy.context.view_layer.depsgraph)


def settled(stage):
    """Number of redraws until no further one is requested."""
    for number in range(1, MOST_REDRAWS):
        stage.redraws.clear()
        redrawn(stage)
        if not stage.redraws:
            return number
    raise AssertionError("the update does not end")


def followed(stage, edit):
    """The calls of Blender after an edit."""

    def follow(_scene, depsgraph):
        stage.session.update(stage.context, depsgraph)

    bpy.app.handlers.depsgraph_update_post.append(follow)
    try:
        edit()
        bpy.context.view_layer.update()
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(follow)


def sent(stage):
    return next(iter(stage.link.scenes.values()), None)


def differs(stage):
    from blender_addon.translate.scene import translate_scene
    from spectral_core.render.live.in_place.changes import difference
    from spectral_core.scene import Camera

    depsgraph = bpy.context.evaluated_depsgraph_get()
    camera = Camera(world_from_camera=np.eye(4))
    whole = translate_scene(depsgraph, film=sent(stage).film, seen_from=camera, shows=lambda _instance: True)
    left = difference(sent(stage), whole)
    return list(left.items), list(left.singles)


def test_a_first_update_is_divided(slow):
    followed(slow, lambda: None)
    assert sent(slow) is None
    assert settled(slow) > 3
    assert differs(slow) == ([], [])


def test_nothing_is_sent_or_called_current_before_the_end(slow):
    followed(slow, lambda: None)
    settled(slow)
    before, asked = sent(slow), len(slow.link.requests)

    def edit():
        for place in (1, 4, 7):  # apart: a whole translation notes faces that are there twice
            bpy.ops.mesh.primitive_cube_add(location=(place, 1, 1))
        for ball in bpy.data.objects:
            if ball.type == "MESH":
                ball.data.vertices[0].co.z += 0.1
                ball.data.update()

    followed(slow, edit)
    slow.redraws.clear()
    pictures = redrawn(slow)
    assert [picture.is_current for picture in pictures] == [False]
    assert slow.redraws
    assert sent(slow) is before
    assert len(slow.link.requests) == asked
    settled(slow)
    assert differs(slow) == ([], [])
    assert len(slow.link.requests) == asked + 1


def test_an_edit_during_a_divided_update_is_sent(slow):
    followed(slow, lambda: None)
    redrawn(slow)
    redrawn(slow)
    assert sent(slow) is None

    def edit():
        bpy.data.objects["Floor"].data.vertices[0].co.z = 0.7
        bpy.data.objects["Floor"].data.update()
        bpy.data.lights["Lamp"].energy = 77

    followed(slow, edit)
    settled(slow)
    assert differs(slow) == ([], [])
    assert [light.power_w for light in sent(slow).lights] == [77]


def test_a_fast_update_is_not_divided(stage):
    requested = []
    stage.session._redraw = lambda: requested.append(1)
    followed(stage, lambda: None)
    assert sent(stage) is not None
    redrawn(stage)
    assert requested == []


def test_parts_that_are_never_kept_do_not_hold_up_the_end(slow):
    """A material that reads another object's place is translated in each update."""
    for name in ("Ball", "Floor"):
        material = bpy.data.materials.new(f"Reads {name}")
        if material.node_tree is None:
            material.use_nodes = True
        tree = material.node_tree
        place, noise = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeTexNoise")
        place.object = bpy.data.objects["Lamp"]
        tree.links.new(place.outputs["Object"], noise.inputs["Vector"])
        shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
        tree.links.new(noise.outputs[0], shader.inputs["Roughness"])
        bpy.data.objects[name].data.materials.clear()
        bpy.data.objects[name].data.materials.append(material)
    followed(slow, lambda: None)
    settled(slow)
    assert differs(slow) == ([], [])


def test_parts_that_replace_each_other_come_to_an_end(blender):
    """As the media of two instances of one object, which are kept in one place."""
    from blender_addon.translate.context import Translation
    from blender_addon.translate.viewport.kept import Kept, Unfinished, kept_or_made

    kept = Kept()
    translation = Translation.of(bpy.context.evaluated_depsgraph_get(), bpy.data)
    for _ in range(3):
        kept.limit(-1.0)
        try:
            made = [
                kept_or_made(kept, translation, ("medium", 1), frozenset((1,)), state, lambda state=state: state)
                for state in (1, 2, 3)
            ]
        except Unfinished:
            continue
        break
    assert made == [1, 2, 3]


class Engine:
    """A stand-in for Blender's engine."""

    def tag_redraw(self):
        pass

    def update_stats(self, *_):
        pass


def test_an_error_in_a_later_part_is_shown_in_the_view(slow, monkeypatch):
    """Blender would switch the view off, and say nothing in it."""
    from blender_addon import viewport
    from blender_addon.editing.viewport import session

    told = []
    monkeypatch.setattr(viewport, "draw_message", lambda text, *_: told.append(text))
    engine = Engine()
    view = viewport.Viewport(engine)
    view._session = slow.session
    followed(slow, lambda: None)
    assert slow.session._is_unfinished

    def broken(*_given, **_named):
        raise ZeroDivisionError("no such mesh")

    monkeypatch.setattr(session, "translate_scene", broken)
    for _ in range(2):
        view.draw(engine, slow.context, bpy.context.view_layer.depsgraph)
    assert len(told) == 2
    assert all("no such mesh" in text for text in told)


def strange_scene():
    """Instances of geometry nodes, a displaced ball that two objects share, a volume that varies, and two lamps."""
    instanced()
    paint = bpy.data.materials.new("Rough")
    ready(paint)
    nodes, links = paint.node_tree.nodes, paint.node_tree.links
    out = next(node for node in nodes if node.type == "OUTPUT_MATERIAL")
    moved, noise = nodes.new("ShaderNodeDisplacement"), nodes.new("ShaderNodeTexNoise")
    links.new(noise.outputs[0], moved.inputs["Height"])
    links.new(moved.outputs[0], out.inputs["Displacement"])
    paint.displacement_method = "DISPLACEMENT"
    fog = bpy.data.materials.new("Fog")
    ready(fog)
    nodes, links = fog.node_tree.nodes, fog.node_tree.links
    out = next(node for node in nodes if node.type == "OUTPUT_MATERIAL")
    filled, noise = nodes.new("ShaderNodeVolumePrincipled"), nodes.new("ShaderNodeTexNoise")
    links.new(noise.outputs[0], filled.inputs["Density"])
    links.new(filled.outputs[0], out.inputs["Volume"])
    links.remove(out.inputs["Surface"].links[0])
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=8, location=(2, 2, 1))
    ball = bpy.context.object
    ball.data.materials.append(paint)
    twin = ball.copy()
    twin.location = (-2, 2, 1)
    bpy.context.collection.objects.link(twin)
    for place in (0, 3):
        bpy.ops.mesh.primitive_cube_add(location=(place, 4, 1))
        bpy.context.object.data.materials.append(fog)
    bpy.ops.object.light_add(location=(3, 3, 4))


def ready(material):
    if material.node_tree is None:  # before Blender 5
        material.use_nodes = True


def test_a_walk_is_divided_and_equals_a_whole_one(slow):
    """One object for each redraw; names do not depend on where the walk was interrupted."""
    strange_scene()
    followed(slow, lambda: None)
    assert settled(slow) > 20
    assert differs(slow) == ([], [])
    followed(slow, lambda: bpy.data.objects["Seed"].hide_set(True))
    assert settled(slow) > 10
    assert differs(slow) == ([], [])


def test_an_edit_during_a_divided_walk_begins_it_anew(slow):
    strange_scene()
    followed(slow, lambda: None)
    for _ in range(9):
        redrawn(slow)
    assert sent(slow) is None
    followed(slow, lambda: setattr(bpy.data.objects["Floor"], "location", (0, 0, -1)))
    settled(slow)
    assert differs(slow) == ([], [])


def test_an_edited_world_does_not_begin_a_walk_anew(slow):
    """A walk over volumes that vary is not kept for the next update; the world is read before it."""
    strange_scene()
    followed(slow, lambda: setattr(slow.scene, "world", bpy.data.worlds.new("Sky")))
    settled(slow)
    assert differs(slow) == ([], [])
    followed(slow, lambda: setattr(slow.scene.world, "color", (0.2, 0.3, 0.4)))
    settled(slow)
    assert differs(slow) == ([], [])


def test_copies_that_take_long_to_list_are_not_read_one_by_one(stage, monkeypatch):
    """Blender lists all copies of an object before it returns the first: 200,000 copies took as many redraws."""
    from itertools import islice

    from blender_addon.editing.viewport import session
    from blender_addon.translate import objects

    def listed(instances, first, last):
        time.sleep(0.03)
        return islice(instances, first, last)

    monkeypatch.setattr(objects, "islice", listed)
    monkeypatch.setattr(session, "UPDATE_S", 0.01)
    stage.redraws = []
    stage.session._redraw = lambda: stage.redraws.append(1)
    ball = bpy.data.objects["Ball"]
    for number in range(300):
        copy = ball.copy()
        copy.location = (2 * number, 9, 0)
        bpy.context.collection.objects.link(copy)
    followed(stage, lambda: None)
    settled(stage)
    assert differs(stage) == ([], [])
