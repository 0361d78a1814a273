# SPDX-License-Identifier: GPL-3.0-or-later
"""A phase as stacked small matrices: the same problem as ``phase`` assembles row by row, in a few matrix products.

Holds for what is usual: designed spectra on the grid, one observer, linear match. Lights from primaries and lights that
must look white need equalities or blocks of other sizes; they go through ``phase``. A test holds the two equal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.criteria import REFERENCE_STEP_NM, second_differences
from spectral_core.palette.assemble.phase import COLOR_NORM, Side
from spectral_core.palette.assemble.wishes import Wishes
from spectral_core.palette.live.state import PaletteState
from spectral_core.palette.problem import PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.palette.qp.least_squares import RIDGE
from spectral_core.palette.qp.tied import TiedProblem
from spectral_core.spectra.spectrum import SpectralGrid

Array = NDArray[np.float64]


EXACT_WEIGHT = 4.0
"""Of an exact cell, relative to the heaviest soft one: heavier converges in fewer steps, lighter rounds off less."""


def is_simple(problem: PaletteProblem, wishes: Wishes) -> bool:
    """Whether a problem can be compiled."""
    lamps = any(light.primaries or light.white_xyz is not None or light.luminance for light in problem.lights)
    plain = len(wishes.conditions) == 1 and problem.subspace is None and problem.match == "linear"
    return plain and not lamps


@dataclass(eq=False)
class WishArrays:
    """Cells as arrays over (reflectance, light): squared weights of targets, target colors, and links to groups."""

    target_weights: Array
    """(R, L): squared, with the color norm."""
    targets: Array
    """(R, L, 3)."""
    link_weights: Array
    """(R, L): squared, with the color norm; 0 where a cell is in no group."""
    group: NDArray[np.intp]
    """(R, L): index of the cell's group, -1 where none."""
    boxes: tuple[Array, Array]
    """Bounds of the free colors, (3 G,) each."""
    exact_targets: NDArray[np.bool_]
    """(R, L): cells whose target, and below, whose link must hold exactly; they weigh EXACT_WEIGHT."""
    exact_links: NDArray[np.bool_]

    @classmethod
    def of(cls, problem: PaletteProblem, wishes: Wishes) -> WishArrays:
        shape = (len(problem.reflectances), len(problem.lights))
        weights, targets, links = np.zeros(shape), np.zeros((*shape, 3)), np.zeros(shape)
        group = np.full(shape, -1, dtype=np.intp)
        exact_targets, exact_links = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
        for target in wishes.targets:
            weights[target.cell] = (EXACT_WEIGHT if target.exact else target.weight) ** 2 / COLOR_NORM**2
            targets[target.cell] = target.color
            exact_targets[target.cell] = target.exact
        for number, members in enumerate(wishes.groups):
            for cell, weight, exact in zip(members.members, members.weights, members.exact, strict=True):
                links[cell] = (EXACT_WEIGHT if exact else weight) ** 2 / COLOR_NORM**2
                group[cell] = number
                exact_links[cell] = exact
        boxes = np.array([members.box for members in wishes.groups]).reshape(-1, 2, 3)
        limits = boxes[:, 0].ravel(), boxes[:, 1].ravel()
        return cls(weights, targets, links, group, limits, exact_targets, exact_links)

    @property
    def any_exact(self) -> bool:
        """Whether any cell must hold exactly."""
        return bool(self.exact_targets.any() or self.exact_links.any())

    def copy(self) -> WishArrays:
        """The same, with targets and their weights free to be changed."""
        return replace(self, target_weights=self.target_weights.copy(), targets=self.targets.copy())

    def same_groups(self, other: WishArrays) -> bool:
        """Whether the same cells share the same free colors."""
        if self.group is other.group:
            return True
        return np.array_equal(self.group, other.group) and np.array_equal(self.boxes, other.boxes)

    def sum_of_squares(self, actual: Array, common: Array) -> float:
        """Weighted color errors of cells (R, L, 3), and of group members to their free colors (G, 3)."""
        soft = np.where(self.exact_targets, 0.0, self.target_weights)[..., None]
        total = float(np.sum(soft * (actual - self.targets) ** 2))
        if len(common):
            apart = np.where(
                (self.group >= 0)[..., None] & ~self.exact_links[..., None], actual - common[self.group], 0.0
            )
            total += float(np.sum(self.link_weights[..., None] * apart**2))
        return total

    def turned(self) -> WishArrays:
        """The same with reflectances and lights swapped."""
        return WishArrays(
            self.target_weights.T,
            self.targets.swapaxes(0, 1),
            self.link_weights.T,
            self.group.T,
            self.boxes,
            self.exact_targets.T,
            self.exact_links.T,
        )


@dataclass(eq=False)
class Known:
    """The known side of a phase, squared once: color matrices (L, 3, n) and their Grams (L, n²)."""

    matrices: Array
    grams: Array
    strengths: Array
    """(L,): largest entry of each matrix; infinite where it is too dim to show a color."""

    @classmethod
    def of(cls, state: PaletteState, side: Side) -> Known:
        at_points = state.lights_at_points() if side == "reflectances" else state.reflectances_at_points()
        matrices = state.kernel.matrices(at_points)[0]
        grams = np.matmul(matrices.transpose(0, 2, 1), matrices)
        dim = np.abs(matrices).sum(axis=2).max(axis=1) < 1e-7
        strengths = np.where(dim, np.inf, np.abs(matrices).max(axis=(1, 2)))
        return cls(matrices, grams.reshape(len(grams), -1), strengths)

    def lightest(self, arrays: WishArrays) -> Array:
        """Per unknown (R,): the least pull of its cells, see ``least_squares.pull_of``."""
        squared = np.minimum(_positive(arrays.target_weights), _positive(arrays.link_weights))
        return (squared * self.strengths).min(axis=1)


