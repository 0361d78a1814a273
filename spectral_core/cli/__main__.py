# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m spectral_core.cli``: the commands that need no Blender."""

import sys

from spectral_core.cli import main

sys.exit(main())
