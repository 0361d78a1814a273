# SPDX-License-Identifier: GPL-3.0-or-later
"""The rows of a palette with both sides unknown, collected from the assemblies of both sides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.side import Assembled, Assembler
from spectral_core.palette.assemble.state import PaletteState
from spectral_core.palette.qp.block import Block, RowKey

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Columns = Mapping[tuple[int, int], int]
"""(group, condition) → number of its free color."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Every requested color, three numbers each, with the unknowns that it depends on."""

    surface_of: Index
    """(m,): index of each row's designed reflectance; -1 if it is given."""
    light_of: Index
    observer_of: Index
    surface_slopes: Array
    """(m, 3, n): slope of the color by reflectance if the light is given; else 0."""
    light_slopes: Array
    """(m, 3, n): slope of the color by light if the reflectance is given; else 0."""
    metric: Array
    """(m, 3, 3): factor of each row's color."""
    targets: Array
    """(m, 3), already in the metric."""
    ties: Array
    """(m, 3, q)."""
    weights: Array
    """(m,): squared; those of exact rows are set by ``exact_weight``."""
    exact: NDArray[np.bool_]


def collected(surfaces: Assembled, lights: Assembled, columns: Columns, n: int) -> Rows:
    """The rows of both sides; common rows once."""
    found: dict[tuple[RowKey, int], _Row] = {}
    items = surfaces.items, lights.items
    for axis, side in enumerate((surfaces, lights)):
        for block in side.quadratic.blocks:
            for r, key in enumerate(block.keys):
                ties, column = _tied(side, block, r, columns)
                if (key, column) not in found:
                    found[key, column] = _row(axis, side, block, r, items, ties, n)
    rows, count = list(found.values()), 3 * len(columns)
    return Rows(
        np.array([row.owners[0] for row in rows], dtype=np.intp),
        np.array([row.owners[1] for row in rows], dtype=np.intp),
        np.array([row.observer for row in rows], dtype=np.intp),
        np.array([row.slopes[0] for row in rows]).reshape(len(rows), 3, n),  # also without requests
        np.array([row.slopes[1] for row in rows]).reshape(len(rows), 3, n),
        np.array([row.metric for row in rows]).reshape(len(rows), 3, 3),
        np.array([row.target for row in rows]).reshape(len(rows), 3),
        np.array([row.ties for row in rows]).reshape(len(rows), 3, count),
        np.array([row.weight for row in rows]),
        np.array([row.exact for row in rows], dtype=bool),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Row:
    """One of ``Rows``."""

    owners: tuple[int, int]
    observer: int
    slopes: Array
    metric: Array
    target: Array
    ties: Array
    weight: float
    exact: bool


def _tied(side: Assembled, block: Block, r: int, columns: Columns) -> tuple[Array, int]:
    """Slopes of a row by the free colors of both sides, and its free color; -1 for a target."""
    rows = slice(3 * r, 3 * r + 3)
    ties = np.zeros((3, 3 * len(columns)))
    tied = np.flatnonzero(block.ties[rows].any(axis=0))
    if not tied.size:
        return ties, -1
    number = int(tied[0]) // 3
    column = columns[side.group_conditions[number]]
    ties[:, 3 * column : 3 * column + 3] = block.ties[rows, 3 * number : 3 * number + 3]
    return ties, column


def _row(
    axis: int,
    side: Assembled,
    block: Block,
    r: int,
    items: tuple[tuple[int, ...], tuple[int, ...]],
    ties: Array,
    n: int,
) -> _Row:
    condition, cell = block.keys[r]
    exact = bool(block.exact[3 * r])
    metric = np.eye(3) if side.view.metric is None or exact else side.view.metric[cell]
    owners = tuple(items[side_].index(at) if at in items[side_] else -1 for side_, at in enumerate(cell))
    seen = side.view.condition(condition)
    slopes = np.zeros((2, 3, n))
    if min(owners) < 0:
        slopes[axis] = side.view.known_matrices(seen.variant)[seen.observer, cell[1 - axis]]
    weight = 0.0 if exact else float(block.weights[3 * r])
    target = block.targets[3 * r : 3 * r + 3]
    return _Row((owners[0], owners[1]), seen.observer, slopes, metric, target, ties, weight, exact)


def known_colors(
    assembler: Assembler, state: PaletteState, columns: Columns, boxes: Array
) -> tuple[Array, Array, Array]:
    """Ties, targets and weights of group members without designed factors; exact ones fix the group's color."""
    problem, requests = assembler.problem, assembler.requests
    ties, targets, weights = [np.zeros((0, 3 * len(columns)))], [np.zeros(0)], [np.zeros(0)]
    for (number, condition), column in columns.items():
        group = requests.groups[number]
        for k, cell in enumerate(group.members):
            if problem.reflectances[cell[0]].free or problem.lights[cell[1]].free:
                continue
            color = state.colors(requests.conditions[condition])[cell]
            weight = assembler.row_weight(group.weights[k], group.exact[k], condition, cell)
            if np.isinf(weight):
                boxes[:, column] = color
                continue
            ties.append(np.eye(3, 3 * len(columns), 3 * column))
            targets.append(-color)
            weights.append(np.full(3, weight))
    return np.concatenate(ties), np.concatenate(targets), np.concatenate(weights)
