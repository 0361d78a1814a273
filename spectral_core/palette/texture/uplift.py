# SPDX-License-Identifier: GPL-3.0-or-later
"""From one picture to spectra, with constraints: "this red looks brown under that lamp".

A lattice of 13 x 13 x 13 colors in linear RGB holds the smoothest reflectances with these colors under the first light.
The weights of a quadratic B-spline between them are at least 0 and reproduce every affine function. So all colors stay
exact under the first light, all reflectances stay within [0, 1], and they vary smoothly. A constraint moves the
lattice's colors under a second light along a smooth bump in color space, so that distant colors stay unchanged.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, read_only_when_copied, real_numbers, require_kind, require_range
from spectral_core.errors import InvalidInputError, SolveError, counted
from spectral_core.palette.given import require_each, sequence_of
from spectral_core.palette.texture.nearest_color import nearest_weights
from spectral_core.palette.texture.reach import TEXTURE_GRID, stimulus_matrix
from spectral_core.palette.texture.spline import NODES, axis, cell
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.spectrum import Illuminant

Array = NDArray[np.float64]
WIDTH = 0.12
"""Standard deviation, in linear RGB, of the region that a constraint moves."""
FIELD_WEIGHT = 300.0
"""Weight of the wanted color under the second light against smoothness."""
INFEASIBLE = -1
"""daqp's status of a program whose bounds and equalities exclude each other."""
CORRECTIONS = 6
REACHED = 1e-4
"""Linear RGB distance below which a wanted color counts as reachable."""


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class Pin:
    """``color``: linear RGB (3,) under the first light whose appearance under the second should be ``wanted`` (3,)."""

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
    """Outcome of a pin: ``color`` (3,) under the second light, ΔE2000 to the wanted one, and to the nearest possible.

    ``reachable``: True if any reflectance has both colors; ``nearest``: the reachable color nearest to the wanted one
    in CIELAB.
    """

    color: Array
    delta_e: float
    reachable: bool
    nearest: Array
    delta_e_nearest: float


@dataclass(frozen=True, slots=True, eq=False)
class Uplift:
    """Lattice of reflectances over linear RGB from 0 to 1.

    ``lattice``: (13, 13, 13, k), weights of the ``basis`` (k, n) on ``TEXTURE_GRID``. Without a given basis its spectra
    are the hat functions of the knots, so that the weights are the reflectances themselves.
    """

    lattice: NDArray[np.float32]
    basis: Array
    lights: tuple[Illuminant, ...]
    pins: tuple[PinResult, ...]
    seconds: float

    def weights(self, linear_rgb: ArrayLike) -> NDArray[np.float32]:
        """Weights (m, k) of colors (m, 3), by the quadratic B-spline of the lattice; float32.

        Raises InvalidInputError for colors outside [0, 1].
        """
        colors = np.atleast_2d(real_numbers("colors", linear_rgb, 3))
        if colors.size and not (colors.min() >= 0 and colors.max() <= 1):
            raise InvalidInputError(
                f"colors span {colors.min():g} to {colors.max():g}; a reflectance has linear RGB from 0 to 1"
            )
        corners, shares = cell(colors)
        flat = self.lattice.reshape(-1, self.lattice.shape[-1])
        found = np.zeros((len(colors), flat.shape[1]), dtype=np.float32)
        for corner, share in zip(corners.T, shares.T.astype(np.float32), strict=True):
            found += share[:, None] * flat[corner]
        return np.clip(found, 0.0, 1.0)

    def spectra(self, linear_rgb: ArrayLike) -> Array:
        """Reflectances (m, n) of colors (m, 3), by the quadratic B-spline of the lattice.

        Raises InvalidInputError for colors outside [0, 1].
        """
        return np.asarray(self.weights(linear_rgb).astype(np.float64) @ self.basis)


def design_uplift(
    first: Illuminant, second: Illuminant | None = None, pins: Sequence[Pin] = (), basis: ArrayLike | None = None,
    slope: float = 1.0,
) -> Uplift:  # fmt: skip
    """Build the lattice of the smoothest reflectances for colors under ``first``, with pins under ``second``.

    Parameters
    ----------
    first : light under which every color is exact.
    second : light of the pins; needed where there are any.
    pins : constraints; two pins closer than half a lattice cell are refused.
    basis : (k, n), spectra on ``TEXTURE_GRID`` that all reflectances are mixed from, never negative and of sum 1. A
        texture of k channels stores mixtures of these. By default every reflectance between 0 and 1 is allowed.
    slope : every color v, also of pins, has the target slope v; below 1 where ``first`` or ``basis`` cannot
        show all display colors.

    Raises
    ------
    InvalidInputError : pins without a second light, contradicting pins, or a first light that cannot show all display
        colors. SolveError : the solver fails at a node.
    """
    started = time.perf_counter()
    pins = sequence_of("pins", pins)
    require_each("pins", pins, Pin, "a Pin")
    for light in (first,) if second is None else (first, second):
        require_kind("a light of the lattice", light, Illuminant, "catalogue.illuminant('D65')")
    if pins and second is None:
        raise InvalidInputError(
            f"{counted(len(pins), 'pin')} without a second light; name the light under which they hold"
        )
    _require_apart(pins)
    spectra = np.eye(TEXTURE_GRID.size) if basis is None else np.asarray(basis, dtype=np.float64)
    nodes = _LatticeSolver(first, second, spectra, slope)
    plain = nodes.solve(None)
    results: tuple[PinResult, ...] = ()
    lattice = plain
    if pins and nodes.second is not None:
        lattice, results = _pinned(nodes, plain, pins)
    lights = (first,) if second is None else (first, second)
    shaped = lattice.reshape(NODES, NODES, NODES, -1).astype(np.float32)
    return Uplift(
        frozen_array("uplift", shaped, dtype=np.float32), frozen_array("basis", spectra), lights, results,
        time.perf_counter() - started,
    )  # fmt: skip


