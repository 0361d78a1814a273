# SPDX-License-Identifier: GPL-3.0-or-later
"""A running sweep in another process."""

from __future__ import annotations

import contextlib
from pathlib import Path

from spectral_core.errors import SpectralError
from spectral_core.explore.sweep.store import Store

from .background import BackgroundCommand


class Run(BackgroundCommand):
    """The process of a sweep, and its progress by its ledger. Computed points stay when it ends."""

    def __init__(self, command: list[str], folder: Path, total: int) -> None:
        super().__init__(command)
        self.folder, self.total = folder, total
        self._done = 0

    def done(self) -> int:
        """Finished points in the ledger; the last known number if it cannot be opened, as when the disk is full."""
        if (self.folder / "project.json").is_file():
            with contextlib.suppress(SpectralError), Store.open(self.folder) as store:
                self._done = len(store.ledger.rows("done"))
        return self._done
