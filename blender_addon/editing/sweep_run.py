# SPDX-License-Identifier: GPL-3.0-or-later
"""A running sweep in another process."""

from __future__ import annotations

from pathlib import Path

from spectral_core.explore.sweep.ledger import DoneCount

from .background import BackgroundCommand
from .sweep_documents import Documents


class Run(BackgroundCommand):
    """The process of a sweep, and its progress by its ledger. Computed points stay when it ends.

    ``documents``: those that were written for it, None if it runs with earlier ones.
    """

    def __init__(self, command: list[str], folder: Path, total: int, documents: Documents | None = None) -> None:
        super().__init__(command)
        self.folder, self.total = folder, total
        self._documents = documents
        self._count = DoneCount(folder / "ledger.sqlite")

    def done(self) -> int:
        """Finished points in the ledger; the last known number if it cannot be read, as when the disk is full."""
        if self._documents is not None:
            self._documents.look()
        return self._count.read()

    def end(self) -> None:
        """End the process if it still runs, and close the files."""
        super().end()
        self._count.close()
        self.log.close()
        if self._documents is not None:
            self._documents.settle()
