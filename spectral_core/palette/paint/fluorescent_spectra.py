# SPDX-License-Identifier: GPL-3.0-or-later
"""The spectra of a fluorescent palette while they are designed, and the least squares of each side.

Unknowns of a fluorescent material are its reflectance S, the amounts a of its dyes and, at every wavelength, the share
s of light that it does not return, with S + Σ a_k q_k + s = 1 (``share_between_knots``), all of them at least 0: the
bound is stated as equalities, which every engine supports.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.assembled import weighted_roughness
from spectral_core.palette.assemble.criteria import REFERENCE_STEP_NM
from spectral_core.palette.assemble.requests import Requests
from spectral_core.palette.assemble.side import COLOR_NORM
from spectral_core.palette.assemble.view import Side
from spectral_core.palette.design.decided import Decision, decided
from spectral_core.palette.design.orthogonal import refined
from spectral_core.palette.design.rounds import is_nothing
from spectral_core.palette.paint.fluorescence import FluorescentSurface
from spectral_core.palette.paint.fluorescent_colors import FluorescentColors
from spectral_core.palette.problem import CellIndex, PaletteProblem
from spectral_core.palette.qp.answer import PERFECT, Answer, Check
from spectral_core.palette.qp.block import Block
from spectral_core.palette.qp.engine import Engine
from spectral_core.palette.qp.quadratic import Quadratic
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.spectrum import Illuminant, Reflectance, Spectrum

Array = NDArray[np.float64]
Rows = list[tuple[CellIndex, Array, Array, Array, float]]
"""Matrix, target, ties to the free colors, and squared weight of each cell of a spectrum."""


class FluorescentSpectra:
    """The spectra while they are designed: values of the free ones, None for those that are given."""

    def __init__(self, problem: PaletteProblem, requests: Requests, dyes: Sequence[tuple[FluorescentDye, ...]]) -> None:
        self.problem, self.requests, self.dyes = problem, requests, dyes
        self.matrices = FluorescentColors(problem, dyes)
        n = problem.grid.size
        self.lights = [light.spectrum.values if light.free else None for light in problem.lights]
        """(n,) each."""
        gray = np.full(n, np.clip(0.5, *problem.reflectance_bounds))
        self.surfaces = [
            np.concatenate([gray, np.zeros(len(own))]) if item.free else None
            for item, own in zip(problem.reflectances, dyes, strict=True)
        ]
        """(n + k,) each: reflectance, and amounts of dyes."""
        self._engines: dict[Side, Engine] = {"reflectances": Engine(), "lights": Engine()}
        self._decided: dict[Side, Decision] = {}
        self._roughness: dict[Side, tuple[Array, Array]] = {
            "reflectances": weighted_roughness(problem.grid, problem.smoothness_operator, requests.smoothness),
            "lights": weighted_roughness(
                problem.grid, problem.smoothness_operator, REFERENCE_STEP_NM * requests.smoothness
            ),
        }

    def free_items(self, side: Side) -> list[int]:
        """Indices of the designed spectra of a side."""
        return [k for k, item in enumerate(getattr(self.problem, side)) if item.free]

    def start_from(self, lights: Sequence[Spectrum]) -> None:
        """Take the designed lights of an earlier solution. Raises GridMismatchError if they are on another grid."""
        for item in self.free_items("lights"):
            lights[item].require_grid(self.problem.grid)
            self.lights[item] = lights[item].values

    def half_round(self, side: Side, *, thorough: bool = False) -> tuple[float, float]:
        """Solve one side: by how much its sum of squares fell, and its new value. ``thorough``: with its last digits,
        which hold the smoothness where all colors are met.
        """
        quadratic = self.assembled(side)
        answer = self._answered(side, quadratic)
        answer = refined(quadratic, answer) if thorough else answer
        gained = _gain(quadratic, self._values(side), answer)
        for item, values in zip(self.free_items(side), answer.values, strict=True):
            if side == "lights":
                self.lights[item] = values
            else:
                self.surfaces[item] = values[: self.problem.grid.size + len(self.dyes[item])]
        return gained

    def checked(self, sides: Sequence[Side]) -> tuple[Check, bool]:
        """Solve each side without taking the answers: the worst check, and True if neither side can be improved."""
        worst, settled = PERFECT, True
        for side in sides:
            quadratic = self.assembled(side)
            answer = self._answered(side, quadratic)
            worst = worst | answer.check
            settled = settled and is_nothing(*_gain(quadratic, self._values(side), answer))
        return worst, settled

    def _answered(self, side: Side, quadratic: Quadratic) -> Answer:
        """The engine's answer; a linear program decides about exact cells that the engine leaves open."""
        answer = self._engines[side].solve(quadratic)
        decision = self._decided[side] = decided(quadratic, answer, self._decided.get(side))
        return decision.answer

    def colors(self) -> Array:
        """Linear RGB (R, L, 3)."""
        return np.array(
            [
                [self.matrices.color(i, j, light, surface) for j, light in enumerate(self.lights)]
                for i, surface in enumerate(self.surfaces)
            ]
        )

    def color_matrix(self, side: Side, cell: CellIndex) -> Array:
        """(3, p) with color = matrix @ unknowns of the cell's spectrum on a side."""
        i, j = cell
        if side == "lights":
            return self.matrices.by_light(i, self.surfaces[i])
        return self.matrices.by_surface(i, j, self.lights[j])

    def roughness(self, side: Side) -> tuple[Array, Array]:
        """Roughness (n, n) of a spectrum of a side, weighted, and its square."""
        return self._roughness[side]

    def light_spectra(self) -> tuple[Spectrum, ...]:
        """All lights."""
        found: list[Spectrum] = []
        for light, values in zip(self.problem.lights, self.lights, strict=True):
            if values is None:
                found.append(light.spectrum)
                continue
            kind = Illuminant if values.min() >= 0 else Spectrum
            found.append(kind(light.name, self.problem.grid, values, source="designed"))
        return tuple(found)

    def surface_spectra(self) -> tuple[FluorescentSurface, ...]:
        """All surfaces, with their dyes."""
        found, n = [], self.problem.grid.size
        for item, values, own in zip(self.problem.reflectances, self.surfaces, self.dyes, strict=True):
            if item.spectrum is not None:
                found.append(FluorescentSurface(item.name, item.spectrum, own, np.zeros(len(own))))
                continue
            assert values is not None
            reflectance = Reflectance(item.name, self.problem.grid, values[:n], source="designed")
            found.append(FluorescentSurface(item.name, reflectance, own, values[n:]))
        return tuple(found)

    def _values(self, side: Side) -> list[Array]:
        """The present unknowns of a side."""
        held = self.lights if side == "lights" else self.surfaces
        found, n = [], self.problem.grid.size
        for item in self.free_items(side):
            values = held[item]
            assert values is not None
            if side == "reflectances" and self.dyes[item]:
                values = np.concatenate([values, 1.0 - values[:n] - self.matrices.shares[item] @ values[n:]])
            found.append(values)
        return found

    def assembled(self, side: Side) -> Quadratic:
        """All requests as rows over the unknowns of one side."""
        axis, items = 0 if side == "reflectances" else 1, self.free_items(side)
        groups = [g for g in self.requests.groups if any(cell[axis] in items for cell in g.members)]
        boxes = np.array([group.box for group in groups]).reshape(-1, 2, 3).copy()
        shown = self.colors()
        rows: dict[int, Rows] = {item: [] for item in items}
        known: list[tuple[Array, Array, float]] = []
        for target in self.requests.targets:
            if target.cell[axis] in rows:
                weight = np.inf if target.exact else target.weight**2 / COLOR_NORM**2
                matrix = self.color_matrix(side, target.cell)
                tie = np.zeros((3, 3 * len(groups)))
                rows[target.cell[axis]].append((target.cell, matrix, target.color, tie, weight))
        for number, group in enumerate(groups):
            tie = np.zeros((3, 3 * len(groups)))
            tie[:, 3 * number : 3 * number + 3] = np.eye(3)
            for cell, weight, exact in zip(group.members, group.weights, group.exact, strict=True):
                squared = np.inf if exact else weight**2 / COLOR_NORM**2
                if cell[axis] in rows:
                    rows[cell[axis]].append((cell, self.color_matrix(side, cell), np.zeros(3), tie, squared))
                elif exact:
                    boxes[number] = shown[cell]
                else:
                    known.append((tie, -shown[cell], squared))
        blocks = tuple(self._block(side, item, rows[item], 3 * len(groups)) for item in items)
        return Quadratic(
            blocks,
            boxes[:, 0],
            boxes[:, 1],
            np.concatenate([np.zeros((0, 3 * len(groups))), *(tie for tie, _, _ in known)]),
            np.concatenate([np.zeros(0), *(target for _, target, _ in known)]),
            np.concatenate([np.zeros(0), *(np.full(3, weight) for *_, weight in known)]),
        )

    def _block(self, side: Side, item: int, rows: Rows, colors: int) -> Block:
        """Unknowns, bounds, smoothness, energy and color rows of one spectrum."""
        n, count = self.problem.grid.size, 0 if side == "lights" else len(self.dyes[item])
        size = n + count + (n if count else 0)
        rough = np.zeros((n, size))
        rough[:, :n] = self.roughness(side)[0]
        low, high = self.problem.light_bounds if side == "lights" else self.problem.reflectance_bounds
        lower, upper = np.zeros(size), np.full(size, np.inf)
        lower[:n], upper[:n] = low, high
        energy = np.zeros((0, size))
        if count:
            upper[n + count :] = 1.0
            energy = np.concatenate([np.eye(n), self.matrices.shares[item], np.eye(n)], axis=1)
        return Block(
            np.concatenate([*(np.pad(m, ((0, 0), (0, size - m.shape[1]))) for _, m, *_ in rows), energy]),
            np.concatenate([*(target for _, _, target, *_ in rows), np.ones(len(energy))]),
            np.concatenate([*(tie for *_, tie, _ in rows), np.zeros((len(energy), colors))]),
            np.concatenate([*(np.full(3, weight) for *_, weight in rows), np.full(len(energy), np.inf)]),
            rough,
            rough.T @ rough,
            lower,
            upper,
            tuple((0, cell) for cell, *_ in rows),
        )


def _gain(quadratic: Quadratic, present: list[Array], answer: Answer) -> tuple[float, float]:
    """Decrease of the sum of squares from the present unknowns to an answer, and its value there."""
    here, least = (quadratic.objective(quadratic.joined(quadratic.best_colors(v), v)) for v in (present, answer.values))
    return max(0.0, here - least), least
