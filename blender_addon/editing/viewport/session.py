# SPDX-License-Identifier: GPL-3.0-or-later
"""One 3D view in Rendered mode: sends edits to the live renderer, and receives its pictures."""

from __future__ import annotations

import itertools
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import SpectralError
from spectral_core.render.live.link import COARSEST, LiveLink
from spectral_core.render.live.messages import Shown
from spectral_core.render.live.view import ViewRequest
from spectral_core.scene import Camera, Film, Scene

from ... import jobs
from ...properties.hooks import Topic, ignore, listen
from ...translate.camera import pixel_filter_of
from ...translate.scene import translate_scene
from ...translate.viewport.kept import Forbidden, Unfinished
from ...translate.viewport.look import look_of
from ...translate.viewport.shown import part_shown_by, shown_by, shows_a_part
from ...translate.viewport.viewpoint import border_of, pixels_of, viewpoint_of
from ...translate.visibility import cycles_settings
from ..dial.picture import covers
from ..palette.picture import look_at, shown_in
from ..pauses import pause, paused_seconds, round_number
from . import freed, previews, stages
from .sides import Side
from .stages import Stage

REDRAW_S = 0.08
"""Longest pause of the interface in one round of Blender's events, the time of a change, of its solver and of the
drawing included: Blender must not stop for 100 ms, and panels are drawn in the same round. What is left is the wait for
the first picture of a change; a later picture needs another redraw.
"""
BUSY_REDRAW_S = 0.06
"""The same while a picture is rendered or recorded: both processors are at work, and a wait ends some 20 ms late."""
UPDATE_S = 0.06
"""Time of one update after which it begins no further mesh, material or lamp; the next redraw continues."""
FINE_LEVEL, FINE_WAIT_S = 4, 0.035
"""Pixel distance of the picture that a redraw prefers, and its longest wait for it: 30 redraws a second."""
DRAWINGS = 5
"""Redraws whose longest drawing a wait leaves time for: where both processors are at work, these times vary much."""
_names = itertools.count(1)


_stages: dict[str, Stage] = {}


@dataclass(frozen=True)
class Picture:
    """Picture of a side of a view: the latest picture, if there is one, and a text on errors.

    ``matrix``: (3, 3) from its linear sRGB to the display: exposure and adaptation of its look.
    """

    shown: Shown | None
    is_current: bool
    trouble: str = ""
    matrix: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))


