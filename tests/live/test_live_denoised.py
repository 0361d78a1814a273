# SPDX-License-Identifier: GPL-3.0-or-later
"""Views that are denoised while they refine; a stand-in takes the place of the filter, which is an optional package."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.errors import MissingDependencyError
from spectral_core.render import plan_effects
from spectral_core.render.denoise import Guides
from spectral_core.render.job import Measure, RenderJob
from spectral_core.render.live import denoise_thread, pace, picture
from spectral_core.render.live.area import PixelArea
from spectral_core.render.live.in_place.changes import difference
from spectral_core.render.live.link import LiveLink
from spectral_core.render.live.messages import AreaName, Frame
from spectral_core.render.live.picture import ViewPicture
from spectral_core.render.live.running import MEMORY_ALLOWANCE, MEMORY_GROWTH, Limits
from spectral_core.render.live.server import Server
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.scene import Color, RenderSettings, ScatteringMedium, Scene, World
from tests.live import test_live_session as session
from tests.live.test_live_session import HEIGHT, WIDTH, with_surface

scene = session.scene
PATIENCE_S = 60.0
CLEAN = np.float32(0.25)
"""Value of every pixel that the stand-in returns."""


class Filter:
    """Stand-in for the filter: notes what it gets, waits while it is ``held``, and fails with ``fails_with``."""

    def __init__(self) -> None:
        self.given: list[np.ndarray] = []
        self.guides: list[Guides | None] = []
        self.qualities: list[str] = []
        self.may_go = threading.Event()
        self.may_go.set()
        self.fails_with: Exception | None = None

    def __call__(self, pixels: np.ndarray, guides: Guides | None = None, *, quality: str) -> np.ndarray:
        self.given.append(pixels)
        self.guides.append(guides)
        self.qualities.append(quality)
        assert self.may_go.wait(PATIENCE_S)
        if self.fails_with is not None:
            raise self.fails_with
        made = np.full_like(pixels, CLEAN)
        made[..., 3] = pixels[..., 3]
        return made


class Session:
    """A server with one view of ``samples`` per pixel, its messages, and the frames that it tells."""

    def __init__(self, scene: Scene, samples: int) -> None:
        self.messages: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self.told: list[tuple[str, Any]] = []
        self.server = Server(self.told.append, post=self.messages.put)
        self.area = PixelArea.make((WIDTH + 8) * (HEIGHT + 8))
        viewpoint = Viewpoint.of_camera(scene.camera, scene.film)
        self.request = ViewRequest("stage", viewpoint, WIDTH, HEIGHT, samples, 1, denoise=True)
        self.server.hear("scene", ("stage", scene))
        self.look(1)

    def look(self, generation: int) -> None:
        request = replace(self.request, generation=generation)
        self.server.hear("view", ("view", request, AreaName(self.area.path, self.area.pixels)))

    def trace(self) -> None:
        while not self.server.is_idle:
            self.server.work()

    def hear(self) -> None:
        """Hear the answer of the filter, as the process does, and work on."""
        self.server.hear(*self.messages.get(timeout=PATIENCE_S))
        self.server.work()

    def finish(self) -> None:
        """Until the view is complete."""
        while True:
            self.trace()
            if self.frames[-1].is_done:
                return
            self.hear()

    @property
    def frames(self) -> list[Frame]:
        return [frame for kind, frame in self.told if kind == "frame"]

    def pixels(self) -> np.ndarray:
        found = self.area.read(self.frames[-1].place)
        assert found is not None
        return found


@pytest.fixture
def denoiser(monkeypatch: pytest.MonkeyPatch) -> Filter:
    found = Filter()
    monkeypatch.setattr(denoise_thread, "denoise", found)
    monkeypatch.setattr(picture, "DENOISED_S", 1e9)  # a slow machine would denoise more often
    return found


@pytest.fixture
def view(scene: Scene, denoiser: Filter) -> Iterator[Session]:
    found = Session(scene, 4)
    yield found
    denoiser.may_go.set()
    found.area.remove()


def test_full_pictures_are_denoised_as_their_samples_double(view: Session, denoiser: Filter) -> None:
    view.finish()
    noisy = [frame for frame in view.frames if not frame.is_denoised]
    clean = [frame for frame in view.frames if frame.is_denoised]
    assert [frame.level for frame in noisy][-1] == 1 and noisy[-1].samples == 1, "the first full one is shown at once"
    assert view.frames == noisy + clean, "no noisy picture follows a denoised one"
    assert [frame.samples for frame in clean] == [1, 2, 4] or [frame.samples for frame in clean] == [1, 3, 4]
    assert [frame.is_done for frame in clean] == [False, False, True]
    assert denoiser.qualities == ["fast", "fast", "high"]
    np.testing.assert_array_equal(view.pixels()[..., :3], CLEAN)
    assert view.server.is_idle and view.messages.empty()


def test_the_filter_gets_the_picture_itself(scene: Scene, view: Session, denoiser: Filter) -> None:
    """Its last input is the picture of a view that is not denoised."""
    view.finish()
    plain = Session(scene, 4)
    plain.request = replace(plain.request, denoise=False)
    plain.look(2)
    plain.trace()
    np.testing.assert_array_equal(denoiser.given[-1], plain.pixels())
    assert not plain.frames[-1].is_denoised and plain.frames[-1].is_done
    plain.area.remove()


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_the_filter_is_guided_as_in_a_render(
    scene: Scene, denoiser: Filter, transport: Literal["rgb", "spectral"]
) -> None:
    """Albedo and normals of the view are those of a still picture, but for their noise at edges."""
    seen = replace(scene, settings=RenderSettings(transport=transport))
    view = Session(seen, 2)
    view.finish()
    view.area.remove()
    guides = RenderJob(seen, plan_effects(seen), Measure()).guides()
    assert guides is not None
    for found in denoiser.guides:
        assert found is not None
        for name in ("albedo", "normal"):
            apart = np.abs(getattr(found, name) - getattr(guides, name))
            assert np.quantile(apart, 0.8) < 0.02 and apart.mean() < 0.03, name
    assert guides.albedo.std() > 0.1 and guides.normal.std() > 0.1


def test_a_medium_has_no_guides(scene: Scene, denoiser: Filter) -> None:
    """Surfaces behind it say little about the picture."""
    fog = World(Color([0.2, 0.2, 0.2]), medium=ScatteringMedium(density=0.01))
    view = Session(replace(scene, world=fog), 2)
    view.finish()
    view.area.remove()
    assert denoiser.guides == [None, None] and view.frames[-1].is_denoised


def test_a_picture_is_not_traced_while_it_is_denoised(view: Session, denoiser: Filter) -> None:
    """The filter has a low priority, and would take long beside the renderer."""
    denoiser.may_go.clear()
    view.trace()
    assert view.server.is_idle and view.frames[-1].samples == 1 and not view.frames[-1].is_done


def test_a_change_waits_for_no_filter(scene: Scene, view: Session, denoiser: Filter) -> None:
    denoiser.may_go.clear()
    view.trace()
    edited = with_surface(scene, "red", color=Color([0.1, 0.9, 0.1]))
    view.server.hear("change", ("stage", difference(scene, edited)))
    view.look(2)
    view.server.work()
    assert view.frames[-1].generation == 2 and not view.frames[-1].is_denoised
    view.trace()
    assert view.frames[-1].is_done is False, "its own picture waits for the filter"
    assert view.frames[-1].samples == 4 or view.frames[-1].level == 1
    shown = len(view.frames)
    denoiser.may_go.set()
    view.hear()  # the answer to the picture of before the change
    assert len(view.frames) == shown, "it is not shown"
    view.finish()
    assert view.frames[-1].generation == 2 and view.frames[-1].is_denoised and view.frames[-1].samples == 4


def test_a_later_request_for_the_same_picture_shows_the_denoised_one(view: Session) -> None:
    view.finish()
    view.look(2)
    assert view.frames[-1].generation == 2 and view.frames[-1].is_done
    np.testing.assert_array_equal(view.pixels()[..., :3], CLEAN)


def test_without_a_filter_the_view_says_why_and_is_completed_with_its_noise(view: Session, denoiser: Filter) -> None:
    denoiser.fails_with = MissingDependencyError("denoising needs the Python package")
    view.trace()
    view.hear()
    view.trace()
    assert view.frames[-1].is_done and not view.frames[-1].is_denoised
    assert view.told[-1][0] == "trouble", "the picture would replace the text"
    assert view.told[-1][1].message == "denoising needs the Python package"
    assert len(denoiser.given) == 1


def test_a_paused_view_is_denoised_after_it_is_resumed(view: Session, denoiser: Filter) -> None:
    view.server.hear("pause", ("view", True))
    view.server.work()
    assert not denoiser.given
    view.server.hear("pause", ("view", False))
    view.finish()
    assert view.frames[-1].is_denoised


def test_numbers_that_are_not_finite_reach_no_filter(view: Session, denoiser: Filter) -> None:
    posted: queue.SimpleQueue[Any] = queue.SimpleQueue()
    thread = denoise_thread.DenoiseThread(posted.put)
    pixels = np.full((2, 3, 4), np.nan, np.float32)
    thread.start("subject", pixels, None, "fast")
    answer = posted.get(timeout=PATIENCE_S)
    assert answer.subject == "subject" and not answer.why
    assert np.all(denoiser.given[-1] == 0.0)


def test_a_picture_that_refines_slowly_is_denoised_after_a_time(
    scene: Scene, denoiser: Filter, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Samples of a slow scene take long to double."""
    monkeypatch.setattr(picture, "DENOISED_S", 0.0)
    monkeypatch.setattr(pace, "MOST_SAMPLES", 1)
    view = Session(scene, 7)
    view.finish()
    assert [frame.samples for frame in view.frames if frame.is_denoised] == [1, 2, 3, 4, 5, 6, 7]
    view.area.remove()


