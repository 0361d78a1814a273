# SPDX-License-Identifier: GPL-3.0-or-later
"""One half of a round as bounded least squares: reflectances under known lights, or lights on known reflectances.

Color is linear in either factor (Eq. 5.8), so both halves are built by the same code with the roles swapped.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.criteria import REFERENCE_STEP_NM, second_differences
from spectral_core.palette.assemble.phase_view import Rows, Side, View, free_items
from spectral_core.palette.assemble.wishes import Group, Target, Wishes
from spectral_core.palette.live.state import PaletteState
from spectral_core.palette.problem import CellIndex, PaletteProblem
from spectral_core.palette.qp.least_squares import Block, Link, LinkedLeastSquares, pull_of
from spectral_core.palette.worst_case import RowKey, Shares
from spectral_core.spectra.color import XYZ_FROM_RGB, lab_jacobian_from_linear_rgb

Array = NDArray[np.float64]

COLOR_NORM = np.sqrt(3.0)
"""Color rows are divided by √3 (below Eq. 5.13), so that one color counts like one spectrum's smoothness."""
LAB_UNIT = 100.0
"""CIELAB rows are divided by this, so that weights mean about the same as in linear RGB."""


@dataclass(frozen=True, eq=False)
class Phase:
    """The assembled problem, and which item of the side each block is."""

    side: Side
    items: tuple[int, ...]
    problem: LinkedLeastSquares
    group_conditions: tuple[tuple[int, int], ...]
    """(group, condition) of each free color."""


