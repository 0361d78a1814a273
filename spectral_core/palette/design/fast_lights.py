# SPDX-License-Identifier: GPL-3.0-or-later
"""φ of plain palettes in a few stacked products: targets only, one observer, nothing exact, nothing shared.

Each reflectance is then a problem by itself, which daqp solves in microseconds; a thousand evaluations take a second.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.side import COLOR_NORM, LAB_UNIT, Assembler
from spectral_core.palette.assemble.state import PaletteState
from spectral_core.palette.qp.arrow import CAP, RIDGE
from spectral_core.spectra.color import lab_jacobian_from_linear_rgb

Array = NDArray[np.float64]

FAR = 1e30


@dataclass(eq=False)
class PlainPalette:
    """What stays the same while lights are designed."""

    weights: Array
    """(R, L): squared weights of targets, 0 where none."""
    targets: Array
    """(R, L, 3)."""
    reflectances: tuple[int, ...]
    lights: tuple[int, ...]
    bounds: tuple[Array, Array]
    surface_gram: Array
    light_gram: Array
    metric: Array | None = None
    """(R, L, 3, 3): Jacobian of CIELAB at the targets; None for linear RGB."""

    @classmethod
    def of(cls, assembler: Assembler, *, perceptual: bool = False) -> Self | None:
        """The arrays of a palette; None where it is not plain."""
        problem, wishes = assembler.problem, assembler.wishes
        plain = not wishes.groups and len(wishes.conditions) == 1 and not any(t.exact for t in wishes.targets)
        if not plain or any(light.free and light.primaries for light in problem.lights):
            return None
        shape = (len(problem.reflectances), len(problem.lights))
        weights, targets = np.zeros(shape), np.zeros((*shape, 3))
        for target in wishes.targets:
            weights[target.cell] = target.weight**2 / COLOR_NORM**2
            targets[target.cell] = target.color
        positive = weights[weights > 0]
        # Normal equations of daqp lose digits past this; the engine's border rows do not.
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
        by_light = state.light_matrices()[0]
        grams = np.matmul(by_light.transpose(0, 2, 1), by_light)
        solved: dict[int, Array] = {}
        total = 0.0
        n = by_light.shape[2]
        flat = by_light.reshape(-1, n)
        hessian, before = None, None
        for i in self.reflectances:
            wanted = self.targets[i]
            if self.metric is not None:
                # Every cell has a metric of its own, so that no two reflectances share their curvature.
                flat = (self.metric[i] @ by_light).reshape(-1, n)
                wanted = (self.metric[i] @ wanted[..., None])[..., 0]
                hessian = self._ridged((flat.T * np.repeat(self.weights[i], 3)) @ flat + self.surface_gram)
            elif hessian is None or before is None or not np.array_equal(before, self.weights[i]):
                before = self.weights[i]
                hessian = self._ridged(np.tensordot(before, grams, axes=1) + self.surface_gram)
            linear = -(self.weights[i][:, None] * wanted).ravel() @ flat
            solved[i] = self._reflectance(hessian, linear)
            total += 0.5 * float(solved[i] @ self.surface_gram @ solved[i])
        state = state.with_values("reflectances", solved)
        by_surface = state.reflectance_matrices[0]
        colors = state.colors(matrices=by_light[None])
        errors = colors - self.targets
        if self.metric is not None:
            errors = (self.metric @ errors[..., None])[..., 0]
        total += 0.5 * float(np.sum(self.weights[..., None] * errors**2))
        forces = self.weights[..., None] * errors
        if self.metric is not None:
            forces = (self.metric.swapaxes(-1, -2) @ forces[..., None])[..., 0]
        values = np.stack([_known(state.lights[j]) for j in self.lights])
        gradient = np.einsum("rlc,rcn->ln", forces[:, list(self.lights)], by_surface, optimize=True)
        pulled = values @ self.light_gram
        total += 0.5 * float(np.sum(pulled * values))
        return total, (gradient + pulled).ravel(), state

    @staticmethod
    def _ridged(hessian: Array) -> Array:
        index = np.arange(len(hessian))
        hessian[index, index] += RIDGE * max(float(np.trace(hessian)) / len(hessian), 1e-12)
        return hessian

    def _reflectance(self, hessian: Array, linear: Array) -> Array:
        import daqp

        n = linear.size
        low, high = self.bounds
        x, _, _, _ = daqp.solve(hessian, linear, np.zeros((0, n)), high, low, np.zeros(n, dtype=np.int32))
        return np.clip(np.asarray(x), low, high)


def _known(values: Array | None) -> Array:
    assert values is not None  # of a designed spectrum
    return values
