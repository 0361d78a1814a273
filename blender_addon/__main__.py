# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m blender_addon`` is ``spectral-scene`` for machines without the installed script."""

import os
import sys

# `python -m` puts the current folder first on the module path; a json.py in it must not be executed. Modules that the
# interpreter imports before this line come from there too, except with `python -P -m` and in `spectral-scene`.
_here = os.path.realpath(os.curdir)
sys.path[:] = [entry for entry in sys.path if entry and os.path.realpath(entry) != _here]
sys.path.append(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))  # noqa: PTH120

from .commands import main  # noqa: E402

sys.exit(main())
