# SPDX-License-Identifier: GPL-3.0-or-later
"""From one picture to spectra, with constraints: "this red looks brown under that lamp".

A lattice of 13 x 13 x 13 colors in linear RGB holds the smoothest reflectances that have these colors under the first
light. The shares of a quadratic B-spline between them are never negative and reproduce every affine function. So all
colors stay exact under the first light, all reflectances stay within [0, 1], and nothing has a kink. A constraint moves
the lattice's colors under a second light along a smooth bump in color space, so that far colors keep theirs.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, require_range
from spectral_core.errors import InvalidInputError, SolveError
from spectral_core.palette.texture.reach import TEXTURE_GRID, stimulus_matrix
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.spectrum import Illuminant

Array = NDArray[np.float64]
NODES = 13
WIDTH = 0.12
"""Standard deviation, in linear RGB, of the region that a constraint moves."""
PULL = 300.0
"""Weight of the wanted color under the second light against smoothness."""
CORRECTIONS = 6
_KNOTS: Array = np.concatenate([[0.0, 0.0], np.arange(NODES - 1), [NODES - 2.0, NODES - 2.0]])
"""Knots of the quadratic B-spline, in spans; the ends are threefold, so that the spline reaches the cube's faces."""


@dataclass(frozen=True, slots=True, eq=False)
class Pin:
    """``color``: linear RGB (3,) under the first light that shall look like ``wanted`` (3,) under the second."""

    color: Array
    wanted: Array

    def __post_init__(self) -> None:
        for name in ("color", "wanted"):
            value = frozen_array(f"a pin's {name}", getattr(self, name), (3,))
            if value.min() < 0 or value.max() > 1:
                raise InvalidInputError(f"a pin's {name} is {value.tolist()}; expected linear RGB from 0 to 1")
            object.__setattr__(self, name, value)


@dataclass(frozen=True, slots=True, eq=False)
class PinResult:
    """What a pin reached: ``color`` (3,) under the second light, ΔE2000 to the wanted one, and to the nearest possible.

    ``reachable``: whether any reflectance has both colors; ``nearest``: the reachable color nearest along the way from
    the plain color to the wanted one.
    """

    color: Array
    delta_e: float
    reachable: bool
    nearest: Array
    delta_e_nearest: float


@dataclass(frozen=True, slots=True, eq=False)
class Uplift:
    """Lattice of reflectances: ``reflectances`` (13, 13, 13, n) over linear RGB from 0 to 1, on ``TEXTURE_GRID``."""

    reflectances: NDArray[np.float32]
    lights: tuple[Illuminant, ...]
    pins: tuple[PinResult, ...]
    seconds: float

    def spectra(self, linear_rgb: ArrayLike) -> Array:
        """Reflectances (m, n) of colors (m, 3), by the quadratic B-spline of the lattice.

        Raises InvalidInputError for colors outside [0, 1].
        """
        colors = np.atleast_2d(np.asarray(linear_rgb, dtype=np.float64))
        if colors.size and not (colors.min() >= 0 and colors.max() <= 1):
            raise InvalidInputError(
                f"colors span {colors.min():g} to {colors.max():g}; a reflectance has linear RGB from 0 to 1"
            )
        corners, shares = _cell(colors)
        flat = self.reflectances.reshape(-1, TEXTURE_GRID.size)
        return np.asarray(np.einsum("mk,mkn->mn", shares, flat[corners]))


