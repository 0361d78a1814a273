# SPDX-License-Identifier: GPL-3.0-or-later
"""The spectra of a palette while it is being solved: the unknowns, and all spectra at the points of the sums."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.kernel import ColorKernel, color_kernel
from spectral_core.palette.assemble.wishes import Condition
from spectral_core.palette.problem import PaletteProblem
from spectral_core.spectra.observer import STANDARD

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PaletteState:
    """Unknown values (None where a spectrum is given), the kernel, and the common factor of all lights."""

    kernel: ColorKernel
    lights: tuple[Array | None, ...]
    """(n,) on the grid, or (p,) amounts of primaries."""
    reflectances: tuple[Array | None, ...]
    light_bases: tuple[Array | None, ...]
    """(m, p) spectra of the primaries at the points; None: the grid's own hats."""
    given_lights: tuple[tuple[Array, ...], ...]
    """(m,) each: the given light, then its variants, before ``light_scale``; empty where it is designed."""
    given_reflectances: tuple[Array | None, ...]
    light_scale: float = 1.0

    def lights_at_points(self, variant: int | None = None) -> Array:
        """All lights, (L, m); those without that variant as they are."""
        rows = []
        for values, basis, given in zip(self.lights, self.light_bases, self.given_lights, strict=True):
            if values is None:
                chosen = 0 if variant is None or variant + 1 >= len(given) else variant + 1
                rows.append(self.light_scale * given[chosen])
            else:
                rows.append(self.kernel.at_points(values) if basis is None else basis @ values)
        return np.stack(rows)

    def reflectances_at_points(self) -> Array:
        """All reflectances, (R, m)."""
        rows = [
            given if values is None else self.kernel.at_points(values)
            for values, given in zip(self.reflectances, self.given_reflectances, strict=True)
        ]
        return np.stack([row for row in rows if row is not None])

    def colors(self, condition: Condition = Condition(0, None)) -> Array:  # noqa: B008  (frozen)
        """Linear RGB (R, L, 3) of every cell."""
        lights = self.lights_at_points(condition.variant)
        return self.kernel.colors(self.reflectances_at_points(), lights)[condition.observer]

    def with_reflectances(self, values: dict[int, Array]) -> PaletteState:
        """The state with some unknown reflectances replaced."""
        return replace(self, reflectances=tuple(values.get(i, old) for i, old in enumerate(self.reflectances)))

    def with_lights(self, values: dict[int, Array]) -> PaletteState:
        """The state with some unknown lights replaced."""
        return replace(self, lights=tuple(values.get(i, old) for i, old in enumerate(self.lights)))

    def brightened(self, factor: float) -> PaletteState:
        """All lights times ``factor``."""
        lights = tuple(None if values is None else values * factor for values in self.lights)
        return replace(self, lights=lights, light_scale=self.light_scale * factor)


def initial_state(problem: PaletteProblem, warm: PaletteState | None = None) -> PaletteState:
    """Start spectra: designed lights as given, reflectances mid grey; ``warm`` where its unknowns have its shape."""
    given_surfaces = [item.spectrum for item in problem.reflectances if item.spectrum is not None]
    kernel = color_kernel(problem.grid, problem.observers or (STANDARD,), given_surfaces)
    points = kernel.spectrum_at_points
    middle = np.clip(0.5, *problem.reflectance_bounds)
    lights: list[Array | None] = []
    bases: list[Array | None] = []
    given: list[tuple[Array, ...]] = []
    for light in problem.lights:
        basis = np.stack([points(each) for each in light.primaries], axis=1) if light.primaries else None
        start = None
        if light.free:
            start = np.full(basis.shape[1], 1.0) if basis is not None else np.array(light.spectrum.values)
        lights.append(start)
        bases.append(basis)
        given.append(() if light.free else tuple(points(each) for each in (light.spectrum, *light.variants)))
    reflectances = [np.full(problem.grid.size, middle) if item.free else None for item in problem.reflectances]
    known = [None if item.spectrum is None else points(item.spectrum) for item in problem.reflectances]
    state = PaletteState(kernel, tuple(lights), tuple(reflectances), tuple(bases), tuple(given), tuple(known))
    state = _primaries_near_start(problem, state)
    if warm is None or not _same_shape(state, warm):
        return state
    if not problem.scale_lights and warm.light_scale != 1.0:
        warm = warm.brightened(1.0 / warm.light_scale)
    return replace(state, lights=warm.lights, reflectances=warm.reflectances, light_scale=warm.light_scale)


def _primaries_near_start(problem: PaletteProblem, state: PaletteState) -> PaletteState:
    """Amounts of primaries that come nearest to each light's start spectrum."""
    from scipy.optimize import nnls

    values = {}
    for j, (light, basis) in enumerate(zip(problem.lights, state.light_bases, strict=True)):
        if basis is not None:
            amounts, _ = nnls(basis, state.kernel.spectrum_at_points(light.spectrum))
            # Every primary starts lit: a reflectance designed under an unlit one would not know of it.
            values[j] = amounts + 0.01 * max(float(amounts.max(initial=0.0)), 1e-3)
    return state.with_lights(values)


def _same_shape(state: PaletteState, warm: PaletteState) -> bool:
    def shapes(values: tuple[Array | None, ...]) -> list[tuple[int, ...] | None]:
        return [None if each is None else each.shape for each in values]

    return shapes(state.lights) == shapes(warm.lights) and shapes(state.reflectances) == shapes(warm.reflectances)
