# SPDX-License-Identifier: GPL-3.0-or-later
"""What the live server makes of pauses, of messages that fail, and of requests for a scene that cannot be shown."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest

pytest.importorskip("mitsuba")

from spectral_core.render.live.area import PixelArea
from spectral_core.render.live.in_place.changes import SceneChange, difference
from spectral_core.render.live.messages import AreaName
from spectral_core.render.live.picture import ViewPicture
from spectral_core.render.live.server import Server
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.scene import Color, Scene
from tests.live import test_live_session as session
from tests.live.test_live_session import HEIGHT, WIDTH, with_surface

scene = session.scene


class Bench:
    """A server with what it tells, and the areas of its views."""

    def __init__(self, scene: Scene) -> None:
        self.told: list[tuple[str, Any]] = []
        self.later: list[tuple[str, Any]] = []
        """Messages that come while a launch is traced."""
        self.server = Server(self.told.append, self._hear_more)
        self.areas: dict[str, PixelArea] = {}
        self.request = ViewRequest("stage", Viewpoint.of_camera(scene.camera, scene.film), WIDTH, HEIGHT, 4096, 1)

    def _hear_more(self, server: Server) -> None:
        while self.later:
            server.hear(*self.later.pop(0))

    def view(self, name: str, generation: int = 1, *, is_gone: bool = False) -> tuple[str, Any]:
        """The message of a request; ``is_gone``: the session has deleted the file since."""
        area = self.areas.setdefault(name, PixelArea.make((WIDTH + 8) * (HEIGHT + 8)))
        if is_gone:
            area.remove()
            del self.areas[name]
        return "view", (name, replace(self.request, generation=generation), AreaName(area.path, area.pixels))

    def work(self, launches: int = 1) -> list[tuple[str, Any]]:
        """What is told in some rounds."""
        before = len(self.told)
        for _ in range(launches):
            self.server.work()
        return self.told[before:]


@pytest.fixture
def bench(scene: Scene) -> Iterator[Bench]:
    bench = Bench(scene)
    yield bench
    for area in bench.areas.values():
        area.remove()


@pytest.fixture
def launches(monkeypatch: pytest.MonkeyPatch) -> list[ViewPicture]:
    """The pictures of all launches."""
    traced: list[ViewPicture] = []
    step = ViewPicture.step
    monkeypatch.setattr(ViewPicture, "step", lambda self: traced.append(self) or step(self))
    return traced


def test_a_paused_view_is_neither_traced_nor_told_until_it_is_resumed(
    bench: Bench, scene: Scene, launches: list[ViewPicture]
) -> None:
    """It went on to its last sample, and an edit replaced the picture that was kept."""
    server = bench.server
    server.hear("scene", ("stage", scene))
    server.hear(*bench.view("view"))
    assert [kind for kind, _ in bench.work()] == ["frame"]
    server.hear("pause", ("view", True))
    assert server.is_idle
    assert bench.work(3) == []
    edited = with_surface(scene, "red", color=Color([0.1, 0.9, 0.1]))
    server.hear("change", ("stage", difference(scene, edited)))
    assert server.is_idle
    assert bench.work(3) == []
    assert len(launches) == 1
    assert server._stages["stage"].stage.loads == 1 and server._stages["stage"].is_pending, "it works on the change"
    server.hear("pause", ("view", False))
    assert not server.is_idle
    assert [kind for kind, _ in bench.work()] == ["frame"]
    assert launches[1] is not launches[0], "the picture of before the change was continued"


def test_a_view_is_continued_where_it_was_paused(bench: Bench, scene: Scene, launches: list[ViewPicture]) -> None:
    bench.server.hear("scene", ("stage", scene))
    bench.server.hear(*bench.view("view"))
    bench.later = [("pause", ("view", True))]
    bench.work(5)
    assert len(launches) == 1, "the pause holds from the next launch on"
    bench.server.hear("pause", ("view", False))
    bench.work(2)
    assert launches == [launches[0]] * 3


def test_other_views_of_the_scene_go_on(bench: Bench, scene: Scene) -> None:
    server = bench.server
    server.hear("pause", ("first", True))  # a new process hears it before its views
    server.hear(*bench.view("first"))
    server.hear("scene", ("stage", scene))
    assert bench.work(2) == []
    assert server._stages["stage"].stage.loads == 0, "nothing is loaded for a paused view"
    server.hear(*bench.view("second"))
    assert {frame.view for _, frame in bench.work(4)} == {"second"}
    server.hear("close", "first")
    server.hear(*bench.view("first", 2))
    assert "first" in {frame.view for _, frame in bench.work(4)}, "a closed view is not paused any more"


def test_a_view_whose_file_is_gone_ends_nothing(bench: Bench, scene: Scene) -> None:
    """The session deletes the file of a view that it closes or enlarges, at times before the process opens it."""
    server = bench.server
    server.hear("scene", ("stage", scene))
    server.hear(*bench.view("view", is_gone=True))
    (kind, trouble), *more = bench.told
    assert more == [] and kind == "trouble" and (trouble.view, trouble.generation) == ("view", 1)
    assert "switch it to Solid" in trouble.message
    server.hear("close", "never opened")
    server.hear(*bench.view("view", 2))
    assert [(kind, content.generation) for kind, content in bench.work()] == [("frame", 2)]


def test_a_message_that_fails_during_a_launch_does_not_mark_the_scene(bench: Bench, scene: Scene) -> None:
    bench.server.hear("scene", ("stage", scene))
    bench.server.hear(*bench.view("view"))
    bench.later = [bench.view("closed", is_gone=True)]
    assert [(kind, content.view) for kind, content in bench.work()] == [("trouble", "closed"), ("frame", "view")]
    kept = bench.server._stages["stage"]
    assert (kept.trouble, kept.is_pending, kept.stage.loads) == ("", False, 1)


def test_a_change_that_fails_asks_for_the_scene(bench: Bench, scene: Scene) -> None:
    server = bench.server
    server.hear("change", ("stage", SceneChange({}, {})))
    assert bench.told == [("lost", "stage")], "it was never sent"
    server.hear("scene", ("stage", scene))
    server.hear("change", ("stage", SceneChange({"meshes": (99,)}, {})))
    assert bench.told == [("lost", "stage")] * 2
    server.hear(*bench.view("view"))
    assert [kind for kind, _ in bench.work()] == ["frame"]


def test_the_reason_why_a_scene_cannot_be_shown_is_told_to_each_request(bench: Bench, scene: Scene) -> None:
    """A view that was opened after the error stayed empty without a word, and the next request removed the text."""
    server = bench.server
    wrong = replace(scene, settings=replace(scene.settings, overrides=(("bounces", "many"),)))
    server.hear("scene", ("stage", wrong))
    server.hear(*bench.view("view"))
    bench.work()
    server.hear(*bench.view("view", 2))
    server.hear(*bench.view("second", 3))
    assert [(kind, content.view, content.generation) for kind, content in bench.told] == [
        ("trouble", "view", 1), ("trouble", "view", 2), ("trouble", "second", 3),
    ]  # fmt: skip
    assert len({content.message for _, content in bench.told}) == 1 and "bounces" in bench.told[0][1].message
    server.hear("scene", ("stage", scene))
    server.hear(*bench.view("view", 4))
    assert len(bench.told) == 3, "the new scene may be right"
    assert next((kind, content.generation) for kind, content in bench.work()) in (("frame", 3), ("frame", 4))
