# SPDX-License-Identifier: GPL-3.0-or-later
"""φ of plain palettes in a few stacked products: targets only, one observer, no exact and no shared colors.

Each reflectance is then a separate problem, which daqp solves in microseconds; a thousand evaluations take a second.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.side import COLOR_NORM, LAB_UNIT, Assembler
from spectral_core.palette.assemble.state import PaletteState
from spectral_core.palette.qp.arrow import CAP
from spectral_core.palette.qp.quadratic import FAR
from spectral_core.palette.qp.squares import RIDGE
from spectral_core.spectra.color import lab_jacobian_from_linear_rgb

Array = NDArray[np.float64]


@dataclass(eq=False)
class PlainPalette:
    """Constants of the design of lights."""

    weights: Array
    """(R, L): squared weights of targets, 0 without a target."""
    targets: Array
    """(R, L, 3)."""
    reflectances: tuple[int, ...]
    lights: tuple[int, ...]
    bounds: tuple[Array, Array]
    surface_gram: Array
    light_gram: Array
    metric: Array | None = None
    """(R, L, 3, 3): Jacobian of CIELAB at the targets; None for linear RGB."""

    def __post_init__(self) -> None:
        rows = len(self.weights)
        self._weights3, self._targets3 = np.repeat(self.weights, 3, axis=1), self.targets.reshape(rows, -1)
        self._alike = np.array([[np.array_equal(one, other) for other in self.weights] for one in self.weights])
        n = len(self.surface_gram)
        self._no_rows, self._no_sense = np.zeros((0, n)), np.zeros(n, dtype=np.int32)
        self._measured: Array | None = None
        self._last = np.zeros((rows, n))
        # Each starts from the active bounds of its last solution, and needs fewer steps.
        self._models: dict[int, Any] = {}

    @classmethod
    def of(cls, assembler: Assembler, *, perceptual: bool = False) -> Self | None:
        """The arrays of a palette; None if it is not plain."""
        problem, requests = assembler.problem, assembler.requests
        plain = not requests.groups and len(requests.conditions) == 1 and not any(t.exact for t in requests.targets)
        if not plain or any(light.free and light.primaries for light in problem.lights):
            return None
        shape = (len(problem.reflectances), len(problem.lights))
        weights, targets = np.zeros(shape), np.zeros((*shape, 3))
        for target in requests.targets:
            weights[target.cell] = target.weight**2 / COLOR_NORM**2
            targets[target.cell] = target.color
        positive = weights[weights > 0]
        # Beyond this the normal equations of daqp lose digits; the engine's border rows do not.
        if positive.size == 0 or positive.max() > CAP * positive.min():
            return None
        free = assembler.free_items("reflectances"), assembler.free_items("lights")
        n = problem.grid.size
        ends = np.clip(problem.reflectance_bounds, -FAR, FAR)
        return cls(
            weights, targets, *free, (np.full(n, ends[0]), np.full(n, ends[1])),
            assembler.roughness("reflectances")[1], assembler.roughness("lights")[1],
            lab_jacobian_from_linear_rgb(targets) / LAB_UNIT if perceptual else None,
        )  # fmt: skip

    def objective(self, state: PaletteState) -> tuple[float, Array, PaletteState]:
        """φ, its gradient by all designed lights, and the state with the best reflectances."""
        kernel, designed = state.kernel, list(self.lights)
        lights = np.array([_known(state.lights[j]) for j in designed])
        by_light = self._light_matrices(state, lights)
        n = by_light.shape[2]
        flat = by_light.reshape(-1, n)
        surfaces = self._surfaces(by_light)
        errors = surfaces @ flat.T - self._targets3
        given = [i for i in range(len(surfaces)) if i not in self.reflectances]
        for i in given:
            errors[i] = state.given_colors(i).ravel() - self._targets3[i]
        if self.metric is None:
            forces = self._weights3 * errors
        else:
            shaped = errors.reshape(self.targets.shape)[..., None]
            metric = self.metric
            forces = (metric.swapaxes(-1, -2) @ (self.weights[..., None, None] * (metric @ shaped))).reshape(
                errors.shape
            )
        own = surfaces[list(self.reflectances)]
        rough = lights @ self.light_gram
        total = 0.5 * float(np.vdot(forces, errors) + np.vdot(own @ self.surface_gram, own) + np.vdot(rough, lights))
        # ∂F/∂l of every light at once: forces (L, 3R) on the color matrices (3R, n) of the surfaces.
        by_surface = kernel.matrices(surfaces)[0]
        for i in given:
            by_surface[i] = _known(state.given.reflectances[i])[0]
        by_surfaces = forces.reshape(len(surfaces), -1, 3).transpose(1, 0, 2)[designed].reshape(len(designed), -1)
        gradient = by_surfaces @ by_surface.reshape(-1, n) + rough
        found = state.with_values("reflectances", {i: surfaces[i] for i in self.reflectances})
        return total, gradient.ravel(), found

    def _light_matrices(self, state: PaletteState, lights: Array) -> Array:
        """(L, 3, n); those of measured lights are computed once."""
        designed = state.kernel.matrices(lights)[0]
        if len(lights) == len(state.lights):
            return designed
        if self._measured is None:
            self._measured = state.light_matrices()[0]
        found = self._measured.copy()
        found[list(self.lights)] = designed
        return found

    def _surfaces(self, by_light: Array) -> Array:
        """(R, n): the best reflectance for each row of targets; 0 for measured ones."""
        flat = by_light.reshape(-1, by_light.shape[2])
        found = np.zeros((len(self.targets), flat.shape[1]))
        if self.metric is not None:
            # Every cell has its own metric, so that no two reflectances share their curvature.
            for i in self.reflectances:
                rows = (self.metric[i] @ by_light).reshape(flat.shape)
                weighted = rows.T * self._weights3[i]
                wanted = (self.metric[i] @ self.targets[i][..., None]).ravel()
                hessian = self._ridged(weighted @ rows + self.surface_gram)
                found[i] = self._reflectance(i, hessian, -(weighted @ wanted))
            return found
        linear = -(self._weights3 * self._targets3) @ flat
        before = None
        for i in self.reflectances:
            if before is None or not self._alike[i, before]:
                hessian = self._ridged((flat.T * self._weights3[i]) @ flat + self.surface_gram)
                before = i
            found[i] = self._reflectance(i, hessian, linear[i])
        return found

    @staticmethod
    def _ridged(hessian: Array) -> Array:
        index = np.arange(len(hessian))
        hessian[index, index] += RIDGE * max(float(np.trace(hessian)) / len(hessian), 1e-12)
        return hessian

    def _reflectance(self, i: int, hessian: Array, linear: Array) -> Array:
        import daqp

        low, high = self.bounds
        model = self._models.get(i)
        if model is None:
            model = self._models[i] = daqp.Model()
            model.setup(hessian, linear, self._no_rows, high, low, self._no_sense)
        else:
            model.update(H=hessian, f=linear)
        x, _, flag, _ = model.solve()
        if flag <= 0 or not np.isfinite(x).all():
            # bounds of the last solution that are unsuitable for this light; a cold start has no such problem
            del self._models[i]
            x, _, _, _ = daqp.solve(hessian, linear, self._no_rows, high, low, self._no_sense)
        if np.isfinite(x).all():
            self._last[i] = np.minimum(np.maximum(x, low), high)
        return self._last[i]


def _known(values: Array | None) -> Array:
    assert values is not None  # of a designed spectrum
    return values
