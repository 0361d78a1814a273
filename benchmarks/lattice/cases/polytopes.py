# SPDX-License-Identifier: GPL-3.0-or-later
"""Random convex regions of several types, for tests and figures of the lattice room."""

from __future__ import annotations

import numpy as np

from spectral_core.lattice.fill.frame import random_rotation
from spectral_core.lattice.fill.regions import Region, ball, corner_simplex, halfspaces

KINDS = ("tangent planes", "cut box", "thin box 100:1", "simplex", "corner simplex", "cut ball", "cross polytope")


def random_polytope(index: int) -> tuple[str, Region]:
    """Region number ``index``: types and dimensions 2 to 10 alternate, all else is random with that seed."""
    rng = np.random.default_rng(index)
    kind = KINDS[index % len(KINDS)]
    n = 2 + (index // len(KINDS)) % 9
    turn = random_rotation(n, rng)
    center = rng.normal(size=n) * 10.0 ** rng.integers(-2, 4)
    sides = np.concatenate([turn, -turn])
    if kind == "tangent planes":
        normals = rng.normal(size=(4 * n, n))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        rows, limits = (
            np.concatenate([normals, sides]),
            np.concatenate([rng.uniform(0.5, 1.5, 4 * n), np.full(2 * n, 2.0)]),
        )
    elif kind == "cut box":
        normals = rng.normal(size=(3, n))
        rows, limits = np.concatenate([sides, normals]), np.concatenate([np.ones(2 * n), rng.uniform(0.1, 0.6, 3)])
    elif kind == "thin box 100:1":
        widths = np.exp(rng.uniform(0.0, np.log(100.0), n))
        widths[:2] = [1.0, 100.0]
        rows, limits = sides, np.concatenate([widths, widths])
    elif kind == "simplex":
        corners = rng.normal(size=(n + 1, n)) @ np.diag(np.exp(rng.uniform(0.0, 2.0, n)))
        return kind, simplex_of(corners + center)
    elif kind == "corner simplex":
        return kind, corner_simplex(n, float(rng.uniform(0.5, 5.0)))
    elif kind == "cut ball":
        p = float(rng.choice([1.5, 2.0, 3.0, 6.0]))
        normals = rng.normal(size=(2, n))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        return kind, ball(center, 1.0, p=p) & halfspaces(normals, rng.uniform(0.1, 0.5, 2) + normals @ center)
    else:
        return kind, ball(center, np.exp(rng.uniform(0.0, 1.0, n)), p=1.0)
    return kind, halfspaces(rows, limits + rows @ center)


def simplex_of(corners: np.ndarray) -> Region:
    """The simplex with n + 1 corners (n + 1, n) as half-spaces."""
    n = corners.shape[1]
    rows, limits = [], []
    for i in range(n + 1):
        others = np.delete(corners, i, axis=0)
        normal = np.linalg.svd(others[1:] - others[0])[2][-1] if n > 1 else np.ones(1)
        if normal @ (corners[i] - others[0]) > 0:
            normal = -normal
        rows.append(normal)
        limits.append(normal @ others[0])
    return halfspaces(np.array(rows), np.array(limits))
