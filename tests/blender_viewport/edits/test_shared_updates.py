# SPDX-License-Identifier: GPL-3.0-or-later
"""Updates that several views share, and updates that need what Blender forbids while it draws."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import pytest

pytest.importorskip("bpy")

import bpy

from blender_addon.editing.viewport import session as sessions
from blender_addon.editing.viewport import stages
from blender_addon.translate.shading.image_files.permitted import drawing, permitted
from blender_addon.translate.viewport.kept import Forbidden, Part

FORBIDDEN = "Writing to ID classes in this context is not allowed: Image.png, Image data-block, error setting"


def update_of(block):
    return SimpleNamespace(
        id=block, is_updated_geometry=False, is_updated_transform=False, is_updated_shading=True,
    )  # fmt: skip


@pytest.fixture
def stage(blender, monkeypatch):
    """A stage of two views in a window, and the number of the round of Blender's events."""
    number = [1]
    monkeypatch.setattr(stages, "round_number", lambda: number[0])
    return stages.Stage(users={"left", "right"}), number


def told(stage, view, *updates):
    """The keys of the parts that are kept after a view has told of an evaluation."""
    depsgraph = SimpleNamespace(scene=bpy.context.scene, updates=updates)
    stage.keep_up(depsgraph, view=view)
    return set(stage.kept.parts)


def test_views_share_what_the_first_of_them_has_translated(stage):
    stage, number = stage
    material = bpy.data.materials.new("Paint")
    key = "material", material.session_uid

    def make():
        stage.kept.parts[key] = Part(1, frozenset({material.session_uid}), None, ())

    assert told(stage, "left") == told(stage, "right") == set()
    make()
    assert told(stage, "left", update_of(material)) == set(), "an edit drops the part"
    make()
    assert told(stage, "right", update_of(material)) == {key}, "the other view tells of the same edit"
    assert told(stage, "right", update_of(material)) == set(), "a second edit in the same round"
    make()
    number[0] += 1
    assert told(stage, "left", update_of(material)) == set(), "the same edit in another round"
    stage.users = {"left"}
    make()
    assert told(stage, "right", update_of(material)) == set(), "no other view could have told of it"


def test_a_view_passes_over_the_evaluation_of_another_scene(blender, monkeypatch):
    """Blender tells every view of each evaluation; a view of another scene would read its own depsgraph for nothing."""
    calls = []
    monkeypatch.setattr(sessions.ViewSession, "_send", lambda *_: calls.append("sent"))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    mine = SimpleNamespace(scene=depsgraph.scene, view_layer=depsgraph.view_layer, updates=(), mode="VIEWPORT")
    other = SimpleNamespace(scene=SimpleNamespace(session_uid=-1), view_layer=depsgraph.view_layer, mode="VIEWPORT")
    space = SimpleNamespace(local_view=None, use_local_collections=False, as_pointer=lambda: 1)
    context, session = SimpleNamespace(space_data=space), sessions.ViewSession(lambda: None)
    stages._evaluated(None, other)
    session.update(context, mine)
    assert calls == ["sent"], "the first update of a view"
    session.update(context, mine)
    assert calls == ["sent"]
    stages._evaluated(None, mine)
    session.update(context, mine)
    assert calls == ["sent"] * 2, "its own evaluation, of which Blender names no edit"
    stages._evaluated(None, other)
    monkeypatch.setitem(vars(space), "use_local_collections", True)
    session.update(context, mine)
    session.update(context, mine)
    assert calls == ["sent"] * 4, "Blender does not name the objects of a local view"
    session.leave()


def test_a_write_that_blender_forbids_is_repeated_on_the_thread_of_a_render():
    calls, answers = [], []

    def write():
        calls.append(1)
        if len(calls) < 3:
            raise AttributeError(FORBIDDEN)
        return "written"

    thread = threading.Thread(target=lambda: answers.append(permitted(write)))
    thread.start()
    thread.join(10)
    assert answers == ["written"] and len(calls) == 3


