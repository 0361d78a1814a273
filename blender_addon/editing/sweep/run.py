# SPDX-License-Identifier: GPL-3.0-or-later
"""A running sweep in another process, and the time that a sweep takes."""

from __future__ import annotations

import time
from pathlib import Path

from bpy.types import Scene

from spectral_core.errors import counted
from spectral_core.explore.sweep.ledger import DoneCount, Pace
from spectral_core.explore.sweep.store import Store
from spectral_core.files.guarded import is_file

from ..background import BackgroundCommand
from .documents import Documents, folder_of, parameters_of


class Run(BackgroundCommand):
    """The process of a sweep, and its progress by its ledger. Computed points stay when it ends.

    ``workers``: its processes. ``documents``: those that were written for it, None if it runs with earlier ones.
    """

    def __init__(
        self, command: list[str], folder: Path, total: int, workers: int, documents: Documents | None = None
    ) -> None:
        try:
            super().__init__(command)
        except BaseException:  # such as a Blender that was updated while it ran: its program has gone
            if documents is not None:
                documents.settle()
            raise
        self.folder, self.total = folder, total
        self._documents = documents
        self._count = DoneCount(folder / "ledger.sqlite")
        self._before, self._pace = self._count.read(), Pace(workers)

    def done(self) -> int:
        """Finished points in the ledger; the last known number if it cannot be read, as when the disk is full."""
        if self._documents is not None:
            self._documents.look()
        return self._count.read()

    def seconds_left(self, done: int) -> float | None:
        """Seconds until all points are done, by those that this run has finished; None until one is."""
        return self._pace.seconds_left(time.monotonic() - self.started, done - self._before, self.total - done)

    def end(self) -> None:
        """End the process if it still runs, and close the files."""
        super().end()
        self._count.close()
        self.log.close()
        if self._documents is not None:
            self._documents.settle()


def estimate(scene: Scene) -> str:
    """Text on the time of the sweep: from finished rows, else from one render of the settings."""
    sweep = scene.spectral.sweep
    parameters_of(sweep)
    folder = folder_of(sweep)
    times: list[float] = []
    if is_file(folder / "project.json"):
        with Store.open(folder) as store:
            times = [row.seconds for row in store.ledger.rows("done") if row.seconds is not None]
    if not times:
        render = scene.render
        share = sweep.percentage / 100
        paths = render.resolution_x * render.resolution_y * share * share * sweep.samples
        work = f"{counted(sweep.budget, 'render')} of {paths / 1e6:.2g} million light paths each"
        return f"{work}; the time is known after the first one"
    each = sum(times) / len(times)
    left = max(0, sweep.budget - len(times))
    new = counted(left, "new render takes", "new renders take")
    return f"{each:.2f} s each; {new} about {each * left / sweep.workers:.0f} s"