def recompiled_row(
    problem: TiedProblem, row: int, item: int, arrays: WishArrays, known: Known, gram: Array
) -> TiedProblem:
    """``problem`` with one reflectance's target or weight changed; its links must be as before."""
    n = problem.linear.shape[1]
    hessians, linear = problem.hessians, problem.linear.copy()
    weights = arrays.target_weights[item] + arrays.link_weights[item]
    hessian = (weights @ known.grams).reshape(n, n) + gram
    ridge = None if problem.ridge is None else problem.ridge.copy()
    if ridge is not None:
        ridge[row] = RIDGE * max(float(np.diagonal(hessian).mean()), 1e-12)
        hessian[np.diag_indices(n)] += ridge[row]
    hessians[row] = hessian
    linear[row] = -(arrays.target_weights[item, :, None] * arrays.targets[item]).ravel() @ known.matrices.reshape(-1, n)
    lightest = _lightest_row(problem, row, item, arrays, known)
    return replace(problem, hessians=hessians, linear=linear, lightest=lightest, ridge=ridge)


def _lightest_row(problem: TiedProblem, row: int, item: int, arrays: WishArrays, known: Known) -> Array | None:
    if problem.lightest is None:
        return None
    lightest = problem.lightest.copy()
    squared = np.minimum(_positive(arrays.target_weights[item]), _positive(arrays.link_weights[item]))
    lightest[row] = (squared * known.strengths).min()
    return lightest


def compiled(
    problem: PaletteProblem, wishes: Wishes, arrays: WishArrays, known: Known, state: PaletteState, side: Side
) -> tuple[tuple[int, ...], TiedProblem]:
    """Items to design on a side, and their problem. Groups without an unknown member here are left out by weight."""
    n = problem.grid.size
    if side == "lights":
        arrays = arrays.turned()
    listed: Sequence[PaletteLight | PaletteReflectance] = getattr(problem, side)
    items = tuple(k for k, item in enumerate(listed) if item.free)
    rows = np.array(items)
    hessians = ((arrays.target_weights + arrays.link_weights)[rows] @ known.grams).reshape(-1, n, n)
    hessians += smoothness_gram(problem, wishes, side)
    index = np.arange(n)
    # Exact cells' heavy rows stay out of it: their ridge would weigh on what the soft ones decide.
    heavy = np.maximum(1.0, (arrays.target_weights + arrays.link_weights)[rows].max(axis=1, keepdims=True))
    trace = hessians[:, index, index].mean(axis=1, keepdims=True) / heavy
    ridge = RIDGE * np.maximum(trace, 1e-12)
    hessians[:, index, index] += ridge
    pulls = (arrays.target_weights[rows, :, None] * arrays.targets[rows]).reshape(len(rows), -1)
    linear = -pulls @ known.matrices.reshape(-1, n)
    bounds = problem.reflectance_bounds if side == "reflectances" else problem.light_bounds
    ties, color_hessian, color_linear = _ties(arrays, known, state, side, rows)
    lightest = known.lightest(arrays)[rows]
    return items, TiedProblem(
        hessians, linear, ties, color_hessian, color_linear, bounds, arrays.boxes, lightest, ridge[:, 0]
    )


def _positive(weights: Array) -> Array:
    """Weights, infinite where there is none."""
    return np.where(weights > 0, weights, np.inf)


def smoothness_gram(problem: PaletteProblem, wishes: Wishes, side: Side) -> Array:
    """ω_D² DᵀD, (n, n), of one spectrum of a side."""
    unit = REFERENCE_STEP_NM if side == "lights" else 1.0
    return _roughness_gram(problem.grid, problem.smoothness_operator, unit * wishes.smoothness)


@lru_cache(maxsize=64)
def _roughness_gram(grid: SpectralGrid, operator: str, weight: float) -> Array:
    rows = weight * second_differences(grid, operator)
    return rows.T @ rows


def _ties(
    arrays: WishArrays, known: Known, state: PaletteState, side: Side, rows: NDArray[np.intp]
) -> tuple[Array, Array, Array]:
    """C, W and w of the free colors; a group that no unknown touches keeps W = 1 and the color of its members."""
    count, n = len(arrays.boxes[0]) // 3, known.matrices.shape[2]
    ties = np.zeros((len(rows), 3 * count, n))
    weight, color = np.zeros(count), np.zeros((count, 3))
    if count == 0:
        return ties, np.zeros((0, 0)), np.zeros(0)
    number_of = {int(item): k for k, item in enumerate(rows)}
    shown = None
    for item, other in zip(*np.nonzero(arrays.group >= 0), strict=True):
        group, squared = int(arrays.group[item, other]), arrays.link_weights[item, other]
        weight[group] += squared
        if item in number_of:
            ties[number_of[item], 3 * group : 3 * group + 3] += squared * known.matrices[other]
        else:
            if shown is None:
                shown = state.colors() if side == "reflectances" else state.colors().swapaxes(0, 1)
            color[group] += squared * shown[item, other]
    weight[weight == 0] = 1.0
    return ties, np.diag(np.repeat(weight, 3)), color.ravel()