def test_nothing_is_written_while_a_view_is_drawn():
    """A temporary image would be an edit of the file, after which everything is translated again."""
    with drawing(), pytest.raises(Forbidden):
        permitted(lambda: pytest.fail("it was called"))
    assert permitted(lambda: 7) == 7


def test_other_errors_of_a_write_are_raised():
    def write():
        raise AttributeError("'Image' object has no attribute 'gamma'")

    with pytest.raises(AttributeError, match="gamma"):
        permitted(write)


def test_an_update_continues_what_a_drawing_may_not_write(blender, monkeypatch):
    """A redraw leaves it to the next update, which drops nothing: Blender reports no edit for it."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    space = SimpleNamespace(local_view=None, use_local_collections=False)
    context = SimpleNamespace(space_data=space, region=SimpleNamespace(width=8, height=8), region_data=None)
    session, calls = sessions.ViewSession(lambda: None), []

    def translated(*_arguments):
        calls.append("translated")

        def write():
            raise AttributeError(FORBIDDEN)

        return permitted(write)

    monkeypatch.setattr(sessions.ViewSession, "_translated", translated)
    monkeypatch.setattr(stages.Stage, "keep_up", lambda *_: calls.append("edits"))
    unedited = SimpleNamespace(scene=depsgraph.scene, view_layer=depsgraph.view_layer, updates=())
    session.update(context, unedited)
    assert session.needs_update and calls == ["edits", "translated"]
    session.look(context, unedited)
    assert calls == ["edits", "translated"], "a redraw would be refused again"
    session.update(context, unedited)
    assert calls == ["edits", "translated", "translated"]
    session.update(context, SimpleNamespace(**vars(unedited) | {"updates": (1,)}))
    assert calls[-2:] == ["edits", "translated"]
    session.leave()


def test_the_last_view_drops_the_scenes_of_a_stage_even_if_it_never_had_a_side(blender, monkeypatch):
    dropped = []
    link = SimpleNamespace(drop=dropped.append, close_view=lambda _: None)
    monkeypatch.setattr(sessions.jobs, "live", lambda: link)
    session = sessions.ViewSession(lambda: None)
    session._stage = "7/Layer"
    sessions._stages["7/Layer"] = stages.Stage(users={session.name})
    session.leave()
    assert dropped == ["7/Layer.0", "7/Layer.1"]


def test_a_view_knows_all_settings_of_the_film_that_a_render_has(blender, monkeypatch):
    from blender_addon.translate.camera import translate_film

    scene = bpy.context.scene
    scene.render.film_transparent, scene.render.filter_size = True, 3.0
    monkeypatch.setattr(sessions, "cycles_settings", lambda _scene, name, usual: name == "film_transparent_glass")
    monkeypatch.setattr("blender_addon.translate.camera.cycles_settings", sessions.cycles_settings)
    films = []
    monkeypatch.setattr(sessions, "translate_scene", lambda *_, film, **_rest: films.append(film))
    space = SimpleNamespace(local_view=None, use_local_collections=False)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    session = sessions.ViewSession(lambda: None)
    session._translated(SimpleNamespace(space_data=space), depsgraph, stages.Stage())
    expected, film = translate_film(depsgraph.scene_eval, 1, films[0].seed), films[0]
    of_the_view = {"width", "height", "samples", "crop", "exposure", "pixel_aspect"}
    for name in set(film.__dataclass_fields__) - of_the_view:
        assert getattr(film, name) == getattr(expected, name), name
    assert film.transparent_glass


def test_a_view_that_is_opened_while_paused_says_so():
    from blender_addon.viewport import words

    empty = [sessions.Picture(None, is_current=False)]
    assert words(empty, SimpleNamespace(is_paused=True, samples=4)) == ("", "Paused")
    assert words(empty, SimpleNamespace(is_paused=False, samples=4)) == ("", "Loading the scene")
    troubled = [sessions.Picture(None, is_current=False, trouble="the palette has no light 'Warm' to look under")]
    assert words(troubled, SimpleNamespace(is_paused=False, samples=4)) == ("", "")
