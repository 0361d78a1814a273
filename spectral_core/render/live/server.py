# SPDX-License-Identifier: GPL-3.0-or-later
"""The live render process: keeps scenes loaded, edits them on request, and traces their views."""

from __future__ import annotations

import queue
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from spectral_core.child import memory_bytes
from spectral_core.errors import SpectralError
from spectral_core.render.live.area import PixelArea
from spectral_core.render.live.denoise_thread import Denoised, DenoiseThread
from spectral_core.render.live.messages import AreaName, Frame, Trouble
from spectral_core.render.live.pace import Pace
from spectral_core.render.live.picture import ViewPicture
from spectral_core.render.live.stage import Stage
from spectral_core.render.live.view import ViewRequest
from spectral_core.render.process import serving
from spectral_core.render.same import equal
from spectral_core.scene import Scene


@dataclass
class _Kept:
    """A stage and its pending views. ``is_second``: True if an unexpected error has had the present scene loaded
    anew.
    """

    stage: Stage = field(default_factory=Stage)
    scene: Scene | None = None
    is_pending: bool = False
    pace: Pace = field(default_factory=Pace)
    trouble: str = ""
    is_second: bool = False


@dataclass
class _View:
    request: ViewRequest
    area: PixelArea
    picture: ViewPicture | None = None
    started: float = 0.0


