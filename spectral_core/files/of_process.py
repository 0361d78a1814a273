# SPDX-License-Identifier: GPL-3.0-or-later
"""Temporary files and folders that are named after their process, so that a later process deletes those of one that was
killed or has crashed.
"""

from __future__ import annotations

import os
import re
import shutil
import socket
import sys
import tempfile
import zlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path


def named_after_process(prefix: str) -> str:
    """``prefix``, and the number of this process; random letters that make the name unique are to follow."""
    return f"{prefix}{os.getpid()}-{_system()}-"


def left_in(folder: str | Path, prefix: str) -> Iterator[Path]:
    """Files and folders in ``folder`` with such a name whose process has ended.

    Raises OSError if the folder cannot be listed.
    """
    form = re.compile(rf"{re.escape(prefix)}([1-9][0-9]{{0,9}})-{_system()}-\w+")
    for path in Path(folder).glob(f"{prefix}*"):
        found = form.fullmatch(path.name)
        if found is not None and _has_ended(int(found[1])):
            yield path


def temporary_folder(prefix: str) -> Path:
    """Create a folder among the temporary files of this user; those that ended processes have left are deleted.

    The caller deletes it. Raises OSError if there is no space for it.
    """
    made = Path(tempfile.mkdtemp(prefix=named_after_process(prefix)))
    for path in left_in(made.parent, prefix):
        shutil.rmtree(path, ignore_errors=True)  # those of other users stay
    return made


@cache
def _system() -> str:
    """A mark of the system that numbers this process: computers and containers may share a folder, but no numbers."""
    try:
        numbering = Path("/proc/self/ns/pid").stat().st_ino
    except OSError:
        numbering = 0
    return f"{zlib.crc32(f'{socket.gethostname()} {numbering}'.encode()):08x}"


def _has_ended(number: int) -> bool:
    """True if no process has this number, and its files may be deleted.

    This process keeps its own. Windows is not asked: there ``os.kill`` would end the process, and the system refuses to
    delete a file that a process has mapped.
    """
    if number == os.getpid():
        return False
    if sys.platform == "win32":
        return True
    try:
        os.kill(number, 0)  # sends nothing
    except ProcessLookupError:
        return True
    except (OSError, OverflowError):  # a process of another user, or no number of this system
        return False
    return False
