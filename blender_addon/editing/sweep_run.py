# SPDX-License-Identifier: GPL-3.0-or-later
"""A running sweep in another process."""

from __future__ import annotations

from pathlib import Path

from spectral_core.explore.sweep.store import Store

from .background import BackgroundCommand


class Run(BackgroundCommand):
    """The process of a sweep, and its progress by its ledger. Computed points stay when it ends."""

    def __init__(self, command: list[str], folder: Path, total: int) -> None:
        super().__init__(command)
        self.folder, self.total = folder, total

    def done(self) -> int:
        """Finished points in the ledger."""
        if not (self.folder / "project.json").is_file():
            return 0
        with Store.open(self.folder) as store:
            return len(store.ledger.rows("done"))