def _require_apart(pins: Sequence[Pin]) -> None:
    for number, pin in enumerate(pins):
        for other in pins[:number]:
            if np.abs(pin.color - other.color).max() < 0.5 / (NODES - 1) and not np.allclose(pin.wanted, other.wanted):
                raise InvalidInputError(
                    f"almost the same color, linear RGB {pin.color.round(3).tolist()}, should look like two different "
                    "colors; keep one of the two"
                )


class _LatticeSolver:
    """One small quadratic program per node, all with the same matrices: min |D2 r|^2 + FIELD_WEIGHT |N2 r - field|^2.

    The unknowns are weights of a basis: r = basis^T w with 0 <= w <= 1.
    """

    def __init__(self, first: Illuminant, second: Illuminant | None, basis: Array, slope: float) -> None:
        positions = axis()
        self.colors = np.stack(np.meshgrid(positions, positions, positions, indexing="ij"), axis=-1).reshape(-1, 3)
        self.slope_of_colors = require_range("slope", slope, 1e-3, 1.0)
        self.first_name = first.name
        self.first = stimulus_matrix([first]) @ basis.T
        self.second = None if second is None else stimulus_matrix([second]) @ basis.T
        knots = TEXTURE_GRID.size
        difference = np.diff(np.eye(knots), 2, axis=0)
        # A slope of 1e-4 of the second difference makes the program strictly convex: a line has no second difference.
        step = np.diff(np.eye(knots), axis=0)
        roughness = difference.T @ difference + 1e-4 * step.T @ step + 1e-9 * np.eye(knots)
        self.smoothness = basis @ roughness @ basis.T

    def solve(self, field: Array | None, only: NDArray[np.intp] | None = None) -> Array:
        """Reflectances (m, n) of the nodes ``only``; ``field``: (m, 3), colors wanted under the second light."""
        import daqp

        chosen = np.arange(len(self.colors)) if only is None else only
        hessian = self.smoothness
        if field is not None and self.second is not None:
            hessian = hessian + FIELD_WEIGHT * self.second.T @ self.second
        knots = len(hessian)
        upper = np.concatenate([np.ones(knots), np.zeros(3)])
        lower = np.zeros(knots + 3)
        sense = np.concatenate([np.zeros(knots), np.full(3, 5)]).astype(np.int32)  # 5: an equality, always active
        answers = np.empty((len(chosen), knots))
        linear = np.zeros((len(chosen), knots))
        if field is not None and self.second is not None:
            linear = -FIELD_WEIGHT * field @ self.second
        # Set up once: the Cholesky factor of the Hessian takes ten times as long as a node's program.
        program = daqp.Model()
        program.setup(hessian, linear[0], np.ascontiguousarray(self.first), upper, lower, sense)
        for row, node in enumerate(chosen):
            upper[knots:] = lower[knots:] = self.slope_of_colors * self.colors[node]
            # The senses are reset, so that no program begins with the active bounds of the one before: the results do
            # not depend on the order.
            program.update(f=linear[row], bupper=upper, blower=lower, sense=sense)
            found, _, status, _ = program.solve()
            if status == INFEASIBLE:
                raise InvalidInputError(
                    f"under {self.first_name!r} no reflectance of the basis shows the linear RGB color "
                    f"{upper[knots:].round(3).tolist()}; expected a first light that looks white and shows all display "
                    f"colors, such as D65: choose another one, or lower the slope ({self.slope_of_colors:g})"
                )
            if status != 1:
                raise SolveError(
                    f"no smooth reflectance was found for the color {self.colors[node].round(3).tolist()}: the solver "
                    f"ended with status {status}; choose another first light or another basis"
                )
            answers[row] = found
        return np.clip(answers, 0.0, 1.0)


def _pinned(nodes: _LatticeSolver, plain: Array, pins: Sequence[Pin]) -> tuple[Array, tuple[PinResult, ...]]:
    """Lattice whose interpolated colors meet the pins, by correcting the strength of each bump a few times."""
    assert nodes.second is not None
    plain_field = plain @ nodes.second.T
    at_pins = np.stack([pin.color for pin in pins])
    cells, shares = cell(at_pins)
    bumps = np.exp(-((nodes.colors[:, None] - at_pins) ** 2).sum(axis=2) / (2 * WIDTH**2))
    moved = np.flatnonzero(bumps.max(axis=1) > 1e-3)
    nearest = [_nearest_reachable(nodes, pin) for pin in pins]
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
            color, _difference(color, nodes.slope_of_colors * pin.wanted), possible, target, _difference(color, target)
        )
        for color, pin, (target, possible) in zip(reached, pins, nearest, strict=True)
    )  # fmt: skip


def _difference(color: Array, wanted: Array) -> float:
    return float(delta_e_2000(lab_from_linear_rgb(color), lab_from_linear_rgb(wanted)))


def _nearest_reachable(nodes: _LatticeSolver, pin: Pin) -> tuple[Array, bool]:
    """The reachable color under the second light nearest to the wanted one, and True if they are equal."""
    assert nodes.second is not None
    color, aim = nodes.slope_of_colors * pin.color, nodes.slope_of_colors * pin.wanted
    found = nearest_weights(nodes.first, nodes.second, color, aim)
    if found is None:
        raise SolveError(f"no reflectance has the color {pin.color.round(3).tolist()} under the first light")
    reached = nodes.second @ found
    possible = bool(np.abs(reached - aim).max() < REACHED)
    return (aim if possible else reached), possible
