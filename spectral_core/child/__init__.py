# SPDX-License-Identifier: GPL-3.0-or-later
"""Child processes with the module path of their parent, without the folder that they start in.

``python -c`` and ``python -m`` put the current folder first on the module path, and a user's site folder comes before
installed packages. A ``json.py`` beside a downloaded .blend would be executed. A child therefore starts from a file
(``bootstrap.py``), without the current folder (``-P``) and the user's site (``-s``), and gets its path from this
module.
"""

from __future__ import annotations

import json
import os
import site
import sys
from pathlib import Path

PATH_VARIABLE = "SPECTRAL_SCENE_SYS_PATH"
_BOOTSTRAP = Path(__file__).with_name("bootstrap.py")
_ROOT = Path(__file__).resolve().parents[2]
ISOLATED = ("-P", "-s")
"""Interpreter options: no folder of the script or of the caller on the path, and no user's site."""


def command(python: str, module: str, *arguments: str) -> list[str]:
    """Command line that runs ``module`` like ``python -m``, isolated. Start it with ``environment()``."""
    return [python, *ISOLATED, str(_BOOTSTRAP), module, *arguments]


def environment() -> dict[str, str]:
    """This process's environment with the module path for a child, and without PYTHONPATH."""
    kept = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONSTARTUP")}
    return {**kept, PATH_VARIABLE: json.dumps(trusted_path())}


def lower_priority() -> None:
    """Lower this process's priority by its first argument, if it has one: its parent answers an artist meanwhile."""
    if len(sys.argv) > 1 and hasattr(os, "nice"):
        os.nice(int(sys.argv[1]))


def cores() -> int:
    """Processor cores that this process may use; containers and schedulers may allow fewer than there are."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def memory_bytes() -> int:
    """Resident memory of this process in bytes; 0 if the system does not report it."""
    try:
        return int(Path("/proc/self/statm").read_text("ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, AttributeError):
        return 0


def trusted_path() -> list[str]:
    """``sys.path`` without the current folder, relative entries and the user's site.

    If this package was imported from one of these entries, that entry comes last: no other file of its folder can then
    hide an installed package.
    """
    try:
        here = os.path.realpath(os.curdir)
    except OSError:  # it is deleted, so no module lies in it
        here = ""
    user_site = os.path.realpath(site.getusersitepackages()) if site.ENABLE_USER_SITE is not None else ""
    installed = tuple(os.path.realpath(prefix) + os.sep for prefix in {sys.prefix, sys.base_prefix, sys.exec_prefix})

    def is_trusted(entry: str) -> bool:
        if not Path(entry).is_absolute():
            return False
        real = os.path.realpath(entry)
        if real == user_site:
            return False
        return real != here or (real + os.sep).startswith(installed)

    return list(dict.fromkeys([*filter(is_trusted, sys.path), str(_ROOT)]))
