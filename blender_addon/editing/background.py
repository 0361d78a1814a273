# SPDX-License-Identifier: GPL-3.0-or-later
"""Separate processes while Blender stays responsive: a command with its output so far, and workers with Blender."""

from __future__ import annotations

import re
import subprocess
import tempfile
import time
from collections.abc import Iterable, Sequence
from pathlib import Path

import bpy
from bpy.types import PropertyGroup

from spectral_core import child
from spectral_core.child.ending import output_of

SAVED_MEANWHILE = "the file was saved while this ran; press {button} again"
"""Status of a file that was opened, whose process is that of another session, or has ended."""
DISABLED_MEANWHILE = "the extension was disabled while this ran; press {button} again"
OF_BLENDER = re.compile(r"Blender (\d|quit)|Error: script failed")
"""Lines of Blender itself after the error of a script."""


class BackgroundCommand:
    """The process and its output. ``started``: value of ``time.monotonic``."""

    def __init__(self, command: Sequence[str]) -> None:
        self.started = time.monotonic()
        self.log = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the process
        try:
            self.process = subprocess.Popen(
                command, stdout=self.log, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, env=child.environment()
            )
        except BaseException:
            self.log.close()
            raise

    def lines(self) -> list[str]:
        """Lines of output so far, without the empty ones."""
        return [line for line in output_of(self.log).decode("utf-8", "replace").splitlines() if line.strip()]

    def message(self) -> str:
        """The last line that is not Blender's own; "" without any."""
        return next((line for line in reversed(self.lines()) if not OF_BLENDER.match(line)), "")

    def end(self) -> None:
        """End the process if it still runs; commands write their files whole or not at all."""
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(timeout=5)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()


def settle(groups: Iterable[PropertyGroup], status: str) -> None:
    """Correct the groups that are said to be under way: an undo step, or a file, of the time when a process ran."""
    for each in groups:
        if each.is_under_way:
            each.is_under_way, each.status = False, status


def temporary(name: str) -> Path:
    """Folder for the results of a file that was never saved; Blender deletes it at the end of the session."""
    return Path(bpy.app.tempdir or tempfile.gettempdir()) / name


def told_if_temporary(folder: Path) -> str:
    """A sentence on results in such a folder, "" for results elsewhere."""
    if folder != temporary(folder.name):
        return ""
    return f"{folder} is deleted at the end of the session: choose another Folder, or save the .blend, and run it again"


def has_program() -> bool:
    """True if this Blender is a program; bpy as a module has no interface that would stop."""
    return bool(bpy.app.binary_path)


def worker_command() -> tuple[str, ...]:
    """Start of a worker's command line: Blender itself without a window, or this Python if bpy is a module of it."""
    if has_program():
        return bpy.app.binary_path, "-b", "--python-exit-code", "1", "--python-expr"
    from spectral_core.render.process.interpreter import find_python

    return find_python(), *child.ISOLATED, "-c"


def worker_prelude(command: Sequence[str]) -> str:
    """Code that such a worker runs first: bpy as a module must be loaded from its installed position, since it adds a
    folder to the module path that hides it.
    """
    return "" if "--python-expr" in command else "import bpy"
