# SPDX-License-Identifier: GPL-3.0-or-later
"""The assembly of one side: cells of a palette → its quadratic, for batch and live solving.

Color is linear in either factor (Eq. 5.8), so reflectances under known lights and lights on known reflectances are
assembled by the same code with the roles swapped. Conditions (observers, variants of lights), the perceptual metric and
primaries change matrices, never the form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.assembled import Assembled, weighted_roughness
from spectral_core.palette.assemble.criteria import REFERENCE_STEP_NM
from spectral_core.palette.assemble.requests import Group, Requests, Target
from spectral_core.palette.assemble.state import PaletteState
from spectral_core.palette.assemble.view import Row, Side, View
from spectral_core.palette.problem import CellIndex, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.palette.qp.block import Block, RowKey
from spectral_core.palette.qp.quadratic import Quadratic
from spectral_core.palette.worst_case import Shares
from spectral_core.spectra.color import XYZ_FROM_RGB, lab_jacobian_from_linear_rgb

Array = NDArray[np.float64]

COLOR_NORM = np.sqrt(3.0)
"""Color rows are divided by √3 (below Eq. 5.13), so that one color counts like one spectrum's smoothness."""
LAB_UNIT = 100.0
"""CIELAB rows are divided by this, so that weights mean about the same as in linear RGB."""