class Server:
    """Serves one session.

    ``tell``: sends a message to it. ``hear_more``: called after each launch; hears the messages that have come.
    ``post``: called on another thread; has this server hear a message of its own.
    """

    def __init__(
        self,
        tell: Any,
        hear_more: Callable[[Server], None] = lambda _server: None,
        post: Callable[[tuple[str, Any]], None] = lambda _message: None,
    ) -> None:
        self._tell, self._hear_more = tell, hear_more
        self._denoiser = DenoiseThread(lambda denoised: post(("denoised", denoised)))
        self._denoised = 0  # number of the picture that is denoised at present; a reference would keep its scene
        self._stages: dict[str, _Kept] = {}
        self._views: dict[str, _View] = {}
        self._paused: set[str] = set()  # views that are traced no further until they are resumed

    @property
    def is_idle(self) -> bool:
        """True if nothing is left to trace until the next message."""
        return self._next_view() is None

    def hear(self, kind: str, content: Any) -> None:
        """Accept a message; this neither traces nor loads anything.

        If it fails, the session is told, and sends the scene of a change anew. It ignores what it is told of a view
        that it has closed or enlarged since: the file of that is gone.
        """
        try:
            self._accept(kind, content)
        except Exception as error:  # noqa: BLE001 - it is no error of a scene, and the process serves on
            traceback.print_exc()
            if kind == "change":
                self._tell(("lost", content[0]))
            elif kind == "view":
                self._close(content[0])
                text = f"This view failed ({type(error).__name__}: {error}); switch it to Solid and back to Rendered."
                self._tell(("trouble", Trouble(content[0], content[1].generation, text)))

    def _accept(self, kind: str, content: Any) -> None:
        if kind == "scene":
            name, scene = content
            kept = self._stages.setdefault(name, _Kept())
            kept.scene, kept.is_pending, kept.is_second = scene, True, False
        elif kind == "change":
            kept = self._stages[content[0]]
            assert kept.scene is not None
            kept.scene, kept.is_pending, kept.is_second = content[1].applied_to(kept.scene), True, False
        elif kind == "view":
            name, request, area = content
            self._hear_view(name, request, area)
        elif kind == "pause":
            name, is_paused = content
            (self._paused.add if is_paused else self._paused.discard)(name)
        elif kind == "close":
            self._close(content)
            self._paused.discard(content)
        elif kind == "denoised":
            self._take(content)
        elif kind == "drop":
            dropped = self._stages.pop(content, _Kept())
            for name in [name for name, view in self._views.items() if view.request.stage == content]:
                self._accept("close", name)
            dropped.stage.forget()

    def _close(self, name: str) -> None:
        if (view := self._views.pop(name, None)) is not None:
            view.area.close()

    def _hear_view(self, name: str, request: ViewRequest, area: AreaName) -> None:
        view, kept = self._views.get(name), self._stages.get(request.stage)
        if view is None or view.area.path != area.path:
            self._close(name)
            self._views[name] = _View(request, PixelArea(area.path, area.pixels))
        elif kept is None or not self._stands(view, kept, request):
            view.request, view.picture = request, None
        else:  # after a change of the scene, its picture is begun before the session asks for it
            view.request = request
            if view.picture is not None and view.picture.level:
                self._show(name, view, kept, view.picture, request)
        if kept is not None and kept.trouble and not kept.is_pending:  # the session shows it for this request, too
            self._tell(("trouble", Trouble(name, request.generation, kept.trouble)))

    @staticmethod
    def _stands(view: _View, kept: _Kept, request: ViewRequest) -> bool:
        """True if the picture of a view is of the present scene, and another request for it is the same."""
        if view.picture is None or kept.is_pending or kept.trouble:
            return False
        return equal(replace(view.request, generation=request.generation), request)

    def work(self) -> None:
        """Update scenes, and trace one launch of the view that has waited longest."""
        for name, kept in self._stages.items():
            if kept.is_pending and kept.scene is not None and not self._rests(name):
                self._bring_up(name, kept)
        found = self._next_view()
        if found is not None:
            name, view = found
            kept = self._stages[view.request.stage]
            try:
                self._trace(name, view, kept)
            except SpectralError as error:
                self._say_trouble(view.request.stage, kept, str(error))
            except Exception as error:  # noqa: BLE001 - the session is told, and the process serves on
                self._recover(view.request.stage, kept, error)
        self._denoise()

    def _bring_up(self, name: str, kept: _Kept) -> None:
        for view in self._views.values():  # they refer to the scene before the change
            if view.request.stage == name:
                view.picture = None
        kept.is_pending, kept.trouble = False, ""
        assert kept.scene is not None
        try:
            if kept.stage.scene is not None:
                kept.stage.activate()
            loads = kept.stage.loads
            kept.stage.show(kept.scene)
            if kept.stage.loads != loads:
                kept.pace = Pace()
        except SpectralError as error:
            self._say_trouble(name, kept, str(error))
        except Exception as error:  # noqa: BLE001 - the session is told, and the process serves on
            self._recover(name, kept, error)

    def _recover(self, name: str, kept: _Kept, error: Exception) -> None:
        """After an unexpected error load the scene anew, once: the view must not keep a failed edit in place."""
        traceback.print_exc()
        if kept.is_second:
            self._say_trouble(name, kept, f"{type(error).__name__}: {error}")
            return
        kept.stage.forget()
        kept.is_pending, kept.is_second = True, True

    def _say_trouble(self, name: str, kept: _Kept, text: str) -> None:
        kept.trouble = text
        kept.stage.forget()
        for view_name, view in self._views.items():
            if view.request.stage == name:
                self._tell(("trouble", Trouble(view_name, view.request.generation, text)))

    def _next_view(self) -> tuple[str, _View] | None:
        """The view with the least progress of its current request."""
        waiting = [
            (0 if view.picture is None else view.picture.launches, name)
            for name, view in self._views.items()
            if name not in self._paused and self._can_trace(view)
        ]
        return None if not waiting else (min(waiting)[1], self._views[min(waiting)[1]])

    def _rests(self, stage: str) -> bool:
        """True if all views of a stage are paused: its changes are made after one is resumed."""
        views = [name for name, view in self._views.items() if view.request.stage == stage]
        return bool(views) and self._paused.issuperset(views)

    def _can_trace(self, view: _View) -> bool:
        kept = self._stages.get(view.request.stage)
        if kept is None or kept.scene is None or kept.trouble:
            return False
        return view.picture is None or not (view.picture.is_done or view.picture.number == self._denoised)

    def _trace(self, name: str, view: _View, kept: _Kept) -> None:
        stage, request = kept.stage, view.request
        stage.activate()
        if view.picture is None:
            stride = kept.pace.stride(request.part[2] * request.part[3])
            view.picture = ViewPicture(stage.launcher, request, stride, kept.pace)
            view.started = time.monotonic()
        picture = view.picture
        stage.look_from(request.viewpoint, request.width)
        shows_more = picture.step()
        self._measure(picture, kept.pace)
        self._hear_more(self)
        # After a change nobody needs the whole picture, whose conversion would hold up the change. The first picture of
        # each change is shown: otherwise changes that follow each other fast would show nothing.
        is_present = view.picture is picture and not kept.is_pending
        if shows_more and self._views.get(name) is view and (is_present or picture.launches == 1) and not picture.clean:
            self._show(name, view, kept, picture, view.request if view.picture is picture else request)

    @staticmethod
    def _measure(picture: ViewPicture, pace: Pace) -> None:
        """Note how long the latest launch took; after slow ones of a newly loaded scene measure the fixed time, too."""
        if (latest := picture.latest) is None:
            return
        pace.note(latest.samples, latest.seconds)
        # not after the first launch of a picture, which may have recorded and compiled, and whose picture is shown next
        if picture.launches > 1 and pace.wants_fixed(latest.seconds):
            pace.note_fixed(picture.launch_nothing())

    def _show(self, name: str, view: _View, kept: _Kept, picture: ViewPicture, request: ViewRequest) -> None:
        """Tell the session what a view shows now; ``request``: the one that the picture answers."""
        stage = kept.stage
        pixels, samples = picture.shown()
        place = view.area.write(pixels)
        spent, corner = time.monotonic() - view.started, request.part[:2]
        self._tell(("frame", Frame(
            name, request.generation, place, picture.level, corner, samples, picture.is_complete, spent,
            memory_bytes(), stage.how, stage.plan.is_spectral, stage.launcher.recordings,
            stage.notes if picture.launches == 1 else (), picture.clean is not None, self._denoiser.memory,
            picture.left_s,
        )))  # fmt: skip
        if picture.why_noisy:
            self._tell(("trouble", Trouble(name, request.generation, picture.why_noisy)))

    def _denoise(self) -> None:
        """Denoise a picture that has many more samples than when it was last denoised."""
        if self._denoised:
            return
        for name, view in self._views.items():
            picture = view.picture
            if picture is not None and picture.wants_denoising and name not in self._paused:
                self._denoised = picture.number
                subject = picture.number, picture.samples
                self._denoiser.start(subject, picture.pixels().copy(), picture.guides(), picture.quality)
                return

    def _take(self, denoised: Denoised) -> None:
        """Show a denoised picture, unless its view or its scene has changed since."""
        self._denoised = 0
        number, samples = denoised.subject
        for name, view in self._views.items():
            picture, kept = view.picture, self._stages.get(view.request.stage)
            if picture is None or picture.number != number or kept is None or kept.is_pending or kept.trouble:
                continue
            picture.clean_up(denoised.pixels, samples, denoised.seconds, denoised.why)
            self._show(name, view, kept, picture, view.request)


def main() -> None:
    """Serve until the input closes."""
    messages: queue.SimpleQueue[Any] = queue.SimpleQueue()

    def hear_more(server: Server) -> None:
        while not messages.empty():
            server.hear(*messages.get())

    server = Server(serving.begin(messages.put), hear_more, messages.put)
    while True:
        if server.is_idle:
            server.hear(*messages.get())
        hear_more(server)
        server.work()


if __name__ == "__main__":
    main()
