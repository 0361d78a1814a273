# SPDX-License-Identifier: GPL-3.0-or-later
"""What a 3D view asks for and sends in unusual states: Edit Mode, Sculpt Mode, a render border, an empty scene."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
import bmesh  # noqa: E402

from tests.blender_viewport.edits.test_viewport_edits import updated  # noqa: E402


def known(stage):
    return next(iter(stage.link.scenes.values()))


def mesh_named(stage, name):
    return next(mesh for mesh in known(stage).meshes if mesh.name == name)


@pytest.fixture
def editing(stage):
    """The ball in Edit Mode, after a first view of it in Object Mode."""
    updated(stage)
    bpy.context.view_layer.objects.active = bpy.data.objects["Ball"]
    before = known(stage)
    updated(stage, lambda _stage: bpy.ops.object.mode_set(mode="EDIT"))
    yield stage, before
    bpy.ops.object.mode_set(mode="OBJECT")


def stretched(_stage):
    mesh = bpy.data.objects["Ball"].data
    editor = bmesh.from_edit_mesh(mesh)
    for vertex in editor.verts:
        vertex.co *= 3
    bmesh.update_edit_mesh(mesh)


def test_an_object_in_edit_mode_is_shown_as_it_is_edited(editing):
    from spectral_core.render.live.in_place.changes import difference

    stage, before = editing
    assert difference(before, known(stage)).is_empty, "entering Edit Mode changes nothing that is seen"
    name = bpy.data.objects["Ball"].data.name
    size, count = np.ptp(mesh_named(stage, name).positions), len(mesh_named(stage, name).triangles)
    updated(stage, stretched)
    assert np.ptp(mesh_named(stage, name).positions) == pytest.approx(3 * size)
    bpy.ops.mesh.select_all(action="SELECT")
    updated(stage, lambda _stage: bpy.ops.mesh.quads_convert_to_tris())
    updated(stage, lambda _stage: bpy.ops.mesh.subdivide())
    assert len(mesh_named(stage, name).triangles) == 4 * count


def test_a_second_object_with_the_mesh_in_edit_mode_follows(stage):
    other = bpy.data.objects.new("Other", bpy.data.objects["Ball"].data)
    stage.scene.collection.objects.link(other)
    updated(stage)
    bpy.context.view_layer.objects.active = bpy.data.objects["Ball"]
    updated(stage, lambda _stage: bpy.ops.object.mode_set(mode="EDIT"))
    try:
        updated(stage, stretched)
        sizes = [np.ptp(mesh.positions) for mesh in known(stage).meshes if not mesh.name.startswith("Plane")]
        assert sizes == pytest.approx([6.0] * len(sizes), rel=1e-5)
        assert len(known(stage).instances) == 3
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")


def test_a_render_border_restricts_what_is_asked_for(stage):
    updated(stage)
    assert stage.link.requests[-1].border is None
    space = stage.context.space_data
    space.use_render_border = True
    space.render_border_min_x, space.render_border_min_y = 0.1, 0.5
    space.render_border_max_x, space.render_border_max_y = 0.4, 1.2
    updated(stage)
    assert stage.link.requests[-1].border == (9, 30, 27, 30)
    assert stage.link.requests[-1].width == 90, "the whole view stays as it is"
    space.render_border_max_x = 0.1
    updated(stage)
    assert stage.link.requests[-1].border == (9, 30, 1, 30), "an empty border is one pixel wide"


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_the_border_of_a_camera_view_is_that_of_renders(stage, kind):
    from blender_addon.translate.viewport.viewpoint import border_of

    lens = bpy.data.cameras.new("Lens")
    lens.type, lens.shift_x = kind, 0.2
    eye = bpy.data.objects.new("Eye", lens)
    stage.scene.collection.objects.link(eye)
    bpy.context.view_layer.update()
    render = stage.scene.render
    render.use_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.5, 0.0, 1.0
    flat = np.array(lens.view_frame(scene=stage.scene))
    flat = flat[:, :2] / (-flat[:, 2:] if kind == "PERSP" else 1.0)
    low, high = flat.min(axis=0), flat.max(axis=0)
    # the view shows twice the size of the camera's frame, around its middle
    middle, size = (low + high) / 2, 2 * (high - low)
    scale = 2 / size
    projection = np.diag([*scale, -1.0, 0.0])
    if kind == "PERSP":
        projection[:2, 2], projection[3, 2] = middle * scale, -1.0
    else:
        projection[:2, 3], projection[3, 3] = -middle * scale, 1.0
    data = stage.context.region_data
    data.window_matrix, data.is_perspective, data.view_perspective = projection, kind == "PERSP", "CAMERA"
    found = border_of(data, stage.context.space_data, eye, stage.scene)
    np.testing.assert_allclose(found, [[0.375, 0.25], [0.5, 0.75]], atol=1e-6)
    render.use_border = False
    assert border_of(data, stage.context.space_data, eye, stage.scene) is None


def test_an_empty_scene_is_shown(stage):
    updated(stage)
    for block in list(bpy.data.objects):
        bpy.data.objects.remove(block)
    updated(stage)
    assert known(stage).instances == ()
    assert known(stage).lights == ()
    assert not stage.session._trouble


def test_a_view_ends_with_its_engine(stage):
    """Blender frees the engine of a view that is closed or switched; nothing may keep it alive."""
    from blender_addon.viewport import Viewport

    class Engine:
        def tag_redraw(self):
            pass

    engine = Engine()
    engine.viewport = Viewport(engine)
    engine.viewport.update(engine, stage.context, bpy.context.evaluated_depsgraph_get())
    engine.viewport._session.look(stage.context, bpy.context.evaluated_depsgraph_get())
    kept, name = engine.viewport._session._redraw, engine.viewport._session.name
    assert stage.link.closed == []
    del engine
    assert stage.link.closed == [f"{name}.0"]
    kept()  # a picture that arrives too late


def test_a_pause_is_told_to_the_renderer(stage):
    """The renderer went on to the last sample, and traced the edits that were made meanwhile."""
    settings, name = stage.scene.spectral.viewport, f"{stage.session.name}.0"
    updated(stage)
    assert stage.link.paused == {name: False}
    settings.is_paused = True
    updated(stage)
    assert stage.link.paused == {name: True}
    settings.is_paused = False
    updated(stage)
    assert stage.link.paused == {name: False}


def test_a_view_whose_scene_cannot_be_translated_can_be_paused(stage):
    updated(stage)
    stage.session.fail("no translation")
    stage.scene.spectral.viewport.is_paused = True
    pictures = stage.session.look(stage.context, bpy.context.evaluated_depsgraph_get())
    assert pictures[0].trouble == "no translation"
    assert list(stage.link.paused.values()) == [True]


def test_a_view_is_resumed_after_its_new_request(stage, monkeypatch):
    """Otherwise a picture of the viewpoint of before the pause is traced first."""
    updated(stage)
    stage.scene.spectral.viewport.is_paused = True
    updated(stage)
    stage.context.region.width += 10
    resumed = []
    monkeypatch.setattr(stage.link, "pause", lambda view, *, is_paused: resumed.append(len(stage.link.requests)))
    asked = len(stage.link.requests)
    stage.scene.spectral.viewport.is_paused = False
    updated(stage)
    assert resumed == [asked + 1]