def design_uplift(first: Illuminant, second: Illuminant | None = None, pins: Sequence[Pin] = ()) -> Uplift:
    """Build the lattice of the smoothest reflectances for colors under ``first``, with pins under ``second``.

    Parameters
    ----------
    first : light under which every color is exact.
    second : light of the pins; needed where there are any.
    pins : constraints; two pins closer than half a lattice cell are refused.

    Raises
    ------
    InvalidInputError : pins without a second light, or contradicting pins. SolveError : the solver fails at a node.
    """
    started = time.perf_counter()
    if pins and second is None:
        raise InvalidInputError(f"{len(pins)} pins without a second light; name the light under which they hold")
    _require_apart(pins)
    nodes = _LatticeSolver(first, second)
    plain = nodes.solve(None)
    results: tuple[PinResult, ...] = ()
    lattice = plain
    if pins and nodes.second is not None:
        lattice, results = _pinned(nodes, plain, pins)
    lights = (first,) if second is None else (first, second)
    shaped = lattice.reshape(NODES, NODES, NODES, -1).astype(np.float32)
    return Uplift(frozen_array("uplift", shaped, dtype=np.float32), lights, results, time.perf_counter() - started)


def _require_apart(pins: Sequence[Pin]) -> None:
    for number, pin in enumerate(pins):
        for other in pins[:number]:
            if np.abs(pin.color - other.color).max() < 0.5 / (NODES - 1) and not np.allclose(pin.wanted, other.wanted):
                raise InvalidInputError(
                    f"two pins at almost the same color {pin.color.round(3).tolist()} want different colors; keep one"
                )


def _axis() -> Array:
    """Positions (13,) of the nodes on one axis: the Greville abscissae of the quadratic B-spline with clamped ends."""
    return (_KNOTS[1 : NODES + 1] + _KNOTS[2 : NODES + 2]) / 2 / (NODES - 2)


def _along(values: Array) -> tuple[NDArray[np.intp], Array]:
    """First node (m,) and the three shares (3, m) of the quadratic B-spline at ``values`` from 0 to 1 (de Boor)."""
    position = values * (NODES - 2)
    first = np.minimum(position.astype(np.intp), NODES - 3)
    before, start, end, after = (_KNOTS[first + k] for k in (1, 2, 3, 4))
    falling = (end - position) / (end - before)
    rising = (position - start) / (after - start)
    return first, np.stack(
        [
            (end - position) * falling,
            (position - before) * falling + (after - position) * rising,
            (position - start) * rising,
        ]
    )


def _cell(colors: Array) -> tuple[NDArray[np.intp], Array]:
    """Lattice nodes (m, 27) around colors (m, 3) and their shares (m, 27), which are never negative and sum to 1."""
    firsts, shares = zip(*(_along(colors[:, axis]) for axis in range(3)), strict=True)
    corners, products = [], []
    for i, j, k in np.ndindex(3, 3, 3):
        corners.append(((firsts[0] + i) * NODES + firsts[1] + j) * NODES + firsts[2] + k)
        products.append(shares[0][i] * shares[1][j] * shares[2][k])
    return np.stack(corners, axis=1), np.stack(products, axis=1)


class _LatticeSolver:
    """One small quadratic program per node, all with the same matrices: min |D2 r|^2 + PULL |N2 r - field|^2."""

    def __init__(self, first: Illuminant, second: Illuminant | None) -> None:
        axis = _axis()
        self.colors = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
        self.first = stimulus_matrix([first])
        self.second = None if second is None else stimulus_matrix([second])
        knots = TEXTURE_GRID.size
        difference = np.diff(np.eye(knots), 2, axis=0)
        # A slope of 1e-4 of the second difference makes the program strictly convex: a line has no second difference.
        slope = np.diff(np.eye(knots), axis=0)
        self.smoothness = difference.T @ difference + 1e-4 * slope.T @ slope + 1e-9 * np.eye(knots)

    def solve(self, field: Array | None, only: NDArray[np.intp] | None = None) -> Array:
        """Reflectances (m, n) of the nodes ``only``; ``field``: (m, 3), colors wanted under the second light."""
        import daqp

        chosen = np.arange(len(self.colors)) if only is None else only
        hessian = self.smoothness
        if field is not None and self.second is not None:
            hessian = hessian + PULL * self.second.T @ self.second
        knots = len(hessian)
        upper = np.concatenate([np.ones(knots), np.zeros(3)])
        lower = np.zeros(knots + 3)
        sense = np.concatenate([np.zeros(knots), np.full(3, 5)]).astype(np.int32)  # 5: an equality, always active
        answers = np.empty((len(chosen), knots))
        linear = np.zeros(knots)
        for row, node in enumerate(chosen):
            upper[knots:] = lower[knots:] = self.colors[node]
            if field is not None and self.second is not None:
                linear = -PULL * self.second.T @ field[row]
            found, _, status, _ = daqp.solve(hessian, linear, self.first, upper, lower, sense)
            if status != 1:
                raise SolveError(
                    f"no smooth reflectance was found for the color {self.colors[node].round(3).tolist()} (status "
                    f"{status}); the first light may lack a part of the visible range"
                )
            answers[row] = found
        return np.clip(answers, 0.0, 1.0)


