# SPDX-License-Identifier: GPL-3.0-or-later
"""A redraw waits for pictures that come in time, and does not stop Blender for those that never do."""

from __future__ import annotations

import time
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")
from blender_addon.editing.dial.picture import covers, new_picture, place  # noqa: E402

LONGEST = 0.09
MESH, NUMBER, VIEW = frozenset(("meshes",)), frozenset(("materials",)), frozenset()


@pytest.fixture
def changes(monkeypatch):
    """Makes changes whose pictures come after some time; returns whether the redraw waited for each."""
    from blender_addon.editing.viewport import patience

    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(patience, "time", SimpleNamespace(monotonic=lambda: clock.now))
    patient, numbers = patience.Patience(), iter(range(1, 1000))

    def change(kind, seconds, how="meshes", *, comes=True):
        generation = next(numbers)
        waited = patient.wait_s(generation, kind, clock.now, LONGEST)
        first = clock.now + seconds
        clock.now += 1.0
        if comes:
            frame = SimpleNamespace(generation=generation, how=how)
            patient.notice(SimpleNamespace(frame=frame, first=first))
            patient.notice(SimpleNamespace(frame=frame, first=first))
        return waited

    return change


def test_pictures_that_come_in_time_are_waited_for(changes):
    assert [changes(MESH, 0.07) for _ in range(20)] == [LONGEST] * 20


def test_the_first_picture_of_a_kind_is_waited_for(changes):
    assert [changes(kind, 0.5) for kind in (MESH, NUMBER, VIEW)] == [LONGEST] * 3


def test_pictures_that_come_too_late_are_waited_for_now_and_then(changes):
    for _ in range(4):
        changes(MESH, 0.16)
    waits = [changes(MESH, 0.16) for _ in range(40)]
    assert waits.count(LONGEST) == 10
    assert [changes(NUMBER, 0.05) for _ in range(3)] == [LONGEST] * 3


def test_a_wait_that_succeeds_twice_in_five_times_goes_on(changes):
    assert [changes(MESH, seconds) for seconds in (0.06, 0.2, 0.3, 0.06, 0.2) * 4] == [LONGEST] * 20


def test_a_wait_is_tried_again_when_the_machine_is_faster(changes):
    for _ in range(5):
        changes(MESH, 0.3)
    waits = [changes(MESH, 0.05) for _ in range(40)]
    assert waits[0] == 0.0
    assert waits[-10:] == [LONGEST] * 10


def test_a_scene_that_was_loaded_tells_nothing_about_numbers(changes):
    changes(NUMBER, 0.05)
    changes(NUMBER, 2.0, "loaded")
    assert changes(NUMBER, 0.05) == LONGEST


def test_pictures_that_the_next_change_replaces_were_late(changes):
    for _ in range(4):
        changes(MESH, 0.0, comes=False)
    assert changes(MESH, 0.05) == 0.0


def test_a_wait_leaves_time_for_the_longest_of_the_latest_drawings(blender, monkeypatch):
    """A redraw without a new picture is short, and tells nothing of the next one with a picture. The first drawing of a
    side compiles shaders, and is not waited for.
    """
    from blender_addon.editing.viewport import session as sessions

    link = SimpleNamespace(look=lambda *_: 1)
    monkeypatch.setattr(sessions.jobs, "live", lambda: link)
    monkeypatch.setattr(sessions, "viewpoint_of", lambda *_: SimpleNamespace(same_as=lambda _other: True))
    monkeypatch.setattr(sessions, "border_of", lambda *_: None)
    scene = blender.context.scene
    region, space = SimpleNamespace(width=64, height=48), SimpleNamespace(use_local_camera=False, camera=None)
    context = SimpleNamespace(space_data=space, region=region, region_data=None)
    depsgraph = SimpleNamespace(scene=scene, scene_eval=scene)
    monkeypatch.setattr(scene, "camera", None, raising=False)
    session = sessions.ViewSession(lambda: None)
    monkeypatch.setitem(sessions._stages, "scene", sessions.Stage())
    session._stage, changes = "scene", sessions._stages["scene"].changes
    side = sessions.Side("view", 0)
    assert session._ask(side, time.monotonic(), context, depsgraph) == 0.0
    side.changed, changes[0] = NUMBER, changes[0] + 1
    assert session._ask(side, time.monotonic(), context, depsgraph) == 0.0
    for seconds in (0.01, 0.05, 0.02):
        session.drawings.append(seconds)
    second = sessions.Side("second side", 1)
    assert session._ask(second, time.monotonic(), context, depsgraph) == 0.0
    side.changed, changes[0] = NUMBER, changes[0] + 1
    assert session._ask(side, time.monotonic(), context, depsgraph) == pytest.approx(sessions.REDRAW_S - 0.05)
    monkeypatch.setattr(sessions, "covers", lambda *_: True)  # by the re-lit picture
    side.changed, changes[0] = NUMBER, changes[0] + 1
    assert session._ask(side, time.monotonic(), context, depsgraph) == 0.0


@pytest.mark.parametrize("hides", [None, "overlays", "perspective", "image", "alpha", "all images"])
def test_a_view_under_the_picture_of_the_dial_is_not_waited_for(stage, hides):
    """The re-lit picture over the camera view is opaque, and a wait would only delay it."""
    eye = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
    stage.scene.collection.objects.link(eye)
    stage.scene.camera = eye
    image = new_picture("Light Dial", 8, 8)
    stage.scene.spectral.dial.picture = image
    place(stage.scene, image, over_camera=True)
    shown = eye.data.background_images[0]
    stage.context.space_data.overlay = SimpleNamespace(show_overlays=hides != "overlays")
    stage.context.region_data.view_perspective = "PERSP" if hides == "perspective" else "CAMERA"
    shown.show_background_image, shown.alpha = hides != "image", 0.5 if hides == "alpha" else 1.0
    eye.data.show_background_images = hides != "all images"
    assert covers(stage.context, stage.scene, eye) is (hides is None)
