# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes with fluorescent materials: reflectances with amounts of dyes, and lights, designed in turn.

The cells are those of a ``PaletteProblem``; dyes are given per reflectance. Unknowns of a fluorescent material are its
reflectance S, the amounts a of its dyes and, at every wavelength, the share s of light that it does not return, with S
+ Σ a_k q_k + s = 1 (``share_per_amount``), all of them at least 0: the bound is stated as equalities, which every
engine supports.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.palette.assemble.criteria import second_differences
from spectral_core.palette.assemble.requests import Requests, compiled_requests
from spectral_core.palette.assemble.side import COLOR_NORM
from spectral_core.palette.cell_errors import cell_errors
from spectral_core.palette.paint.fluorescence import (
    FluorescentSurface,
    color_from_light,
    color_from_surface,
)
from spectral_core.palette.problem import CellIndex, PaletteProblem
from spectral_core.palette.qp.block import Block
from spectral_core.palette.qp.engine import Engine
from spectral_core.palette.qp.optimality import PERFECT, Check
from spectral_core.palette.qp.quadratic import Quadratic
from spectral_core.palette.report import EXACT_LIMIT, exact_error
from spectral_core.spectra.fluorescence import FluorescentDye, share_per_amount
from spectral_core.spectra.observer import linear_rgb_from_product
from spectral_core.spectra.spectrum import Illuminant, Reflectance, Spectrum

Array = NDArray[np.float64]
Dyes = Mapping[int, Sequence[FluorescentDye]]
"""Dyes of each reflectance, by its index."""

SETTLED = 1e-3
"""Relative decrease of the sum of squares in a round below which the rounds stop."""


@dataclass(frozen=True, slots=True, eq=False)
class FluorescentSolution:
    """Spectra and errors. ``surfaces`` and ``illuminants`` in the problem's order; cells are (R, L, ...)."""

    problem: PaletteProblem
    surfaces: tuple[FluorescentSurface, ...]
    """Surfaces without dyes have no amounts."""
    illuminants: tuple[Spectrum, ...]
    target_linear_rgb: Array
    actual_linear_rgb: Array
    delta_e_2000: Array
    check: Check
    """The worst check of the last solves of each side."""
    exact_error: float
    """Largest distance of exact cells from their targets, in linear RGB."""
    rounds: int

    @property
    def trusted(self) -> bool:
        """True if the solves passed their checks and every exact cell holds."""
        return self.check.passed and self.exact_error <= EXACT_LIMIT

    @property
    def largest_returned_share(self) -> float:
        """Largest share of photons or power that any surface returns at any knot: at most 1, up to rounding."""
        return max(float(surface.returned_share().max()) for surface in self.surfaces)


def solve_fluorescent(problem: PaletteProblem, dyes: Dyes) -> FluorescentSolution:
    """Reflectances, amounts of dyes, and free lights that meet all cells as well as energy conservation allows.

    Raises InvalidInputError for settings that dyes do not support: several observers, variants of lights,
    lights from primaries, subspaces, "distinct" cells, negative reflectances, and dyes on measured reflectances.
    """
    _require_supported(problem, dyes)
    design = _Design(problem, compiled_requests(problem), dyes)
    checks: dict[str, Check] = {}
    before, rounds = np.inf, 0
    sides = [side for side in ("reflectances", "lights") if any(item.free for item in getattr(problem, side))]
    for number in range(1, problem.rounds + 1):
        rounds, squares = number, 0.0
        for side in sides:
            checks[side], squares = design.half_round(side)
        if len(sides) < 2 or before - squares <= SETTLED * squares:
            break
        before = squares
    return design.solution(_worst(list(checks.values())), rounds)


