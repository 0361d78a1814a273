# SPDX-License-Identifier: GPL-3.0-or-later
"""The live server, message by message: which launches it traces, and what it tells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render.live import server as server_module
from spectral_core.render.live.area import PixelArea
from spectral_core.render.live.changes import difference
from spectral_core.render.live.messages import AreaName
from spectral_core.render.live.picture import ViewPicture
from spectral_core.render.live.server import Server
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.scene import Color, Scene
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
    monkeypatch.setattr(server_module, "FIRST_PICTURE_S", 1e9)  # a slow machine would get a coarser picture
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
