# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m blender_addon`` is ``spectral-scene``, for places where no script is installed."""

import sys

from .commands import main

sys.exit(main())