def _pinned(nodes: _LatticeSolver, plain: Array, pins: Sequence[Pin]) -> tuple[Array, tuple[PinResult, ...]]:
    """Lattice whose interpolated colors meet the pins, by correcting the strength of each bump a few times."""
    assert nodes.second is not None
    plain_field = plain @ nodes.second.T
    at_pins = np.stack([pin.color for pin in pins])
    cells, shares = _cell(at_pins)
    bumps = np.exp(-((nodes.colors[:, None] - at_pins) ** 2).sum(axis=2) / (2 * WIDTH**2))
    moved = np.flatnonzero(bumps.max(axis=1) > 1e-3)
    nearest = [_nearest_reachable(nodes, pin, shares[k] @ plain_field[cells[k]]) for k, pin in enumerate(pins)]
    wanted = np.stack([color for color, _ in nearest])
    strength = np.zeros((len(pins), 3))
    lattice = plain.copy()
    overlap = np.einsum("pk,pkq->pq", shares, bumps[cells])
    for _ in range(CORRECTIONS):
        reached = np.einsum("pk,pkc->pc", shares, lattice[cells] @ nodes.second.T)
        # Bumps of neighboring pins overlap; the small system shares the missing color among them.
        strength += np.linalg.lstsq(overlap, wanted - reached, rcond=1e-6)[0]
        lattice[moved] = nodes.solve(plain_field[moved] + bumps[moved] @ strength, moved)
    reached = np.einsum("pk,pkc->pc", shares, lattice[cells] @ nodes.second.T)
    return lattice, tuple(
        PinResult(
            color, _difference(color, pin.wanted), possible, target, _difference(color, target)
        )
        for color, pin, (target, possible) in zip(reached, pins, nearest, strict=True)
    )  # fmt: skip


def _difference(color: Array, wanted: Array) -> float:
    return float(delta_e_2000(lab_from_linear_rgb(color), lab_from_linear_rgb(wanted)))


def _nearest_reachable(nodes: _LatticeSolver, pin: Pin, plain: Array) -> tuple[Array, bool]:
    """The last reachable color on the way from the plain color to the wanted one, and whether the wanted one is."""
    from scipy.optimize import linprog

    assert nodes.second is not None
    knots = nodes.first.shape[1]
    # max t: N1 r = color, N2 r = plain + t (wanted - plain), 0 <= r <= 1, 0 <= t <= 1
    equations = np.vstack(
        [np.hstack([nodes.first, np.zeros((3, 1))]), np.hstack([nodes.second, (plain - pin.wanted)[:, None]])]
    )
    answer = linprog(
        np.append(np.zeros(knots), -1.0), A_eq=equations, b_eq=np.concatenate([pin.color, plain]),
        bounds=[(0.0, 1.0)] * (knots + 1), method="highs-ds",
    )  # fmt: skip
    share = float(answer.x[-1]) if answer.status == 0 else 0.0
    require_range("reachable share", share, 0.0, 1.0 + 1e-9)
    return plain + share * (pin.wanted - plain), share >= 1 - 1e-9
