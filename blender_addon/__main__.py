# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m blender_addon`` is ``spectral-scene`` for machines without the installed script."""

import os
import sys


def _folder(entry: str) -> str:
    try:
        return os.path.realpath(entry)
    except OSError:  # the current folder is deleted: relative entries are nowhere
        return ""


# `python -m` puts the current folder first on the module path; a json.py in it must not be executed. Modules that the
# interpreter imports before this line come from there too, except with `python -P -m` and in `spectral-scene`.
_here = _folder(os.curdir)
sys.path[:] = [entry for entry in sys.path if entry and _folder(entry) != _here]
sys.path.append(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))  # noqa: PTH120

try:
    from .commands import main
except KeyboardInterrupt:  # before the module that prints one line for Ctrl-C is there
    print("stopped", file=sys.stderr)
    sys.exit(130)

sys.exit(main())
