# SPDX-License-Identifier: GPL-3.0-or-later
"""A command in a separate process while Blender stays responsive: its output so far, and its end."""

from __future__ import annotations

import subprocess
import tempfile
import time
from collections.abc import Sequence

from spectral_core import child


class BackgroundCommand:
    """The process and its output. ``started``: value of ``time.monotonic``."""

    def __init__(self, command: Sequence[str]) -> None:
        self.started = time.monotonic()
        self.log = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the process
        self.process = subprocess.Popen(
            command, stdout=self.log, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, env=child.environment()
        )

    def lines(self) -> list[str]:
        """Lines of output so far, without the empty ones."""
        self.log.seek(0)
        return [line for line in self.log.read().decode("utf-8", "replace").splitlines() if line.strip()]

    def end(self) -> None:
        """End the process if it still runs; commands write their files whole or not at all."""
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(timeout=5)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
