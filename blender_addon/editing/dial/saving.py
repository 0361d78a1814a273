# SPDX-License-Identifier: GPL-3.0-or-later
"""The relit picture is saved: one file, or one for each frame, while the artist goes on."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.types import Scene
from numpy.typing import NDArray

from spectral_core.cli.shared.outputs import numbered
from spectral_core.errors import RenderError

from ..background import has_program
from ..deferred import open_scene
from . import changes, live
from .picture import cropped, linear_pixels
from .picture_files import Output, require_ending, write_picture, write_pixels
from .view_process import ViewProcess

MOST_UNWRITTEN = 2
"""Pictures that wait for the second Blender; each may take hundreds of megabytes."""


@dataclass(frozen=True)
class _Unwritten:
    path: Path
    pixels: NDArray[np.float32]
    answer: Future[Any]


class Saving:
    """Relights and writes one picture after the other.

    Parameters
    ----------
    scene
        Its dial is shown, and its view.
    path
        Of the picture. Raises InvalidInputError unless it ends in .png or .exr.
    frames
        Frames to write, whose numbers are added to the name, or replace ``####`` in it, as in Blender; empty for the
        present picture.
    at_once
        Write here; otherwise a second Blender does it, if there is one.
    """

    def __init__(self, scene: Scene, path: Path, frames: Sequence[int] = (), *, at_once: bool) -> None:
        require_ending(path)
        self._number, self._before = scene.session_uid, (scene.frame_current, scene.frame_subframe)
        self._targets: deque[tuple[int | None, Path]] = deque([] if frames else [(None, path)])
        self._targets += [(frame, _of_frame(path, frame)) for frame in frames]
        self.total, self.saved, self.first = len(self._targets), 0, self._targets[0][1]
        self._moves = bool(frames)
        self._compared = {frames[0], frames[len(frames) // 2], frames[-1]} if frames else set()
        self.moved = ""
        """What of the scene has moved since the recording in one of the frames; "" if nothing was found."""
        output = None if at_once or not has_program() else Output.of(scene)
        self._process = None if output is None else ViewProcess(scene, output)
        self._unwritten: deque[_Unwritten] = deque()

    def step(self) -> bool:
        """Relight the next picture and have it written; True if all were relit. Raises SpectralError and OSError."""
        scene = open_scene(self._number)
        if scene is None or not self._targets:
            return True
        if self._moves and bpy.app.is_job_running("RENDER"):
            return False  # a render reads the frame
        while self._unwritten and self._unwritten[0].answer.done():
            self._settle(scene)
        if len(self._unwritten) >= MOST_UNWRITTEN:
            return False
        frame, path = self._targets.popleft()
        if frame is not None:
            scene.frame_set(frame)
            if frame in self._compared and not self.moved:
                found = _differences(scene)
                self.moved = f"at frame {frame} {found}" if found else ""
        image = live.show(scene)
        pixels = cropped(scene, image)
        if self._process is None:
            if pixels is None:
                write_picture(scene, image, path)
            else:
                write_pixels(scene, pixels, path)
            self.saved += 1
        else:
            if pixels is None:
                pixels = linear_pixels(image)
            self._unwritten.append(_Unwritten(path, pixels, self._process.save(pixels, path)))
        return not self._targets

    def wait(self) -> None:
        """Wait for the second Blender; reads nothing from this one."""
        for each in self._unwritten:
            each.answer.exception()

    def finish(self) -> None:
        """Write what the second Blender could not write. Raises the errors of ``write_picture``."""
        scene = open_scene(self._number)
        while self._unwritten and scene is not None:
            self._settle(scene)

    def end(self) -> None:
        """End the second Blender, and return to the frame of before."""
        if self._process is not None:
            self._process.end()
            self._process = None
        scene = open_scene(self._number)
        if self._moves and scene is not None and (scene.frame_current, scene.frame_subframe) != self._before:
            scene.frame_set(self._before[0], subframe=self._before[1])

    def _settle(self, scene: Scene) -> None:
        """Take the answer about the first picture."""
        picture = self._unwritten.popleft()
        try:
            is_written = picture.answer.result()
        except RenderError:  # it did not start, or it ended
            is_written = False
        if not is_written:
            write_pixels(scene, picture.pixels, picture.path)
        self.saved += 1


def _differences(scene: Scene) -> str:
    """Differences of the present frame from the recorded scene, which the dial does not keep; "" for none, and for a
    scene that takes long to compare.
    """
    dial = scene.spectral.dial
    before = dial.changes
    found = "" if scene.session_uid in changes.slow_scenes else changes.compare(scene)
    if dial.changes != before:
        dial.changes = before
    return found


def _of_frame(path: Path, frame: int) -> Path:
    return numbered(path, frame) if "#" in path.stem else path.with_name(f"{path.stem}{frame:04d}{path.suffix}")