class ViewSession:
    """The view of one engine. ``redraw``: requests a redraw from Blender; called from another thread."""

    def __init__(self, redraw: Callable[[], None]) -> None:
        self.name = f"view {next(_names)}"
        self._redraw = redraw
        self._stage = ""
        self._sides: list[Side] = []
        self._trouble = ""
        self._is_unfinished = False
        self.needs_update = False
        """True if a redraw cannot continue the update, since Blender forbids what it needs while it draws."""
        self.drawings: deque[float] = deque(maxlen=DRAWINGS)
        """Seconds of the latest redraws with a new picture, without their waits."""

    @property
    def link(self) -> LiveLink:
        """The session's link to the renderer."""
        return jobs.live()

    def update(self, context: Any, depsgraph: Any) -> None:
        """Send the changes of an edit. Called on the main thread, the only one that may read the depsgraph."""
        before, stage = self._stage, self._enter(context, depsgraph)
        is_own = shows_a_part(context.space_data)
        if before == stage and not (is_own or self.needs_update) and stages.is_of_another(depsgraph):
            return  # the depsgraph of this view may even be unevaluated, and refer to data that are gone
        with pause():
            if not self.needs_update or len(depsgraph.updates):
                _stages[stage].keep_up(depsgraph, shown_in(depsgraph.scene), self.name)
            self._send(context, depsgraph, _stages[stage])

    def _send(self, context: Any, depsgraph: Any, stage: Stage) -> None:
        """Translate and send the scene, or a part of the translation if it takes long."""
        settings = depsgraph.scene.spectral.viewport
        stage.kept.limit(max(UPDATE_S - paused_seconds(), 0.0))  # the views of one round share the time
        stage.sent_in = round_number()
        self._is_unfinished = self.needs_update = False
        try:
            scene = self._translated(context, depsgraph, stage)
            chosen = [settings.look, settings.other][: 2 if settings.is_split else 1]
            looks = [look_of(look, depsgraph.scene, depsgraph.view_layer) for look in chosen]
        except Unfinished as unfinished:
            self._is_unfinished, self._trouble = True, ""
            self.needs_update = isinstance(unfinished, Forbidden)
            return
        except SpectralError as error:
            self._trouble = str(error)
            return
        self._trouble = ""
        for side in self._sides[len(looks) :]:
            self.link.close_view(side.name)
            self.link.drop(self._stage_of(side))
        self._sides = self._sides[: len(looks)]
        for number, look in enumerate(looks):
            if number == len(self._sides):
                self._sides.append(Side(f"{self.name}.{number}", number))
            side = self._sides[number]
            side.look = look
            changed = self.link.show(self._stage_of(side), look.on(scene))
            side.changed |= changed
            stage.changes[number] += bool(changed)

    def _stage_of(self, side: Side) -> str:
        """The left sides of all views show one scene, the right sides another."""
        return f"{self._stage}.{side.number}"

    @property
    def _changes(self) -> list[int]:
        return _stages[self._stage].changes

    def _enter(self, context: Any, depsgraph: Any) -> str:
        """The stage of this view, shared by all views with the same objects."""
        space = context.space_data
        own = f"/{space.as_pointer()}" if shows_a_part(space) else ""  # the four views of a quad view have one space
        stage = f"{depsgraph.scene.session_uid}/{depsgraph.view_layer.name}{own}"
        if stage != self._stage:
            self.leave()
            self._stage = stage
            _stages.setdefault(stage, Stage()).users.add(self.name)
            look_at(depsgraph.scene)
        return stage

    def _translated(self, context: Any, depsgraph: Any, stage: Stage) -> Scene:
        space, source = context.space_data, depsgraph.scene_eval
        film = Film(
            960, 540, samples=1, seed=source.spectral.render.seed, transparent=source.render.film_transparent,
            transparent_glass=bool(cycles_settings(source, "film_transparent_glass", False)), **pixel_filter_of(source),
        )  # fmt: skip
        camera = Camera(world_from_camera=np.eye(4))  # the camera of a view is part of each request for a picture
        layer = depsgraph.view_layer
        stage.show_part(part_shown_by(space, layer))
        if stage.scene is None:
            shows = shown_by(space, layer)
            stage.scene = translate_scene(
                depsgraph, film=film, seen_from=camera, shows=shows, kept=stage.kept, designed=stage.designed
            )
        return stage.scene

    def look(self, context: Any, depsgraph: Any) -> list[Picture]:
        """The pictures to draw now, from left to right; requests new ones if anything has changed."""
        if depsgraph.scene.spectral.viewport.is_paused:  # also while the scene cannot be translated
            self._pause(is_paused=True)
        if not self._stage:
            self.update(context, depsgraph)
        elif self._is_unfinished and not self.needs_update and _stages[self._stage].may_continue:
            with pause():
                self._send(context, depsgraph, _stages[self._stage])
        if self._is_unfinished:
            self._redraw()
            return [replace(self._picture(side), is_current=False) for side in self._sides] or [Picture(None, False)]
        if self._trouble or not self._sides:
            shown = self.link.latest(self._sides[0].name) if self._sides else None
            return [Picture(shown, is_current=False, trouble=self._trouble)]
        settings = depsgraph.scene.spectral.viewport
        if not settings.is_paused:
            # Blender's own work since the beginning of this round is not the extension's
            began = time.monotonic() - paused_seconds()
            with pause():
                waits = {side.name: self._ask(side, began, context, depsgraph) for side in self._sides}
                self._pause(is_paused=False)  # after the requests: those of before the pause are not traced first
                self._wait(began, waits)
        for side in self._sides:
            side.patience.notice(self.link.latest(side.name))
        return [self._picture(side) for side in self._sides]

    def _pause(self, *, is_paused: bool) -> None:
        for side in self._sides:
            self.link.pause(side.name, is_paused=is_paused)

    def _wait(self, began: float, waits: dict[str, float]) -> None:
        """Wait for the first pictures, and a short time for finer ones."""
        fine_s = time.monotonic() - began + FINE_WAIT_S
        for most_s, level in ((REDRAW_S, COARSEST), (fine_s, FINE_LEVEL)):
            for side in self._sides:
                left = began + min(most_s, waits[side.name]) - time.monotonic()
                if left > 0:
                    self.link.wait(side.name, side.generation, left, level)

    def _picture(self, side: Side) -> Picture:
        shown = self.link.latest(side.name)
        is_current = shown is not None and shown.frame.generation >= side.generation
        if shown is None or (not side.is_behind(self._changes) and shown.frame.generation >= side.since):
            side.shown_look = side.look
        seen = replace(side.shown_look, exposure_stops=side.look.exposure_stops)  # the exposure of a picture at hand
        return Picture(shown, is_current, self.link.trouble(side.name), seen.picture_matrix)

    def _ask(self, side: Side, began: float, context: Any, depsgraph: Any) -> float:
        """Request a new picture of a side if it would differ from the last; the time from ``began`` to wait for it."""
        space, region = context.space_data, context.region
        camera = space.camera if space.use_local_camera and space.camera else depsgraph.scene.camera
        seen = None if camera is None else camera.evaluated_get(depsgraph)
        viewpoint = viewpoint_of(context.region_data, space, seen, depsgraph.scene_eval)
        exposure = float(cycles_settings(depsgraph.scene_eval, "film_exposure", 1.0))
        samples, stage = depsgraph.scene.spectral.viewport.samples, self._stage_of(side)
        size = region.width, region.height
        border = border_of(context.region_data, space, seen, depsgraph.scene)  # the original knows it at once
        part = None if border is None else pixels_of(border, size)
        denoise = depsgraph.scene.spectral.viewport.denoise and not jobs.missing_denoiser()
        key = (*size, samples, exposure, stage, part, denoise)
        is_same, is_behind = key == side.key and viewpoint.same_as(side.viewpoint), side.is_behind(self._changes)
        if is_same and not is_behind:
            return 0.0
        request = ViewRequest(stage, viewpoint, *size, samples, 0, exposure, part, denoise)
        side.generation = self.link.look(side.name, request, self._redraw)
        if is_behind:
            side.since = side.generation
        wait_s = 0.0
        # The first drawing of a view, or of a second side, compiles its shaders; a covered picture is not seen. Of the
        # views of a scene the one that has changed it waits.
        is_waiting = side.changed or not is_same
        if is_waiting and side.key and self.drawings and not covers(context, depsgraph.scene, camera):
            longest = (BUSY_REDRAW_S if jobs.process.is_busy else REDRAW_S) - max(self.drawings)
            wait_s = side.patience.wait_s(side.generation, side.changed, began, longest)
        side.key, side.viewpoint, side.changed = key, viewpoint, frozenset()
        side.changes = self._changes[side.number]
        return wait_s

    def fail(self, text: str) -> None:
        """Show a text in place of a picture until the next edit."""
        self._trouble = text

    def leave(self) -> None:
        """Stop tracing this view."""
        stage = _stages.get(self._stage)
        if stage is None:
            return
        for side in self._sides:
            self.link.close_view(side.name)
        stage.users.discard(self.name)
        if not stage.users:
            del _stages[self._stage]
            for number in range(2):  # the sides of another view, if this one has none
                self.link.drop(f"{self._stage}.{number}")
        self._stage, self._sides = "", []


def register() -> None:
    """Start listening to the viewport's settings, and to undo."""
    listen(Topic.VIEWPORT, redraw_all)
    stages.register()
    freed.register()
    previews.register()


def unregister() -> None:
    """Stop listening."""
    ignore(Topic.VIEWPORT)
    stages.unregister()
    freed.unregister()
    previews.unregister()
    _stages.clear()


def redraw_all(_properties: Any = None) -> None:
    """Draw every 3D view again, after a setting has changed."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
