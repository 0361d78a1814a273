# SPDX-License-Identifier: GPL-3.0-or-later
"""The displacement of a material."""

from __future__ import annotations

from dataclasses import dataclass

from spectral_core.scene import Computed


@dataclass(frozen=True, eq=False)
class Displacement:
    """Offset of a vertex in the world, (n, 3). ``bends``: True if the surface takes the normals of the moved faces, and
    False if its shading bends them.
    """

    offset: Computed
    bends: bool
