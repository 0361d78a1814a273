# SPDX-License-Identifier: GPL-3.0-or-later
"""The live server, message by message: which launches it traces, and what it tells."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render.live import pace as pace_module
from spectral_core.render.live import picture as live_picture
from spectral_core.render.live.area import PixelArea
from spectral_core.render.live.in_place.changes import difference
from spectral_core.render.live.messages import AreaName
from spectral_core.render.live.picture import ViewPicture
from spectral_core.render.live.server import Server
from spectral_core.render.live.stage import Stage
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.scene import Camera, Color, Film, Scene, World
from tests.live import test_live_session as session
from tests.live.test_live_session import HEIGHT, WIDTH, with_surface

scene = session.scene


def test_a_change_is_traced_once_though_the_request_follows_later(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Blender draws a view some time after it has reported the edit. The launch in between counts for the request."""
    launches: list[int] = []
    step = ViewPicture.step
    monkeypatch.setattr(ViewPicture, "step", lambda self: launches.append(1) or step(self))
    monkeypatch.setattr(pace_module, "STRIDES", {4: np.inf})  # a slow machine would get a coarser picture
    told: list[tuple[str, object]] = []
    server = Server(told.append)
    area = PixelArea.make((WIDTH + 8) * (HEIGHT + 8))
    place = AreaName(area.path, area.pixels)
    request = ViewRequest("stage", Viewpoint.of_camera(scene.camera, scene.film), WIDTH, HEIGHT, 4, 1)
    try:
        server.hear("scene", ("stage", scene))
        server.hear("view", ("view", request, place))
        server.work()
        assert [frame.generation for _, frame in told] == [1]
        before = area.read(told[-1][1].place)
        edited = with_surface(scene, "red", color=Color([0.1, 0.9, 0.1]))
        server.hear("change", ("stage", difference(scene, edited)))
        server.work()
        server.hear("view", ("view", replace(request, generation=2), place))
        assert len(launches) == 2
        assert told[-1][1].generation == 2
        shown = area.read(told[-1][1].place)
        assert before is not None and shown is not None
        assert np.abs(shown - before).max() > 0.05

        server.hear("view", ("view", replace(request, generation=3, exposure=2.0), place))
        assert told[-1][1].generation == 2, "another exposure needs another picture"
        server.work()
        assert told[-1][1].generation == 3
        assert len(launches) == 3
    finally:
        area.remove()


@pytest.mark.parametrize(("launch", "is_told"), [(1, True), (16, False)])
def test_a_picture_of_before_a_change_is_not_told(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, launch: int, is_told: bool
) -> None:
    """Its pixels would hold up the change. The first picture of a request is told: changes may follow each other fast.

    ``launch``: the one in which the change and its request come.
    """
    monkeypatch.setattr(pace_module, "STRIDES", {4: np.inf})
    told: list[tuple[str, object]] = []
    area = PixelArea.make((WIDTH + 8) * (HEIGHT + 8))
    request = ViewRequest("stage", Viewpoint.of_camera(scene.camera, scene.film), WIDTH, HEIGHT, 4, 1)
    edited = with_surface(scene, "red", color=Color([0.1, 0.9, 0.1]))
    launches: list[int] = []

    def hear_more(server: Server) -> None:
        launches.append(1)
        if len(launches) == launch:
            server.hear("change", ("stage", difference(scene, edited)))
            server.hear("view", ("view", replace(request, generation=2), _name(area)))

    server = Server(told.append, hear_more)
    try:
        server.hear("scene", ("stage", scene))
        server.hear("view", ("view", request, _name(area)))
        for _ in range(launch):
            before = len(told)
            server.work()
        assert len(told) - before == is_told
        assert all(frame.generation == 1 for _, frame in told)
        server.work()
        assert told[-1][1].generation == 2
    finally:
        area.remove()


