# SPDX-License-Identifier: GPL-3.0-or-later
"""The part of the engine that draws a 3D view: sends edits, draws the latest picture, reports errors."""

from __future__ import annotations

import contextlib
import time
import traceback
import weakref
from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np

from spectral_core.errors import SpectralError

from . import compat
from .drawing.clock import clock
from .drawing.covered import covered
from .drawing.viewport import Canvas, draw_message, reserve_memory
from .editing.viewport.session import Picture, ViewSession
from .translate.shading.image_files.permitted import drawing


class Viewport:
    """The view of one engine, which Blender creates anew for each 3D view and each change of its shading."""

    def __init__(self, engine: Any) -> None:
        # weak: Blender frees the engine of a view that is closed, which must not live on as its renderer's listener
        known = weakref.ref(engine)

        def redraw() -> None:
            alive = known()
            if alive is not None:
                with contextlib.suppress(ReferenceError):  # its last pictures arrive too late
                    alive.tag_redraw()

        self._session = ViewSession(redraw)
        # not in the engine's __del__: a freed engine refuses to be asked for its viewport
        weakref.finalize(engine, self._session.leave).atexit = False
        self._canvases = [Canvas(), Canvas()]

    def update(self, engine: Any, context: Any, depsgraph: Any) -> None:
        """Send the changes, and request a redraw of the view."""
        with self._reporting():
            reserve_memory(context.region)
            self._session.update(context, depsgraph)
        engine.tag_redraw()

    @contextlib.contextmanager
    def _reporting(self) -> Iterator[None]:
        """Show an unexpected error in the view: Blender would switch the view off, and say nothing in it."""
        try:
            yield
        except SpectralError as error:
            self._session.fail(str(error))
        except Exception as error:  # noqa: BLE001 - of any part of the translation
            traceback.print_exc()
            self._session.fail(f"The view could not be updated ({type(error).__name__}: {error})")

    def draw(self, engine: Any, context: Any, depsgraph: Any) -> None:
        """Draw the latest pictures, side by side in a split view."""
        pictures: list[Picture] = []
        with self._reporting(), drawing():  # a long update continues in redraws
            pictures = self._session.look(context, depsgraph)
        if not pictures:
            pictures = self._session.look(context, depsgraph)  # the error, until the next edit
        if self._session.needs_update:
            engine.tag_update()
        began = time.monotonic()
        scene, region = depsgraph.scene_eval, context.region
        settings, scale = scene.spectral.viewport, bpy.context.preferences.system.ui_scale
        middle = round(settings.divider * region.width) if len(pictures) > 1 else region.width
        clips = [(0, 0, middle, region.height), (middle, 0, region.width - middle, region.height)]
        is_new, transparent = False, scene.render.film_transparent
        for picture, canvas, clip in zip(pictures, self._canvases, clips, strict=False):
            if picture.shown is not None:
                is_new |= canvas.show(picture.shown, shown_from_rgb(picture.matrix), transparent=transparent)
                canvas.draw(engine, scene, clip if len(pictures) > 1 else None)
        engine.update_stats(*words(pictures, settings))
        trouble = next((picture.trouble for picture in pictures if picture.trouble), "")
        if trouble:
            draw_message(trouble, region, covered(context.area, region), scale)
        if is_new:  # a picture that is there already takes a part of the time
            self._session.drawings.append(time.monotonic() - began)


def words(pictures: list[Picture], settings: Any) -> tuple[str, str]:
    """Statistics for the corner of the view, and its present activity."""
    frames = [picture.shown.frame for picture in pictures if picture.shown is not None]
    if not frames:
        is_loading = not any(picture.trouble for picture in pictures)
        return "", "Paused" if settings.is_paused else "Loading the scene" if is_loading else ""
    kind = " and ".join(dict.fromkeys("Spectral" if frame.is_spectral else "RGB" for frame in frames))
    samples, seconds = min(frame.samples for frame in frames), max(frame.seconds for frame in frames)
    left_s = max(frame.left_s for frame in frames)
    left = f" | {clock(left_s, digits=0)} left" if left_s >= 1 else ""
    memory = max(frame.memory for frame in frames) / 1e6
    denoised = ", denoised" if all(frame.is_denoised for frame in frames) else ""
    state = f"{kind} | Sample {samples}/{settings.samples}{denoised} | {clock(seconds)}{left} | {memory:.0f} MB"
    if settings.is_paused:
        return state, "Paused"
    is_current = all(picture.is_current for picture in pictures)
    return state, "" if is_current else "Updating: the picture is of before the change"


def working_from_rgb() -> Any:
    """Matrix (3, 3) from linear sRGB to Blender's scene-linear space, None if they are the same."""
    matrix = compat.rec709_from_working(compat.working_space(bpy.data))
    return None if np.array_equal(matrix, np.eye(3)) else np.linalg.inv(matrix)


def shown_from_rgb(picture_matrix: Any) -> Any:
    """``working_from_rgb`` after a look's exposure and adaptation, None if nothing changes."""
    matrix = working_from_rgb()
    if np.array_equal(picture_matrix, np.eye(3)):
        return matrix
    return picture_matrix if matrix is None else matrix @ picture_matrix
