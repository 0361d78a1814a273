# SPDX-License-Identifier: GPL-3.0-or-later
"""The changes that a 3D view sends after each type of edit give the same scene as a full translation."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from benchmarks.viewport.edits.objects import EDITS as RANDOM_EDITS  # noqa: E402


def shader(material):
    return next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED").inputs


def stretched():
    mesh = bpy.data.objects["Ball"].data
    mesh.vertices[3].co.z += 0.4
    mesh.update()


def subdivided():
    modifier = bpy.data.objects["Ball"].modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = 1


def with_node(material):
    tree = material.node_tree
    noise = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(noise.outputs[0], shader(material)["Roughness"])


def animated():
    ball = bpy.data.objects["Ball"]
    ball.location.x = 0
    ball.keyframe_insert("location", frame=1)
    ball.location.x = 2
    ball.keyframe_insert("location", frame=10)
    bpy.context.scene.frame_set(10)


EDITS = {
    "color": lambda s: setattr(shader(s.material)["Base Color"], "default_value", (0.9, 0.1, 0.1, 1)),
    "roughness": lambda s: setattr(shader(s.material)["Roughness"], "default_value", 0.1),
    "move": lambda s: setattr(bpy.data.objects["Ball"], "location", (1, 0, 1)),
    "power": lambda s: setattr(bpy.data.lights["Lamp"], "energy", 500),
    "lamp kind": lambda s: setattr(bpy.data.lights["Lamp"], "type", "AREA"),
    "mesh": lambda s: stretched(),
    "modifier": lambda s: subdivided(),
    "node": lambda s: with_node(s.material),
    "new object": lambda s: bpy.ops.mesh.primitive_cube_add(location=(2, 1, 0.5)),
    "hidden": lambda s: bpy.data.objects["Floor"].hide_set(True),
    "frame": lambda s: animated(),
    "deleted": lambda s: bpy.data.objects.remove(bpy.data.objects["Lamp"]),
    "renamed": lambda s: setattr(bpy.data.objects["Ball"], "name", "Apple"),
    "film": lambda s: setattr(s.scene.render, "film_transparent", True),
}


def whole(stage):
    from blender_addon.translate.scene import translate_scene
    from spectral_core.scene import Camera

    known = next(iter(stage.link.scenes.values()))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    camera = Camera(world_from_camera=np.eye(4))
    return translate_scene(depsgraph, film=known.film, seen_from=camera, shows=lambda _instance: True)


def updated(stage, edit=lambda _stage: None):
    """The calls of Blender after an edit: handlers get the same list of updates as the engine's view."""

    def follow(_scene, depsgraph):
        stage.session.update(stage.context, depsgraph)

    lists = (bpy.app.handlers.depsgraph_update_post, bpy.app.handlers.frame_change_post)
    for handlers in lists:
        handlers.append(follow)
    try:
        edit(stage)
        bpy.context.view_layer.update()
    finally:
        for handlers in lists:
            handlers.remove(follow)
    stage.session.look(stage.context, bpy.context.view_layer.depsgraph)


def test_every_edit_is_sent(stage):
    from spectral_core.render.live.in_place.changes import difference

    updated(stage)
    unseen, stale = [], {}
    for name, edit in EDITS.items():
        before, asked = next(iter(stage.link.scenes.values())), len(stage.link.requests)
        updated(stage, edit)
        after = next(iter(stage.link.scenes.values()))
        if len(stage.link.requests) == asked:
            unseen.append(name)
        left = difference(after, whole(stage))
        if not left.is_empty and set(left.singles) != {"film"}:
            stale[name] = (list(left.items), list(left.singles))
        assert after is not before, name
    assert unseen == []
    assert stale == {}


def test_an_edit_sends_changed_data_alone(stage):
    from spectral_core.render.live.in_place.changes import difference

    updated(stage)
    before = next(iter(stage.link.scenes.values()))
    updated(stage, EDITS["color"])
    after = next(iter(stage.link.scenes.values()))
    change = difference(before, after)
    assert set(change.items) == {"materials"}
    assert all(new is old for new, old in zip(after.meshes, before.meshes, strict=True))


def test_the_view_requests_a_new_picture_only_after_a_change(stage):
    updated(stage)
    asked = len(stage.link.requests)
    updated(stage)
    assert len(stage.link.requests) == asked
    stage.context.region_data.view_matrix = np.linalg.inv(np.diag([1.0, 1, 1, 1]) + np.eye(4, k=3) * 2)
    updated(stage)
    stage.context.region = SimpleNamespace(width=120, height=60)
    updated(stage)
    assert len(stage.link.requests) == asked + 2
    stage.scene.spectral.viewport.is_paused = True
    updated(stage, EDITS["color"])
    assert len(stage.link.requests) == asked + 2
    stage.scene.spectral.viewport.is_paused = False
    updated(stage)
    assert len(stage.link.requests) == asked + 3
    stage.scene.spectral.viewport.samples = 17
    updated(stage)
    assert stage.link.requests[-1].samples == 17 and len(stage.link.requests) == asked + 4


