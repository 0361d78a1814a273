# SPDX-License-Identifier: GPL-3.0-or-later
"""What a child process has written to its log, and how it has ended."""

from __future__ import annotations

import os
import subprocess
import tempfile
import threading
from typing import Any

LAST_BYTES = 4000
"""End of a log that an error message quotes."""
PATIENCE_S = 5.0
"""Time in which a process that has closed its pipes ends by itself; it is killed after that."""


def output_of(log: Any, last: int | None = None) -> bytes:
    """Output in a log so far: an open temporary file that is the standard output or error of a process.

    ``last``: most bytes, from the end; None for all.

    The process shares the position of the log, and writes there: moved for a read, it would write over earlier output.
    Windows reads only at that position, which is at the end again afterward.
    """
    size = os.fstat(log.fileno()).st_size
    start = 0 if last is None else max(0, size - last)
    if hasattr(os, "pread"):
        return os.pread(log.fileno(), size - start, start)
    log.seek(start)
    content: bytes = log.read()
    return content


class Log:
    """The output of a process, in a temporary ``file``. One thread may close it while another reads its end."""

    def __init__(self) -> None:
        self.file: Any = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the process
        self._lock = threading.Lock()

    def last_words(self) -> str:
        """End of the output, for an error message; "" without output, or after the log is closed."""
        with self._lock:
            text = "" if self.file.closed else output_of(self.file, LAST_BYTES).decode("utf-8", "replace").strip()
        return f"\nIts last words:\n{text}" if text else ""

    def close(self) -> None:
        """Close the file, which deletes it."""
        with self._lock:
            self.file.close()


def ended(process: subprocess.Popen[Any]) -> tuple[int, str]:
    """Exit status of a process that has closed its pipes, negative for a signal, and words for it."""
    try:
        code = process.wait(timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        process.kill()
        code = process.wait()
    return code, f"was killed by signal {-code}" if code < 0 else f"ended with status {code}"
