# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m spectral_core.cli``: the commands that need no Blender."""

import os
import sys

# `python -m` puts the current folder first on the module path; a json.py that lies there is not to be executed.
# Modules that the interpreter imports before this line come from there too, except with `python -P -m` and in
# `spectral-scene`.
_here = os.path.realpath(os.curdir)
sys.path[:] = [entry for entry in sys.path if entry and os.path.realpath(entry) != _here]
sys.path.append(os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__)))))  # noqa: PTH120

from spectral_core.cli import main  # noqa: E402

sys.exit(main())
