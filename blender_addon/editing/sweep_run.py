# SPDX-License-Identifier: GPL-3.0-or-later
"""A sweep on its way in another process."""

from __future__ import annotations

import subprocess
import tempfile
import time
from pathlib import Path

from spectral_core.explore.sweep.store import Store


class Run:
    """A sweep on its way in another process; ``finish`` takes its last words."""

    def __init__(self, command: list[str], folder: Path, total: int) -> None:
        self.folder, self.total, self.started = folder, total, time.monotonic()
        self.log = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the process
        self.process = subprocess.Popen(command, stdout=self.log, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL)

    def done(self) -> int:
        """Points that the ledger holds, finished."""
        if not (self.folder / "project.json").is_file():
            return 0
        with Store.open(self.folder) as store:
            return len(store.ledger.rows("done"))

    def words(self) -> str:
        """Output of the process so far."""
        self.log.seek(0)
        return self.log.read().decode("utf-8", "replace")

    def cancel(self) -> None:
        """End the process; points that are computed stay."""
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(timeout=5)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