def test_a_closed_view_releases_its_scene(stage):
    updated(stage)
    stage.session.leave()
    assert stage.link.closed == [f"{stage.session.name}.0"]
    assert stage.link.dropped[:1] == list(stage.link.scenes)
    assert [name.rpartition(".")[2] for name in stage.link.dropped] == ["0", "1"], "of a second side, too"


def test_views_use_the_same_camera_as_blender():
    from blender_addon.translate.viewport.viewpoint import window_of

    # a lens of half width 0.5, with its center moved by a tenth of the picture
    projection = np.array([[2.0, 0, 0.2, 0], [0, 4.0, -0.1, 0], [0, 0, -1, -1], [0, 0, -1, 0]])
    low, high = window_of(projection, is_perspective=True)
    for corner, expected in ((low, (-1, -1)), (high, (1, 1))):
        clip = projection @ np.array([*corner, -1.0, 1.0])
        assert clip[:2] / clip[3] == pytest.approx(expected)
    flat = np.array([[0.5, 0, 0, 0.3], [0, 0.7, 0, -0.2], [0, 0, -0.1, 0], [0, 0, 0, 1.0]])
    low, high = window_of(flat, is_perspective=False)
    for corner, expected in ((low, (-1, -1)), (high, (1, 1))):
        assert (flat @ np.array([*corner, -3.0, 1.0]))[:2] == pytest.approx(expected)


def test_a_panoramic_camera_fills_its_frame_in_the_view_as_in_f12(stage):
    """The view is zoomed to the lower left half of the camera's frame, which is drawn as a lens of 50 mm would be."""
    import bpy

    from blender_addon.translate.camera import translate_camera
    from blender_addon.translate.context import Translation
    from blender_addon.translate.viewport.viewpoint import viewpoint_of

    lens = bpy.data.cameras.new("Around")
    lens.type, lens.panorama_type = "PANO", "FISHEYE_EQUIDISTANT"
    lens.shift_x, lens.shift_y = 0.1, -0.2
    lens.dof.use_dof, lens.dof.aperture_blades, lens.dof.aperture_ratio = True, 6, 1.5
    eye = bpy.data.objects.new("Around", lens)
    stage.scene.collection.objects.link(eye)
    bpy.context.view_layer.update()
    width, height = stage.scene.render.resolution_x, stage.scene.render.resolution_y
    half = 18 / 50 * np.array([1.0, height / width])
    low = (np.array([0.1, -0.2]) * 2 * half[0]) - half  # Blender's shift is relative to the larger side
    scale, middle = 2 / half, low + half / 2
    projection = np.diag([*scale, -1.0, 0.0])
    projection[:2, 2], projection[3, 2] = middle * scale, -1.0
    region = SimpleNamespace(
        window_matrix=projection, view_matrix=np.eye(4), is_perspective=True, view_perspective="CAMERA"
    )
    depsgraph = bpy.context.evaluated_depsgraph_get()
    seen = eye.evaluated_get(depsgraph)
    view = viewpoint_of(region, stage.context.space_data, seen, depsgraph.scene_eval)
    true = translate_camera(Translation.of(depsgraph, bpy.data), seen)
    assert view.panorama == true.panorama
    assert view.aperture == true.aperture
    assert view.aperture.blades == 6
    np.testing.assert_allclose(view.low, [0.1, -0.2], atol=1e-5)
    np.testing.assert_allclose(view.high - view.low, 0.5, atol=1e-5)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_random_edits_leave_no_outdated_data(coarse, seed):
    from spectral_core.render.live.in_place.changes import difference
    from spectral_core.render.same import equal

    rng = np.random.default_rng(seed)
    updated(coarse)
    stale = []
    for number in range(60):
        name = str(rng.choice(list(RANDOM_EDITS)))
        updated(coarse, lambda _stage, name=name: RANDOM_EDITS[name](rng))
        known, true = next(iter(coarse.link.scenes.values())), whole(coarse)
        left = difference(known, true)
        kinds = [*left.items, *(single for single in left.singles if single not in ("film", "notes"))]
        if kinds or {(n.subject, n.message) for n in known.notes} != {(n.subject, n.message) for n in true.notes}:
            stale.append((number, name, kinds, [n for n in known.notes if not any(equal(n, m) for m in true.notes)]))
    assert stale == []
