# SPDX-License-Identifier: GPL-3.0-or-later
"""Solving one phase: split into what is independent, each part by the engine that suits it, each answer checked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.engines import Answer, solve_checked
from spectral_core.palette.qp.least_squares import Check, LinkedLeastSquares
from spectral_core.palette.qp.tied import can_tie

Array = NDArray[np.float64]

DENSE_LIMIT = 200
"""Unknowns up to which the dense active set is tried first on a spectrum with equalities."""


@dataclass(frozen=True, eq=False)
class PhaseAnswer:
    """Values per block, free colors (G, 3), the worst check of all parts, and who solved them."""

    blocks: tuple[Array, ...]
    colors: Array
    check: Check
    engines: tuple[str, ...]
    infeasible: bool
    notes: tuple[str, ...]


def solve_phase(problem: LinkedLeastSquares, engine: str | None = None, *, start: Array | None = None) -> PhaseAnswer:
    """Solve all independent parts.

    ``engine``: only this one (for comparisons); None: the fitting ones in turn. ``start``: free colors (G, 3) of a like
    problem.
    """
    if start is not None and start.shape != problem.color_lower.shape:
        start = None
    blocks: list[Array] = [np.zeros(0)] * len(problem.blocks)
    colors = np.zeros(problem.color_lower.shape)
    check, engines, infeasible, notes = Check(0.0, 0.0, 0.0), [], False, []
    for block_ids, group_ids in components(problem):
        part = _part(problem, block_ids, group_ids)
        near = None if start is None else start[group_ids]
        answer = solve_checked(part, [engine] if engine else engine_order(part), near)
        part_colors, part_blocks = part.split(answer.x)
        colors[group_ids] = part_colors
        for number, values in zip(block_ids, part_blocks, strict=True):
            blocks[number] = values
        check = _worse(check, answer.check)
        engines.append(answer.engine)
        infeasible |= answer.infeasible
        notes += _fallback_notes(answer)
    return PhaseAnswer(tuple(blocks), colors, check, tuple(engines), infeasible, tuple(notes))


def engine_order(part: LinkedLeastSquares) -> list[str]:
    """Engines to try: Newton on the free colors where there are any, the interior point first where rows must hold."""
    if part.links:
        return ["tied", "piqp", "daqp", "bvls"] if can_tie(part) else ["piqp", "daqp", "bvls"]
    return ["daqp", "piqp", "bvls"] if part.size <= DENSE_LIMIT or not part.has_equalities else ["piqp", "daqp"]


def components(problem: LinkedLeastSquares) -> list[tuple[list[int], list[int]]]:
    """Sets of blocks and groups that links tie together; every block and group is in exactly one."""
    count = len(problem.blocks)
    root = list(range(count + len(problem.color_lower)))

    def find(node: int) -> int:
        while root[node] != node:
            root[node] = root[root[node]]
            node = root[node]
        return node

    for link in problem.links:
        if link.block is not None:
            root[find(link.block)] = find(count + link.group)
    gathered: dict[int, tuple[list[int], list[int]]] = {}
    for node in range(len(root)):
        blocks, groups = gathered.setdefault(find(node), ([], []))
        (blocks if node < count else groups).append(node if node < count else node - count)
    return list(gathered.values())


def _part(problem: LinkedLeastSquares, block_ids: list[int], group_ids: list[int]) -> LinkedLeastSquares:
    if len(block_ids) == len(problem.blocks) and len(group_ids) == len(problem.color_lower):
        return problem
    block_number = {old: new for new, old in enumerate(block_ids)}
    group_number = {old: new for new, old in enumerate(group_ids)}
    links = tuple(
        link.renumbered(None if link.block is None else block_number[link.block], group_number[link.group])
        for link in problem.links
        if link.group in group_number
    )
    blocks = tuple(problem.blocks[k] for k in block_ids)
    return LinkedLeastSquares(blocks, links, problem.color_lower[group_ids], problem.color_upper[group_ids])


def _worse(one: Check, other: Check) -> Check:
    return Check(max(one.kkt, other.kkt), max(one.bounds, other.bounds), max(one.equality, other.equality))


def _fallback_notes(answer: Answer) -> list[str]:
    if not answer.rejected:
        return []
    return [f"{' and '.join(answer.rejected)} gave an answer that failed its check; {answer.engine} was used instead"]
