# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands whose open ends are wide enough to be seen: Cycles closes the ends of strands."""

from __future__ import annotations

import numpy as np

from spectral_core.scene import STRAND_SIDES, Mesh

THICK = 1 / 30
"""Width of a strand's end, over the length of the strand, from which the open end shows."""
FEW = 0.05
"""Largest share of such strands that no note names."""
MOST_RINGS = 20_000
"""Rings of vertices that are examined, the first ones of a mesh."""


def has_open_ends(tubes: Mesh) -> bool:
    """True if more than a few strands of a mesh of tubes end wide."""
    rings = tubes.positions[: MOST_RINGS * STRAND_SIDES].reshape(-1, STRAND_SIDES, 3).astype(np.float64)
    if len(rings) < 2:
        return False
    centers = rings.mean(axis=1)
    widths = 2 * np.linalg.norm(rings[:, 0] - centers, axis=1)
    # Triangles join the rings of one strand, and no two strands.
    first = np.sort(tubes.triangles // STRAND_SIDES, axis=1)
    joined = np.zeros(len(rings), bool)
    joined[first[(first[:, 0] != first[:, 2]) & (first[:, 2] < len(rings)), 0]] = True
    steps = np.append(np.linalg.norm(np.diff(centers, axis=0), axis=1), 0.0) * joined
    strand = np.cumsum(np.append(True, ~joined[:-1])) - 1
    lengths = np.bincount(strand, steps)
    ends = np.flatnonzero(~joined)
    ends = ends if len(ends) == len(lengths) else np.append(ends, len(rings) - 1)
    # A ring that nothing joins is a point beside one that is not finite.
    return bool(((widths[ends] > THICK * lengths) & (lengths > 0)).mean() > FEW)