def test_the_filter_takes_a_quarter_of_the_time_at_most() -> None:
    made = ViewPicture.__new__(ViewPicture)
    before = time.perf_counter()
    made.clean_up(np.zeros((1, 1, 4), np.float32), 1, 10.0, "")
    assert made.clean is not None and 30.0 <= made.clean.again - before < 30.0 + PATIENCE_S


def test_the_memory_of_the_filter_replaces_no_process() -> None:
    limits = Limits()
    assert not limits.is_too_large(10**8)
    assert limits.is_too_large(int(MEMORY_GROWTH * 10**8 + MEMORY_ALLOWANCE) + 1)
    heard: list[int] = []
    link = LiveLink()
    link._limits.is_too_large = heard.append  # type: ignore[method-assign, assignment]
    link._worker = object()  # type: ignore[assignment]
    viewpoint = Viewpoint.of_camera(session.Camera(world_from_camera=np.eye(4)), session.Film(4, 4, samples=1))
    link._post = lambda _message: None  # type: ignore[method-assign]
    generation = link.look("view", ViewRequest("stage", viewpoint, 4, 4, 1, 0), lambda: None)
    area = link._views["view"].area
    place = area.write(np.zeros((4, 4, 4), np.float32))
    frame = Frame("view", generation, place, 1, (0, 0), 1, True, 0.1, 10**9, "", False, 0, (), True, 7 * 10**8)
    link._hear(link._worker, "frame", frame)  # type: ignore[arg-type]
    area.remove()
    assert heard == [3 * 10**8]


def test_the_process_denoises(scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the request to the picture, with a package of the name of the filter."""
    package = tmp_path / "pyoidn"
    package.mkdir()
    (package / "__init__.py").write_text(
        "def denoise(color, albedo=None, normal=None, *, hdr, quality):\n    return color * 0 + 0.25\n", "utf-8"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    link = LiveLink()
    try:
        link.show("stage", scene)
        viewpoint = Viewpoint.of_camera(scene.camera, scene.film)
        link.look("view", ViewRequest("stage", viewpoint, WIDTH, HEIGHT, 3, 0, denoise=True), lambda: None)
        end = time.monotonic() + 2 * PATIENCE_S
        while (shown := link.latest("view")) is None or not shown.frame.is_done:
            assert time.monotonic() < end and not link.trouble("view"), link.trouble("view")
            time.sleep(0.05)
        assert shown.frame.is_denoised and shown.frame.samples == 3
        np.testing.assert_array_equal(shown.pixels[..., :3], CLEAN)
    finally:
        link.close()
