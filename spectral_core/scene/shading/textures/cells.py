# SPDX-License-Identifier: GPL-3.0-or-later
"""Random points of Voronoi cells: PCG hashes of whole coordinates, as Blender 5.0 computes them.

Source: Jarzynski and Olano 2020, "Hash functions for GPU rendering" (PCG), in Blender's signed form.
"""

from __future__ import annotations

from typing import Any

from spectral_core.scene.shading.textures.noise import hashed


def cell_numbers(xp: Any, cell: tuple[Any, ...]) -> tuple[Any, ...]:
    """As many numbers in [0, 1] as coordinates, from the integer coordinates of a cell."""
    if len(cell) == 1:
        zero = 0.0 * cell[0]
        return (hashed(xp, cell[0]), hashed(xp, cell[0], zero + 1.0), hashed(xp, cell[0], zero + 2.0))
    return _pcg(xp, *(xp.integer(c) for c in cell))


def _arithmetic_shift(xp: Any, value: Any) -> Any:
    """Right shift by 16 that keeps the sign."""
    return (value >> 16) ^ (((value >> 31) * 0xFFFF) << 16)


def _pcg(xp: Any, x: Any, y: Any, z: Any | None = None, w: Any | None = None) -> tuple[Any, ...]:
    if z is None:
        z = 0 * x
    v = [k * 1664525 + 1013904223 for k in ((x, y, z) if w is None else (x, y, z, w))]
    for turn in range(2):
        if w is None:
            v[0] = v[0] + v[1] * v[2]
            v[1] = v[1] + v[2] * v[0]
            v[2] = v[2] + v[0] * v[1]
        else:
            v[0] = v[0] + v[1] * v[3]
            v[1] = v[1] + v[2] * v[0]
            v[2] = v[2] + v[0] * v[1]
            v[3] = v[3] + v[1] * v[2]
        if turn == 0:
            v = [k ^ _arithmetic_shift(xp, k) for k in v]
    return tuple(xp.real(k & 0x7FFFFFFF) * (1 / 2147483647.0) for k in v)


def _pcg_2d(xp: Any, x: Any, y: Any) -> tuple[Any, Any]:
    x, y = x * 1664525 + 1013904223, y * 1664525 + 1013904223
    x = x + y * 1664525
    y = y + x * 1664525
    x, y = x ^ _arithmetic_shift(xp, x), y ^ _arithmetic_shift(xp, y)
    x = x + y * 1664525
    y = y + x * 1664525
    return tuple(xp.real(k & 0x7FFFFFFF) * (1 / 2147483647.0) for k in (x, y))


def point_in_cell(xp: Any, cell: tuple[Any, ...]) -> tuple[Any, ...]:
    """Position of a cell's point within the cell."""
    if len(cell) == 1:
        return (hashed(xp, cell[0]),)
    if len(cell) == 2:
        return _pcg_2d(xp, *(xp.integer(c) for c in cell))
    return cell_numbers(xp, cell)[: len(cell)]
