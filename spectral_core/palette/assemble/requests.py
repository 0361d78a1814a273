# SPDX-License-Identifier: GPL-3.0-or-later
"""The cells of a problem read into targets and groups of equal colors, once per solve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.criteria import capped_weights
from spectral_core.palette.given import cell_name
from spectral_core.palette.problem import Cell, CellIndex, CellMode, PaletteProblem

Array = NDArray[np.float64]

WEIGHT_RATIO = 1e4
"""Largest ratio between the weights of two cells; double precision does not hold the squares of larger ones."""
SMOOTHNESS_RANGE = (1e-6, 30.0)
"""Range of the smoothness, relative to the median weight of cells, that double precision can solve."""


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """A cell with a target."""

    cell: CellIndex
    color: Array
    weight: float
    exact: bool


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """Cells that share one free color. ``weights`` and ``exact`` per member; ``box``: (2, 3).

    A cell may be in one group of exact cells and in one of soft ones. ``gap``: the largest distance, in linear RGB,
    between boxes that have no color in common; then ``box`` is the middle between them.
    """

    members: tuple[CellIndex, ...]
    weights: tuple[float, ...]
    exact: tuple[bool, ...]
    box: Array
    gap: float = 0.0


@dataclass(frozen=True, slots=True)
class Condition:
    """A viewing condition: an observer, and a variant of the lights (None: the lights themselves)."""

    observer: int
    variant: int | None


@dataclass(frozen=True, slots=True, eq=False)
class Requests:
    """The requests of all cells; weights are capped and scaled so that the median cell has weight 1."""

    targets: tuple[Target, ...]
    blacks: tuple[Target, ...]
    """The targets that hold for every condition."""
    groups: tuple[Group, ...]
    conditions: tuple[Condition, ...]
    """The first one is the condition of the targets."""
    smoothness: float
    weight_scale: float
    """Divisor of the weights."""
    notes: tuple[str, ...]


def compiled_requests(problem: PaletteProblem, elsewhere: Sequence[float] = ()) -> Requests:
    """Read the cells. ``elsewhere``: if they are a part of a palette, the weights of its other cells."""
    index = [(i, j) for i in range(len(problem.reflectances)) for j in range(len(problem.lights))]
    weights = {at: problem.cells[at[0]][at[1]].weight for at in index if weighs(problem.cells[at[0]][at[1]])}
    asked = np.array([*weights.values(), *elsewhere])
    capped = capped_weights(asked, WEIGHT_RATIO)
    notes = []
    if not np.array_equal(asked, capped):
        notes.append(
            f"cell weights from {asked[asked > 0].min():g} to {asked.max():g} were brought within a ratio of "
            f"{WEIGHT_RATIO:g}, beyond which numbers lose accuracy; make a cell exact if it must hold"
        )
    # The median, so that dragging one weight changes nothing else.
    positive = np.sort(capped[capped > 0])
    scale = float(positive[(positive.size - 1) // 2]) if positive.size else 1.0
    weights = dict(zip(weights, (capped / scale)[: len(weights)], strict=True))
    smoothness = problem.smoothness / scale
    if smoothness > 0 and not SMOOTHNESS_RANGE[0] <= smoothness <= SMOOTHNESS_RANGE[1]:
        smoothness = float(np.clip(smoothness, *SMOOTHNESS_RANGE))
        notes.append(
            f"smoothness {problem.smoothness:g} was brought to {smoothness * scale:g}, nearer to the cell weights"
        )
    for i, j in index:
        cell = problem.cells[i][j]
        rows = {i, *(other for other, _ in cell.others)}
        if cell.mode is CellMode.DISTINCT and not any(problem.reflectances[row].free for row in rows):
            name = cell_name(problem, (i, j))
            notes.append(f"{name} should be distinct from measured materials, but it is measured, too: none can change")
    targets = [_target(at, problem.cells[at[0]][at[1]], weights) for at in index]
    blacks = tuple(t for t in targets if t is not None and problem.cells[t.cell[0]][t.cell[1]].mode is CellMode.BLACK)
    groups = _groups(problem, weights)
    notes += [_gap_note(problem, group) for group in groups if group.gap > 0]
    return Requests(
        tuple(t for t in targets if t is not None),
        blacks,
        groups,
        _conditions(problem),
        smoothness,
        scale,
        tuple(notes),
    )


def weighs(cell: Cell) -> bool:
    """True if a cell has a request; a cell of weight 0 without an exact request has none."""
    if cell.weight == 0 and not cell.exact:
        return False
    return cell.mode not in (CellMode.IGNORE, CellMode.DISTINCT) and not (
        cell.mode is CellMode.FREE and cell.box is None
    )


def _target(at: CellIndex, cell: Cell, weights: dict[CellIndex, float]) -> Target | None:
    if at not in weights:
        return None
    if cell.mode is CellMode.FIXED:
        assert cell.target is not None
        return Target(at, cell.target, weights[at], cell.exact)
    if cell.mode is CellMode.BLACK:
        return Target(at, np.zeros(3), weights[at], cell.exact)
    return None


def _groups(problem: PaletteProblem, weights: dict[CellIndex, float]) -> tuple[Group, ...]:
    """Cells joined by "same" and "constant", and single free cells that are held in a box.

    One free color for all cells that are joined, except where a soft request would then hold exactly: a soft link
    between two sets of exact cells, or a soft box of a color that exact cells share. There each set of exact cells has
    a color of its own, and the soft requests have another one, from which the exact cells may differ.
    """
    asking = [
        (i, j)
        for i, row in enumerate(problem.cells)
        for j, cell in enumerate(row)
        if (i, j) in weights and (cell.mode in (CellMode.SAME, CellMode.CONSTANT) or cell.box is not None)
    ]
    groups: list[Group] = []
    for joined in _joined(problem, asking):
        exact = [at for at in joined if problem.cells[at[0]][at[1]].exact]
        soft = [at for at in joined if not problem.cells[at[0]][at[1]].exact]
        sets = _joined(problem, exact) if exact and soft else []
        is_apart = len(sets) > 1 or (sets and any(problem.cells[i][j].box is not None for i, j in soft))
        parts = [*sets, *_joined(problem, soft)] if is_apart else [joined]
        groups += [_group(problem, part, weights) for part in parts]
    return tuple(groups)


def _joined(problem: PaletteProblem, asking: Sequence[CellIndex]) -> list[list[CellIndex]]:
    """Cells that ask for a shared color, in sets that share a member, both in the order in which they ask."""
    sets: list[tuple[set[CellIndex], list[CellIndex]]] = []
    for at in asking:
        members, own = {at, *problem.cells[at[0]][at[1]].others}, [at]
        for other in [each for each in sets if each[0] & members]:
            sets.remove(other)
            members, own = other[0] | members, other[1] + own
        sets.append((members, own))
    number = {at: k for k, at in enumerate(asking)}
    return sorted((sorted(own, key=number.__getitem__) for _, own in sets), key=lambda own: number[own[0]])


def _group(problem: PaletteProblem, asking: Sequence[CellIndex], weights: dict[CellIndex, float]) -> Group:
    """The free color that some cells ask for; a member has the largest weight that asks for it."""
    weight: dict[CellIndex, float] = {}
    exact: dict[CellIndex, bool] = {}
    for at in asking:
        cell = problem.cells[at[0]][at[1]]
        for member in (at, *cell.others):
            weight[member] = max(weight.get(member, 0.0), weights[at])
            exact[member] = exact.get(member, False) or cell.exact
    members = tuple(sorted(weight))
    box, gap = _box(problem, asking)
    return Group(
        members,
        tuple(weight[at] for at in members),
        tuple(exact[at] for at in members),
        box,
        gap,
    )


def _box(problem: PaletteProblem, asking: Sequence[CellIndex]) -> tuple[Array, float]:
    """The colors that all asking cells allow, and the gap between boxes that have none in common."""
    low, high = np.full(3, -np.inf), np.full(3, np.inf)
    for i, j in asking:
        box = problem.cells[i][j].box
        if box is not None:
            low, high = np.maximum(low, box[0]), np.minimum(high, box[1])
    apart = low > high
    gap = float(np.max(low - high, where=apart, initial=0.0))
    low[apart] = high[apart] = (low[apart] + high[apart]) / 2
    return np.stack([low, high]), gap


def _gap_note(problem: PaletteProblem, group: Group) -> str:
    boxed = [at for at in group.members if problem.cells[at[0]][at[1]].box is not None]
    names = ", ".join(cell_name(problem, at) for at in boxed)
    return f"the color boxes of {names} have no color in common; the middle between them counts. Widen or remove one"


def _conditions(problem: PaletteProblem) -> tuple[Condition, ...]:
    variants = max(len(light.variants) for light in problem.lights)
    each = [None, *range(variants)]
    return tuple(Condition(observer, variant) for variant in each for observer in range(len(problem.observers)))