class PhaseBuilder:
    """Assembles phases of one problem; holds what does not change between rounds."""

    def __init__(self, problem: PaletteProblem, wishes: Wishes) -> None:
        self.problem = problem
        self.wishes = wishes
        self.shares = Shares()
        self.last_colors: dict[Side, Array] = {}
        """Free colors of the last answer of a side: where the next solve starts."""
        self._roughness = wishes.smoothness * second_differences(problem.grid, problem.smoothness_operator)

    def free_items(self, side: Side) -> tuple[int, ...]:
        """Indices of what is to be designed on a side."""
        return free_items(self.problem, side)

    def build(self, side: Side, state: PaletteState, *, perceptual: bool = False, soft: bool = False) -> Phase:
        """The phase around ``state``. ``perceptual``: errors in linearized CIELAB; ``soft``: exact cells as rows."""
        view = View(self.problem, self.wishes.conditions, side, state)
        metric = self._metrics(state) if perceptual else None
        rows = {k: Rows() for k in view.items}
        for target in self.wishes.targets:
            self._add_target(view, rows, target, 0, metric, soft=soft)
        for number in range(1, len(self.wishes.conditions)):
            for target in self.wishes.blacks:
                if view.sees(target.cell, number):
                    self._add_target(view, rows, target, number, metric, soft=soft)
        links, boxes, keys = self._links(view, metric, soft=soft)
        self._add_subspace(view, rows)
        blocks = tuple(self._block(view, k, rows[k]) for k in view.items)
        limits = np.array(boxes).reshape(-1, 2, 3)
        linked = LinkedLeastSquares(blocks, tuple(links), limits[:, 0], limits[:, 1])
        return Phase(side, view.items, linked, tuple(keys))

    def color_rms(self, state: PaletteState) -> float:
        """Root mean square error of targets and group members, in linear RGB, for the first observer."""
        actual = state.colors()
        errors = [actual[target.cell] - target.color for target in self.wishes.targets if target.weight > 0]
        for group in self.wishes.groups:
            shown = np.stack([actual[cell] for cell in group.members])
            errors.extend(shown - np.clip(shown.mean(axis=0), group.box[0], group.box[1]))
        return float(np.sqrt(np.mean(np.square(errors)))) if errors else 0.0

    def robust_errors(self, state: PaletteState) -> Array | None:
        """Differences within groups, and of black cells from black, in all conditions but the first; None if none."""
        errors: list[Array] = []
        for condition in self.wishes.conditions[1:]:
            actual = state.colors(condition)
            errors.extend(actual[target.cell] for target in self.wishes.blacks)
            for group in self.wishes.groups:
                shown = np.stack([actual[cell] for cell in group.members])
                errors.extend(shown - shown.mean(axis=0))
        return np.array(errors) if errors else None

    def subspace_errors(self, state: PaletteState) -> Array | None:
        """Linear RGB (R, L, 3) by which the subspace misses each cell (Eq. 5.11); None where it is not asked."""
        if self.problem.subspace is None:
            return None
        errors = View(self.problem, self.wishes.conditions, "reflectances", state).subspace_errors()
        knots, points = self.problem.grid.wavelengths_nm, state.kernel.points_nm
        surfaces = np.stack([np.interp(knots, points, row) for row in state.reflectances_at_points()])
        return np.einsum("lcn,rn->rlc", errors, surfaces)

    def _metrics(self, state: PaletteState) -> Array:
        """d(Lab)/d(RGB) per cell (R, L, 3, 3): at its target, or at its present color."""
        at = np.array(state.colors())
        for target in self.wishes.targets:
            at[target.cell] = target.color
        for group in self.wishes.groups:
            middle = np.mean([at[cell] for cell in group.members], axis=0)
            for cell in group.members:
                at[cell] = middle
        return lab_jacobian_from_linear_rgb(at) / LAB_UNIT

    def _add_target(
        self, view: View, rows: dict[int, Rows], target: Target, condition: int, metric: Array | None, *, soft: bool
    ) -> None:
        block, matrix, offset = view.color_row(target.cell, condition)
        if block is None:
            return
        if target.exact and not soft:
            rows[view.items[block]].equal(matrix, target.color - offset)
            return
        weight = target.weight / COLOR_NORM * self._robust_factor(condition, target.cell)
        weighing = weight * (np.eye(3) if metric is None else metric[target.cell])
        rows[view.items[block]].add(weighing @ matrix, weighing @ (target.color - offset), pull_of(weight, matrix))

    def _robust_factor(self, condition: int, cell: CellIndex) -> float:
        return self.problem.robust_weight * self.shares.factor((condition, cell)) if condition else 1.0

    def robust_rows(self, phase: Phase, colors: Array, state: PaletteState) -> dict[RowKey, float]:
        """Weighted error of every robust row of a phase that was just solved; ``colors``: its free colors (G, 3)."""
        errors: dict[RowKey, float] = {}
        shown = [state.colors(condition) for condition in self.wishes.conditions]
        for (number, condition), common in zip(phase.group_conditions, colors, strict=True):
            group = self.wishes.groups[number]
            for cell, weight in zip(group.members, group.weights, strict=True):
                if condition:
                    errors[condition, cell] = weight * float(np.linalg.norm(shown[condition][cell] - common))
        for condition in range(1, len(self.wishes.conditions)):
            for target in self.wishes.blacks:
                errors[condition, target.cell] = target.weight * float(np.linalg.norm(shown[condition][target.cell]))
        return errors

    def _links(
        self, view: View, metric: Array | None, *, soft: bool
    ) -> tuple[list[Link], list[Array], list[tuple[int, int]]]:
        links: list[Link] = []
        boxes: list[Array] = []
        keys: list[tuple[int, int]] = []
        for number, group in enumerate(self.wishes.groups):
            for condition in range(len(self.wishes.conditions)):
                if not self._group_applies(view, group, condition):
                    continue
                for cell, weight, exact in zip(group.members, group.weights, group.exact, strict=True):
                    block, matrix, offset = view.color_row(cell, condition)
                    factor = weight / COLOR_NORM * self._robust_factor(condition, cell)
                    jacobian = np.eye(3) if metric is None else metric[cell]
                    hold = exact and not soft and condition == 0
                    links.append(Link(block, len(boxes), matrix, offset, factor, hold, jacobian))
                boxes.append(group.box if condition == 0 else np.stack([np.full(3, -np.inf), np.full(3, np.inf)]))
                keys.append((number, condition))
        return links, boxes, keys

    def _group_applies(self, view: View, group: Group, condition: int) -> bool:
        """Whether any member is unknown here, and looks different in this condition than in another already listed."""
        if condition and (len(group.members) < 2 or not any(view.sees(cell, condition) for cell in group.members)):
            return False
        return any(view.block_of(cell) is not None for cell in group.members)

    def _add_subspace(self, view: View, rows: dict[int, Rows]) -> None:
        criterion = self.problem.subspace
        if criterion is None or criterion.weight == 0:
            return
        errors = view.subspace_errors()
        weights = {t.cell: t.weight for t in self.wishes.targets}
        for group in self.wishes.groups:
            for cell, weight in zip(group.members, group.weights, strict=True):
                weights[cell] = max(weight, weights.get(cell, 0.0))
        for cell, weight in weights.items():
            block = view.block_of(cell)
            if block is not None:
                matrix = criterion.weight * weight / COLOR_NORM * errors[view.known_of(cell)]
                rows[view.items[block]].add(view.on_grid(block, matrix), np.zeros(3))

    def _block(self, view: View, item: int, rows: Rows) -> Block:
        size = view.size_of(item)
        if view.basis_of(item) is None and self.wishes.smoothness > 0:
            unit = REFERENCE_STEP_NM if view.side == "lights" else 1.0
            rows.add(unit * self._roughness, np.zeros(size))
        low, high = self.problem.reflectance_bounds if view.side == "reflectances" else self.problem.light_bounds
        if view.side == "lights":
            self._hold_light(view, item, rows)
        return rows.block(size, low, high)

    def _hold_light(self, view: View, item: int, rows: Rows) -> None:
        """Equalities for a light that must look white, or keep its luminance."""
        light = self.problem.lights[item]
        if light.white_xyz is None and light.luminance is None:
            return
        xyz = XYZ_FROM_RGB @ view.bare_light(item)
        if light.white_xyz is not None:
            x, y, z = light.white_xyz / light.white_xyz[1]
            rows.equal(np.stack([xyz[0] - x * xyz[1], xyz[2] - z * xyz[1]]), np.zeros(2))
            assert y == 1.0
        if light.luminance is not None:
            rows.equal(xyz[1:2], np.array([light.luminance * view.state.light_scale]))