class Assembler:
    """Assembles the sides of one problem, and keeps the parts that do not change between rounds."""

    def __init__(self, problem: PaletteProblem, requests: Requests) -> None:
        self.problem = problem
        self._requests, self._retargeted = requests, False
        self.shares = Shares()
        self._targets = {target.cell: target for target in requests.targets}
        self._blacks = {target.cell for target in requests.blacks}
        self._members: dict[CellIndex, list[tuple[int, int]]] = {}
        """Groups of each cell, and its number in each."""
        for number, group in enumerate(requests.groups):
            for k, cell in enumerate(group.members):
                self._members.setdefault(cell, []).append((number, k))

    def free_items(self, side: Side) -> tuple[int, ...]:
        """Indices of the designed spectra of a side."""
        items: Sequence[PaletteLight | PaletteReflectance] = getattr(self.problem, side)
        return tuple(k for k, item in enumerate(items) if item.free)

    def with_target(self, problem: PaletteProblem, target: Target) -> None:
        """Take a problem in which one cell, in no group before and after, has another target."""
        self.problem = problem
        self._targets[target.cell] = target
        self._retargeted = True

    @property
    def requests(self) -> Requests:
        """The requests of all cells, with the targets as edited: these are gathered when they are read."""
        if self._retargeted:
            self._requests, self._retargeted = replace(self._requests, targets=tuple(self._targets.values())), False
        return self._requests

    def in_group(self, cell: CellIndex) -> bool:
        """True if a cell shares a free color."""
        return cell in self._members

    # -- one side ----------------------------------------------------------------------------------------------------

    def assembled(self, side: Side, state: PaletteState, *, perceptual: bool = False) -> Assembled:
        """The side around ``state``. ``perceptual``: errors in CIELAB, linearized at the wanted colors."""
        items = self.free_items(side)
        metric = self._metrics(state) if perceptual else None
        view = View(self.problem, self.requests, side, state, items, metric)
        columns = self._columns(view)
        limits = [
            self.requests.groups[number].box if condition == 0 else np.stack([np.full(3, -np.inf), np.full(3, np.inf)])
            for number, condition in columns
        ]
        boxes = np.array(limits).reshape(-1, 2, 3).copy()
        known = self._known_rows(view, columns, boxes)
        blocks = tuple(self._block(view, item, columns) for item in items)
        quadratic = Quadratic(blocks, boxes[:, 0], boxes[:, 1], *known)
        return Assembled(side, items, quadratic, tuple(columns), view)

    def reassembled(self, before: Assembled, cell: CellIndex) -> Assembled:
        """The same side after ``with_target`` changed a cell; everything but its three rows is kept.

        For errors in linear RGB: a row then depends on its cell by its color and weight alone.
        """
        target = self._targets[cell]
        number = before.items.index(cell[0] if before.side == "reflectances" else cell[1])
        block = before.quadratic.blocks[number]
        weight, own_weight = self.row_weight(target.weight, target.exact, 0, cell), target.weight**2 / COLOR_NORM**2
        changed = block.with_request(block.keys.index((0, cell)), target.color, weight, own_weight)
        return replace(before, quadratic=before.quadratic.with_block(number, changed))

    def _columns(self, view: View) -> dict[tuple[int, int], int]:
        """(group, condition) → number of its free color, for groups with an unknown member on this side."""
        found: dict[tuple[int, int], int] = {}
        for number, group in enumerate(self.requests.groups):
            for condition in range(len(self.requests.conditions)):
                if self._group_applies(view, group, condition):
                    found[number, condition] = len(found)
        return found

    def _group_applies(self, view: View, group: Group, condition: int) -> bool:
        """True if any member is unknown here, and has another color in this condition than in those listed before."""
        if condition and (len(group.members) < 2 or not any(view.sees(cell, condition) for cell in group.members)):
            return False
        return any(view.is_unknown(cell) for cell in group.members)

    def _rows(self, view: View, cell: CellIndex, columns: dict[tuple[int, int], int]) -> list[Row]:
        """All rows of a cell over its unknown factor."""
        rows = []
        target = self._targets.get(cell)
        if target is not None:
            conditions = [0]
            if cell in self._blacks:
                conditions += [c for c in range(1, len(self.requests.conditions)) if view.sees(cell, c)]
            for condition in conditions:
                weight = self.row_weight(target.weight, target.exact, condition, cell)
                own = target.weight**2 / COLOR_NORM**2
                rows.append(Row(condition, cell, target.color, None, weight, own))
        for number, k in self._members.get(cell, ()):
            group = self.requests.groups[number]
            for condition in range(len(self.requests.conditions)):
                column = columns.get((number, condition))
                if column is not None:
                    weight = self.row_weight(group.weights[k], group.exact[k], condition, cell)
                    own = group.weights[k] ** 2 / COLOR_NORM**2
                    rows.append(Row(condition, cell, None, column, weight, own))
        return rows

    def row_weight(self, weight: float, exact: bool, condition: int, cell: CellIndex) -> float:
        """Squared weight of a cell's rows. An exact cell is exact for the first observer and a soft row for others."""
        if condition == 0:
            return np.inf if exact else weight**2 / COLOR_NORM**2
        factor = self.problem.robust_weight * self.shares.factor((condition, cell))
        return (max(weight, 1e-300) * factor) ** 2 / COLOR_NORM**2

    def _block(self, view: View, item: int, columns: dict[tuple[int, int], int]) -> Block:
        rows = [row for cell in view.cells_of(item) for row in self._rows(view, cell, columns)]
        size = view.size_of(item)
        matrices = np.empty((len(rows), 3, size))
        targets = np.zeros((len(rows), 3))
        ties = np.zeros((len(rows), 3, 3 * len(columns)))
        weights = np.empty(len(rows))
        for r, row in enumerate(rows):
            matrix, color = view.matrix(item, row), row.color
            jacobian = None if view.metric is None or np.isinf(row.weight) else view.metric[row.cell]
            matrices[r] = matrix if jacobian is None else jacobian @ matrix
            if color is not None:
                targets[r] = color if jacobian is None else jacobian @ color
            else:
                assert row.column is not None
                begin = 3 * row.column
                ties[r, :, begin : begin + 3] = np.eye(3) if jacobian is None else jacobian
            weights[r] = row.weight
        keys: tuple[RowKey, ...] = tuple((row.condition, row.cell) for row in rows)
        parts = [(matrices.reshape(-1, size), targets.ravel(), np.repeat(weights, 3))]
        parts += self._subspace_rows(view, item) + self._light_rows(view, item)
        extra = sum(len(part[1]) for part in parts[1:])
        all_ties = np.concatenate([ties.reshape(3 * len(rows), 3 * len(columns)), np.zeros((extra, 3 * len(columns)))])
        no_primaries = not view.has_primaries(item) and self.requests.smoothness > 0
        roughness, gram = self.roughness(view.side) if no_primaries else (np.zeros((0, size)), np.zeros((size, size)))
        bounds = view.limits_of(item)
        joined = parts[0] if len(parts) == 1 else tuple(np.concatenate(each) for each in zip(*parts, strict=True))
        own = np.concatenate([np.repeat([row.own_weight for row in rows], 3), np.ones(extra)])
        return Block(joined[0], joined[1], all_ties, joined[2], roughness, gram, *bounds, keys, own)

    def _known_rows(self, view: View, columns: dict[tuple[int, int], int], boxes: Array) -> tuple[Array, Array, Array]:
        """Members of groups whose color is known already; exact ones fix the group's color in ``boxes``."""
        ties, targets, weights = [], [], []
        for (number, condition), column in columns.items():
            group = self.requests.groups[number]
            for k, cell in enumerate(group.members):
                if view.is_unknown(cell):
                    continue
                color = view.colors(condition)[cell]
                weight = self.row_weight(group.weights[k], group.exact[k], condition, cell)
                if np.isinf(weight):
                    boxes[column] = color
                    continue
                jacobian = np.eye(3) if view.metric is None else view.metric[cell]
                tie = np.zeros((3, 3 * len(columns)))
                tie[:, 3 * column : 3 * column + 3] = jacobian
                ties.append(tie)
                targets.append(-jacobian @ color)
                weights.append(np.full(3, weight))
        if not ties:
            return np.zeros((0, 3 * len(columns))), np.zeros(0), np.zeros(0)
        return np.concatenate(ties), np.concatenate(targets), np.concatenate(weights)

    # -- criteria that do not come from one cell ---------------------------------------------------------------------

    def roughness(self, side: Side) -> tuple[Array, Array]:
        """ω_D D (r, n) of a spectrum of a side that is designed on the grid, and its square (n, n)."""
        unit = REFERENCE_STEP_NM if side == "lights" else 1.0
        return weighted_roughness(self.problem.grid, self.problem.smoothness_operator, unit * self.requests.smoothness)

    def _subspace_rows(self, view: View, item: int) -> list[tuple[Array, Array, Array]]:
        criterion = self.problem.subspace
        if criterion is None or criterion.weight == 0:
            return []
        found = []
        for cell in view.cells_of(item):
            weight = self._targets[cell].weight if cell in self._targets else 0.0
            for number, k in self._members.get(cell, ()):
                weight = max(weight, self.requests.groups[number].weights[k])
            if weight:
                squared = (criterion.weight * weight / COLOR_NORM) ** 2
                found.append((view.subspace_matrix(item, cell), np.zeros(3), np.full(3, squared)))
        return found

    def _light_rows(self, view: View, item: int) -> list[tuple[Array, Array, Array]]:
        """Equalities for a light that must look white, or keep its luminance."""
        if view.side != "lights":
            return []
        light = self.problem.lights[item]
        if light.white_xyz is None and light.luminance is None:
            return []
        xyz = XYZ_FROM_RGB @ view.bare_light(item)
        rows, right = [], []
        if light.white_xyz is not None:
            x, _, z = light.white_xyz / light.white_xyz[1]
            rows += [xyz[0] - x * xyz[1], xyz[2] - z * xyz[1]]
            right += [0.0, 0.0]
        if light.luminance is not None:
            rows.append(xyz[1])
            right.append(light.luminance * view.state.light_scale)
        return [(np.array(rows), np.array(right), np.full(len(rows), np.inf))]

    def _metrics(self, state: PaletteState) -> Array:
        """d(Lab)/d(RGB) per cell (R, L, 3, 3): at its target, or at its present color, limited to its box."""
        at = np.array(state.colors())
        for target in self.requests.targets:
            at[target.cell] = target.color
        for group in self.requests.groups:
            middle = np.clip(np.mean([at[cell] for cell in group.members], axis=0), *group.box)
            for cell in group.members:
                at[cell] = middle
        return lab_jacobian_from_linear_rgb(at) / LAB_UNIT

    # -- residuals ---------------------------------------------------------------------------------------------------

    def color_rms(self, state: PaletteState) -> float:
        """Root mean square error of targets and group members, in linear RGB, for the first observer."""
        actual = state.colors()
        errors = [actual[target.cell] - target.color for target in self.requests.targets]
        for group in self.requests.groups:
            shown = np.stack([actual[cell] for cell in group.members])
            errors.extend(shown - np.clip(shown.mean(axis=0), group.box[0], group.box[1]))
        return float(np.sqrt(np.mean(np.square(errors)))) if errors else 0.0

    def robust_errors(self, state: PaletteState) -> Array | None:
        """Differences within groups, and of black cells from black, in all conditions but the first; None if none."""
        errors: list[Array] = []
        for condition in self.requests.conditions[1:]:
            actual = state.colors(condition)
            errors.extend(actual[target.cell] for target in self.requests.blacks)
            for group in self.requests.groups:
                shown = np.stack([actual[cell] for cell in group.members])
                errors.extend(shown - shown.mean(axis=0))
        return np.array(errors) if errors else None

    def subspace_errors(self, state: PaletteState) -> Array | None:
        """Linear RGB (R, L, 3) by which the subspace misses each cell (Eq. 5.11); None without that criterion."""
        if self.problem.subspace is None:
            return None
        view = View(self.problem, self.requests, "reflectances", state, self.free_items("reflectances"), None)
        knots = self.problem.grid.wavelengths_nm
        surfaces = [
            item.spectrum.at(knots) if values is None and item.spectrum is not None else values
            for item, values in zip(self.problem.reflectances, state.reflectances, strict=True)
        ]
        return np.einsum(
            "lcn,rn->rlc", view.subspace_errors(), np.stack([each for each in surfaces if each is not None])
        )

    def robust_rows(self, assembled: Assembled, colors: Array, state: PaletteState) -> dict[RowKey, float]:
        """Weighted error of every robust row of a side after its solve; ``colors``: its free colors (G, 3)."""
        errors: dict[RowKey, float] = {}
        shown = [state.colors(condition) for condition in self.requests.conditions]
        for (number, condition), common in zip(assembled.group_conditions, colors, strict=True):
            group = self.requests.groups[number]
            for cell, weight in zip(group.members, group.weights, strict=True):
                if condition:
                    errors[condition, cell] = weight * float(np.linalg.norm(shown[condition][cell] - common))
        for condition in range(1, len(self.requests.conditions)):
            for target in self.requests.blacks:
                errors[condition, target.cell] = target.weight * float(np.linalg.norm(shown[condition][target.cell]))
        return errors
