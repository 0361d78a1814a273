# SPDX-License-Identifier: GPL-3.0-or-later
"""A second Blender without a window that shows and saves pictures in the view of a scene.

The first use of a view such as AgX by the processor takes Blender up to 0.14 s, and a large PNG takes longer still.
Blender does both on its main thread alone, where the interface would stop. Where the second Blender fails, the first
one does the work.
"""

from __future__ import annotations

import threading
import time
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.types import Scene
from numpy.typing import NDArray

from ...translate.display.settings import ViewSettings
from ...translate.display.transform import is_known, remember, sampled, view_key
from ..background import has_program, worker_command, worker_prelude
from .picture_files import Output, write_pixels

START_SECONDS = 30.0
"""Time after which the first answer is no longer waited for."""


class ViewProcess:
    """The second Blender, with the view of a scene. It starts with the first question.

    ``output``: settings of the files that it writes.
    """

    def __init__(self, scene: Scene, output: Output | None = None) -> None:
        from spectral_core.explore.sweep.pool.executor import WorkerPool

        command = worker_command()
        self._view, self._output = ViewSettings.of(scene), output
        self._pool = WorkerPool(1, command=command, prelude=worker_prelude(command))

    def table(self) -> Future[Any]:
        """The table of the view; None where the second Blender cannot have this view."""
        return self._pool.submit(_sampled_there, self._view)

    def save(self, pixels: NDArray[np.float32], path: Path) -> Future[Any]:
        """Write a linear picture, as ``write_pixels``; False where it cannot have this view.

        Its errors are those of ``write_pixels``.
        """
        return self._pool.submit(_written_there, self._view, self._output, pixels, str(path))

    def end(self) -> None:
        """End the second Blender; a thread waits for that."""
        threading.Thread(target=self._pool.shutdown, kwargs={"wait": False}, daemon=True).start()


class TableAhead:
    """The table of a scene's view, made by a second Blender before it is asked for."""

    def __init__(self, scene: Scene) -> None:
        self._key = view_key(scene)
        self._process = None if is_known(self._key) or not has_program() else ViewProcess(scene)
        self._answer = None if self._process is None else self._process.table()
        self._latest_end = time.monotonic() + START_SECONDS

    def is_ready(self) -> bool:
        """True if nothing has to be waited for any more."""
        if self._answer is None:
            return True
        if not self._answer.done():
            return time.monotonic() > self._latest_end
        failed = self._answer.exception() is not None
        if not failed and self._answer.result() is not None:
            remember(self._key, self._answer.result())
        self._answer = None
        self.end()
        return True

    def end(self) -> None:
        """End the second Blender."""
        if self._process is not None:
            self._process.end()
            self._process = None


def _sampled_there(view: ViewSettings) -> Any:
    """Runs in the second Blender."""
    scene = bpy.context.scene
    return sampled(scene) if view.set_in(scene) else None


def _written_there(view: ViewSettings, output: Output | None, pixels: NDArray[np.float32], path: str) -> bool:
    """Runs in the second Blender."""
    scene = bpy.context.scene
    if not view.set_in(scene):
        return False
    if output is not None:
        output.set_in(scene)
    write_pixels(scene, pixels, Path(path))
    return True