class _Design:
    """The spectra while they are designed."""

    def __init__(self, problem: PaletteProblem, requests: Requests, dyes: Dyes) -> None:
        self.problem, self.requests = problem, requests
        self.dyes = [tuple(dyes.get(i, ())) for i in range(len(problem.reflectances))]
        self.lights: list[Spectrum] = [light.spectrum for light in problem.lights]
        self._engines = {"reflectances": Engine(), "lights": Engine()}
        gray = np.full(problem.grid.size, 0.5)
        self.surfaces = [
            FluorescentSurface(
                item.name, item.spectrum or Spectrum(item.name, problem.grid, gray), own, np.zeros(len(own))
            )
            for item, own in zip(problem.reflectances, self.dyes, strict=True)
        ]

    def half_round(self, side: str) -> tuple[Check, float]:
        """Solve one side; its check and sum of squares."""
        items = [k for k, item in enumerate(getattr(self.problem, side)) if item.free]
        linked = self._assembled(side, items)
        answer = self._engines[side].solve(linked)
        for item, values in zip(items, answer.values, strict=True):
            if side == "lights":
                self.lights[item] = self._light(item, values)
            else:
                self.surfaces[item] = self._surface(item, values)
        return answer.check, 2 * linked.objective(linked.joined(answer.colors, answer.values))

    def colors(self) -> Array:
        """Linear RGB (R, L, 3)."""
        return np.array([[surface.linear_rgb(light) for light in self.lights] for surface in self.surfaces])

    def solution(self, check: Check, rounds: int) -> FluorescentSolution:
        """The present spectra."""
        actual = self.colors()
        errors = cell_errors(self.problem, self.requests, [actual])
        return FluorescentSolution(
            self.problem,
            tuple(self.surfaces),
            tuple(self.lights),
            errors.target_linear_rgb,
            actual,
            errors.delta_e_2000,
            check,
            exact_error(self.requests, actual)[0],
            rounds,
        )

    def _light(self, item: int, values: Array) -> Spectrum:
        kind = Illuminant if values.min() >= 0 else Spectrum
        return kind(self.problem.lights[item].name, self.problem.grid, values, source="designed")

    def _surface(self, item: int, values: Array) -> FluorescentSurface:
        n, count = self.problem.grid.size, len(self.dyes[item])
        name = self.problem.reflectances[item].name
        reflectance = Reflectance(name, self.problem.grid, values[:n], source="designed")
        return FluorescentSurface(name, reflectance, self.dyes[item], values[n : n + count])

    def _assembled(self, side: str, items: list[int]) -> Quadratic:
        """All requests as rows over the unknowns of one side."""
        axis = 0 if side == "reflectances" else 1
        groups = [g for g in self.requests.groups if any(cell[axis] in items for cell in g.members)]
        boxes = np.array([group.box for group in groups]).reshape(-1, 2, 3).copy()
        shown = self.colors()
        rows: dict[int, list[tuple[Array, Array, Array, float]]] = {item: [] for item in items}
        known: list[tuple[Array, Array, float]] = []
        for target in self.requests.targets:
            if target.cell[axis] in rows:
                weight = np.inf if target.exact else target.weight**2 / COLOR_NORM**2
                matrix = self._color_matrix(side, target.cell)
                rows[target.cell[axis]].append((matrix, target.color, np.zeros((3, 3 * len(groups))), weight))
        for number, group in enumerate(groups):
            tie = np.zeros((3, 3 * len(groups)))
            tie[:, 3 * number : 3 * number + 3] = np.eye(3)
            for cell, weight, exact in zip(group.members, group.weights, group.exact, strict=True):
                squared = np.inf if exact else weight**2 / COLOR_NORM**2
                if cell[axis] in rows:
                    rows[cell[axis]].append((self._color_matrix(side, cell), np.zeros(3), tie, squared))
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

    def _color_matrix(self, side: str, cell: CellIndex) -> Array:
        i, j = cell
        if side == "lights":
            return color_from_light(self.surfaces[i], self.problem.grid)
        if not self.dyes[i]:
            return linear_rgb_from_product(self.lights[j], self.problem.grid)
        return color_from_surface(self.lights[j], self.dyes[i], self.problem.grid)

    def _block(self, side: str, item: int, rows: list[tuple[Array, Array, Array, float]], colors: int) -> Block:
        """Unknowns, bounds, smoothness, energy and color rows of one spectrum."""
        grid = self.problem.grid
        n, count = grid.size, 0 if side == "lights" else len(self.dyes[item])
        size = n + count + (n if count else 0)
        rough = np.zeros((n, size))
        rough[:, :n] = self.requests.smoothness * second_differences(grid, self.problem.smoothness_operator)
        low, high = self.problem.light_bounds if side == "lights" else self.problem.reflectance_bounds
        lower, upper = np.zeros(size), np.full(size, np.inf)
        lower[:n], upper[:n] = low, high
        energy = np.zeros((0, size))
        if count:
            upper[n + count :] = 1.0
            energy = np.concatenate(
                [np.eye(n), share_per_amount(self.dyes[item], grid.wavelengths_nm), np.eye(n)], axis=1
            )
        return Block(
            np.concatenate([*(np.pad(m, ((0, 0), (0, size - m.shape[1]))) for m, *_ in rows), energy]),
            np.concatenate([*(target for _, target, _, _ in rows), np.ones(len(energy))]),
            np.concatenate([*(tie for _, _, tie, _ in rows), np.zeros((len(energy), colors))]),
            np.concatenate([*(np.full(3, weight) for *_, weight in rows), np.full(len(energy), np.inf)]),
            rough,
            rough.T @ rough,
            lower,
            upper,
            tuple((0, (item, r)) for r in range(len(rows))),
        )


def _worst(checks: list[Check]) -> Check:
    worst = PERFECT
    for check in checks:
        worst = worst | check
    return worst


def _require_supported(problem: PaletteProblem, dyes: Dyes) -> None:
    refused: dict[str, Any] = {
        "several observers": len(problem.observers) > 1,
        "variants of lights": any(light.variants for light in problem.lights),
        "lights from primaries, or held to a white or a luminance": any(
            light.primaries or light.white_xyz is not None or light.luminance is not None for light in problem.lights
        ),
        "a subspace criterion": problem.subspace is not None,
        "lights that are scaled": problem.scale_lights,
        "perceptual matching": problem.match != "linear",
        "'distinct' cells": any(cell.mode == "distinct" for row in problem.cells for cell in row),
        "negative reflectances": problem.reflectance_bounds[0] < 0 or problem.reflectance_bounds[1] > 1,
    }
    found = [name for name, present in refused.items() if present]
    if found:
        raise InvalidInputError(f"a palette with fluorescence has {', '.join(found)}; it is designed without them")
    for item in dyes:
        if not 0 <= item < len(problem.reflectances):
            raise InvalidInputError(f"dyes for reflectance {item}; expected 0 to {len(problem.reflectances) - 1}")
        if not problem.reflectances[item].free:
            raise InvalidInputError(
                f"reflectance {problem.reflectances[item].name!r} is measured, so no dye can be designed into it; free "
                "it"
            )
