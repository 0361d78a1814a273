# SPDX-License-Identifier: GPL-3.0-or-later
"""One half of a round as bounded least squares: reflectances under known lights, or lights on known reflectances.

Color is linear in either factor (Eq. 5.8), so both halves are built by the same code with the roles swapped.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.color import XYZ_FROM_RGB, lab_jacobian_from_linear_rgb
from spectral_core.palette.criteria import REFERENCE_STEP_NM, second_differences, subspace_errors
from spectral_core.palette.least_squares import Block, Link, LinkedLeastSquares, pull_of
from spectral_core.palette.problem import CellIndex, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.palette.state import PaletteState
from spectral_core.palette.wishes import Condition, Group, Target, Wishes
from spectral_core.palette.worst_case import RowKey, Shares

Array = NDArray[np.float64]
Side = Literal["reflectances", "lights"]

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
        items: Sequence[PaletteLight | PaletteReflectance] = getattr(self.problem, side)
        return tuple(k for k, item in enumerate(items) if item.free)

    def build(self, side: Side, state: PaletteState, *, perceptual: bool = False, soft: bool = False) -> Phase:
        """The phase around ``state``. ``perceptual``: errors in linearized CIELAB; ``soft``: exact cells as rows."""
        view = _View(self, side, state)
        metric = self._metrics(state) if perceptual else None
        rows = {k: _Rows() for k in view.items}
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
        self, view: _View, rows: dict[int, _Rows], target: Target, condition: int, metric: Array | None, *, soft: bool
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
        self, view: _View, metric: Array | None, *, soft: bool
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

    def _group_applies(self, view: _View, group: Group, condition: int) -> bool:
        """Whether any member is unknown here, and looks different in this condition than in another already listed."""
        if condition and (len(group.members) < 2 or not any(view.sees(cell, condition) for cell in group.members)):
            return False
        return any(view.block_of(cell) is not None for cell in group.members)

    def _add_subspace(self, view: _View, rows: dict[int, _Rows]) -> None:
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

    def _block(self, view: _View, item: int, rows: _Rows) -> Block:
        size = view.size_of(item)
        if view.basis_of(item) is None and self.wishes.smoothness > 0:
            unit = REFERENCE_STEP_NM if view.side == "lights" else 1.0
            rows.add(unit * self._roughness, np.zeros(size))
        low, high = self.problem.reflectance_bounds if view.side == "reflectances" else self.problem.light_bounds
        if view.side == "lights":
            self._hold_light(view, item, rows)
        return rows.block(size, low, high)

    def _hold_light(self, view: _View, item: int, rows: _Rows) -> None:
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


class _Rows:
    """Rows of one block while they are gathered."""

    def __init__(self) -> None:
        self.matrices: list[Array] = []
        self.pulls: list[float] = []
        self.targets: list[Array] = []
        self.equal_matrices: list[Array] = []
        self.equal_targets: list[Array] = []

    def add(self, matrix: Array, target: Array, pull: float = np.inf) -> None:
        self.matrices.append(matrix)
        self.targets.append(target)
        self.pulls.append(pull)

    def equal(self, matrix: Array, target: Array) -> None:
        self.equal_matrices.append(matrix)
        self.equal_targets.append(target)

    def block(self, size: int, low: float, high: float) -> Block:
        def stack(matrices: list[Array], targets: list[Array]) -> tuple[Array, Array]:
            return (
                (np.concatenate(matrices), np.concatenate(targets)) if matrices else (np.zeros((0, size)), np.zeros(0))
            )

        soft, hard = stack(self.matrices, self.targets), stack(self.equal_matrices, self.equal_targets)
        return Block(*soft, np.full(size, low), np.full(size, high), *hard, tuple(self.pulls))


class _View:
    """One side as unknown, the other as known: color matrices of cells, whichever way round."""

    def __init__(self, builder: PhaseBuilder, side: Side, state: PaletteState) -> None:
        self.side, self.state = side, state
        self.problem, self.conditions = builder.problem, builder.wishes.conditions
        self.items = builder.free_items(side)
        self._block = {item: k for k, item in enumerate(self.items)}
        self._axis = 0 if side == "reflectances" else 1
        self._matrices: dict[int | None, Array] = {}
        self._colors: dict[int, Array] = {}

    def block_of(self, cell: CellIndex) -> int | None:
        """Block of the cell's unknown factor, None where it is known."""
        return self._block.get(cell[self._axis])

    def known_of(self, cell: CellIndex) -> int:
        """Index of the cell's known factor."""
        return cell[1 - self._axis]

    def sees(self, cell: CellIndex, condition: int) -> bool:
        """Whether a cell looks different under this condition: another observer's, or a variant that its light has."""
        variant = self.conditions[condition].variant
        return variant is None or variant < len(self.problem.lights[cell[1]].variants)

    def basis_of(self, item: int) -> Array | None:
        """Primaries (m, p) of a light, None for a spectrum on the grid."""
        return self.state.light_bases[item] if self.side == "lights" else None

    def size_of(self, item: int) -> int:
        """Number of unknowns of an item."""
        basis = self.basis_of(item)
        return self.problem.grid.size if basis is None else int(basis.shape[1])

    def color_row(self, cell: CellIndex, condition: int) -> tuple[int | None, Array, Array]:
        """Block, matrix (3, p) and offset (3,) with color = matrix @ block + offset."""
        block = self.block_of(cell)
        if block is None:
            if condition not in self._colors:
                self._colors[condition] = self.state.colors(self.conditions[condition])
            return None, np.zeros((3, 0)), self._colors[condition][cell]
        seen = self.conditions[condition]
        basis = self.basis_of(cell[self._axis])
        if basis is not None:
            known = self._known_at_points(seen.variant)[self.known_of(cell)]
            return block, (self.state.kernel.rgb_cmfs[seen.observer] * known) @ basis, np.zeros(3)
        return block, self._matrices_of(seen)[self.known_of(cell)], np.zeros(3)

    def _known_at_points(self, variant: int | None) -> Array:
        if self.side == "lights":
            return self.state.reflectances_at_points()
        return self.state.lights_at_points(variant)

    def _matrices_of(self, seen: Condition) -> Array:
        variant = seen.variant if self.side == "reflectances" else None
        if variant not in self._matrices:
            self._matrices[variant] = self.state.kernel.matrices(self._known_at_points(variant))
        return self._matrices[variant][seen.observer]

    def subspace_errors(self) -> Array:
        """F (k, 3, n) for every known factor."""
        known = self._known_at_points(None)
        knots = self.problem.grid.wavelengths_nm
        on_grid = np.stack([np.interp(knots, self.state.kernel.points_nm, row) for row in known])
        bare = self.state.kernel.matrices(np.ones((1, known.shape[1])))[0, 0]
        return subspace_errors(self.problem, on_grid, self.state.kernel.matrices(known)[0], bare)

    def on_grid(self, block: int, matrix: Array) -> Array:
        """A matrix over grid values as one over the block's unknowns."""
        basis = self.basis_of(self.items[block])
        if basis is None:
            return matrix
        knots, points = self.problem.grid.wavelengths_nm, self.state.kernel.points_nm
        return matrix @ np.stack([np.interp(knots, points, primary) for primary in basis.T], axis=1)

    def bare_light(self, item: int) -> Array:
        """Linear RGB (3, p) of a light by itself, from its unknowns."""
        basis = self.basis_of(item)
        if basis is not None:
            return self.state.kernel.rgb_cmfs[0] @ basis
        return self.state.kernel.matrices(np.ones((1, self.state.kernel.points_nm.size)))[0, 0]