@pytest.mark.parametrize(("launch_s", "stride"), [(0.001, 4), (0.06, 8), (0.5, 16)])
def test_the_first_picture_is_as_coarse_as_its_launch_is_slow(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, launch_s: float, stride: int
) -> None:
    """``launch_s``: time of a launch of every fourth pixel. Single slow launches do not make the next picture coarser:
    other programs cause them.
    """
    lanes = (WIDTH // 4) * (HEIGHT // 4)
    step, slow = ViewPicture.step, [1.0]

    def stepped(self: ViewPicture) -> bool:
        shows_more = step(self)
        assert self.latest is not None
        self.latest = replace(self.latest, seconds=slow[0] * launch_s / lanes * self.latest.samples)
        return shows_more

    monkeypatch.setattr(ViewPicture, "step", stepped)
    server = Server(lambda _message: None)
    area = PixelArea.make((WIDTH + 8) * (HEIGHT + 8))
    request = ViewRequest("stage", Viewpoint.of_camera(scene.camera, scene.film), WIDTH, HEIGHT, 64, 1)
    try:
        server.hear("scene", ("stage", scene))
        for generation, slow[0] in ((1, 1.0), (2, 1.0), (3, 30.0), (4, 1.0)):
            server.hear("view", ("view", replace(request, generation=generation, exposure=generation), _name(area)))
            server.work()
            picture = server._views["view"].picture
            assert picture is not None
            assert picture.stride == (4 if generation == 1 else stride)
    finally:
        area.remove()


@pytest.mark.parametrize("faults", [1, 2])
def test_after_an_unexpected_error_the_scene_is_loaded_anew_once(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, faults: int
) -> None:
    """An edit in place that fails must not leave the view without a picture; a scene that cannot be traced is told."""
    step, left = ViewPicture.step, [0]

    def stepped(self: ViewPicture) -> bool:
        if left[0]:
            left[0] -= 1
            raise RuntimeError("drawn by a test")
        return step(self)

    monkeypatch.setattr(ViewPicture, "step", stepped)
    told: list[tuple[str, object]] = []
    server = Server(told.append)
    area = PixelArea.make((WIDTH + 8) * (HEIGHT + 8))
    request = ViewRequest("stage", Viewpoint.of_camera(scene.camera, scene.film), WIDTH, HEIGHT, 4, 1)
    try:
        server.hear("scene", ("stage", scene))
        server.hear("view", ("view", request, _name(area)))
        server.work()
        left[0] = faults
        edited = with_surface(scene, "red", color=Color([0.1, 0.9, 0.1]))
        server.hear("change", ("stage", difference(scene, edited)))
        server.hear("view", ("view", replace(request, generation=2), _name(area)))
        server.work()
        assert [kind for kind, _ in told] == ["frame"] and not server.is_idle
        server.work()
        assert told[-1][0] == ("frame" if faults == 1 else "trouble") and told[-1][1].generation == 2
        assert server.is_idle == (faults == 2)
        server.hear("change", ("stage", difference(edited, scene)))
        server.hear("view", ("view", replace(request, generation=3), _name(area)))
        server.work()
        assert told[-1][0] == "frame" and told[-1][1].generation == 3
    finally:
        area.remove()


def _name(area: PixelArea) -> AreaName:
    return AreaName(area.path, area.pixels)


def test_the_time_left_leaves_out_the_first_launch(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """It compiles: a minute of it made the rest an hour."""
    stage = Stage()
    stage.show(scene)
    stage.activate()
    viewpoint = Viewpoint.of_camera(scene.camera, scene.film)
    stage.look_from(viewpoint)
    picture = ViewPicture(stage.launcher, ViewRequest("stage", viewpoint, WIDTH, HEIGHT, 4, 0), 4)
    clock, launch, seconds = [0.0], picture._launch, iter([60.0])

    def launched(*arguments: Any) -> tuple[Any, float]:
        took = next(seconds, 1.0)
        clock[0] += took
        return launch(*arguments)[0], took

    monkeypatch.setattr(picture, "_launch", launched)
    monkeypatch.setattr(live_picture, "time", SimpleNamespace(perf_counter=lambda: clock[0]))
    assert picture.left_s == 0.0
    picture.step()
    assert picture.left_s == 0.0
    picture.step()
    assert picture.left_s == pytest.approx(4 * 16 - 2)
    while not picture.is_done:
        picture.step()
    assert picture.left_s == 0.0


def test_a_picture_read_after_each_launch_equals_one_read_at_the_end(scene: Scene) -> None:
    """Only pixels traced since the last reading are copied, at every step of the grid."""
    stage = Stage()
    stage.show(scene)
    stage.activate()
    viewpoint = Viewpoint.of_camera(scene.camera, scene.film)
    stage.look_from(viewpoint)
    request = ViewRequest("stage", viewpoint, WIDTH, HEIGHT, 2, 0)
    pictures = {stride: [ViewPicture(stage.launcher, request, stride) for _ in range(2)] for stride in (4, 8, 16)}
    full = []
    for often, once in pictures.values():
        while not often.is_done:
            often.step()
            once.step()
            level = often.level
            width, height = request.part[2:]
            assert often.pixels().shape == (-(-height // level), -(-width // level), 4)
        np.testing.assert_array_equal(often.pixels(), once.pixels())
        full.append(once.pixels().copy())
    np.testing.assert_array_equal(full[0], full[1])
    np.testing.assert_array_equal(full[0], full[2])


def test_a_scene_of_a_world_alone_is_shown() -> None:
    """Its paths have constants for most of their state, which Dr.Jit takes out of their loop: one came back as a
    variable, an error.
    """
    told: list[tuple[str, object]] = []
    server = Server(told.append)
    area = PixelArea.make((4 + 8) * (4 + 8))
    empty = Scene(
        camera=Camera(world_from_camera=np.eye(4)), film=Film(4, 4, samples=1), world=World(color=Color(np.ones(3)))
    )
    request = ViewRequest("stage", Viewpoint.of_camera(empty.camera, empty.film), 4, 4, 4, 1)
    try:
        server.hear("scene", ("stage", empty))
        server.hear("view", ("view", request, AreaName(area.path, area.pixels)))
        server.work()
        assert [kind for kind, _ in told] == ["frame"], told
        np.testing.assert_allclose(area.read(told[0][1].place), 1.0, rtol=1e-3)
    finally:
        area.remove()
