# SPDX-License-Identifier: GPL-3.0-or-later
"""The spectra of a palette while it is being solved: the unknowns, and the color matrices of given spectra."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.kernel import ColorKernel, color_kernel
from spectral_core.palette.assemble.requests import Condition
from spectral_core.palette.problem import PaletteLight, PaletteProblem
from spectral_core.spectra.spectrum import Illuminant

Array = NDArray[np.float64]

FIRST = Condition(0, None)
"""The condition of the targets."""


@dataclass(frozen=True, eq=False)
class Given:
    """Color matrices of all given spectra; computed once per problem."""

    lights: tuple[Array | None, ...]
    """(V + 1, O, 3, n): a measured light and its variants; None if it is designed."""
    primaries: tuple[Array | None, ...]
    """(p, O, 3, n): the primaries of a designed light; None without primaries."""
    reflectances: tuple[Array | None, ...]
    """(O, 3, n): a measured reflectance, acting on lights of the grid; None if it is designed."""
    both: dict[tuple[int, int], Array]
    """(V + 1 or p, O, 3): colors of measured reflectances under measured lights, or under each primary."""
    primary_colors: tuple[Array | None, ...]
    """(p, 3): color of each primary, for the first observer."""
    units: tuple[Array | None, ...]
    """(p,): the brightness of each primary as it is given, a power of two; None without primaries. All colors of
    primaries are divided by it, so that no solver's tolerance depends on the unit of a file's power.
    """


@dataclass(frozen=True, eq=False)
class PaletteState:
    """Unknown values (None for a given spectrum), and the common factor of all lights."""

    kernel: ColorKernel
    given: Given
    lights: tuple[Array | None, ...]
    """(n,) on the grid, or (p,) amounts of primaries times their units."""
    reflectances: tuple[Array | None, ...]
    light_scale: float = 1.0
    record: Any = field(default=None, repr=False)
    """The last solve of each side, from which conflicts are explained."""

    def light_matrices(self, variant: int | None = None) -> Array:
        """(O, L, 3, n): color of a reflectance on the grid under each light; lights without that variant unchanged."""
        found = np.empty((len(self.kernel.observers), len(self.lights), 3, self.kernel.grid.size))
        for j, values in enumerate(self.lights):
            known, primaries = self.given.lights[j], self.given.primaries[j]
            if known is not None:
                found[:, j] = self.light_scale * known[_choice(known, variant)]
            elif primaries is not None:
                assert values is not None
                found[:, j] = np.tensordot(values, primaries, axes=1)
        own = [j for j, known in enumerate(self.given.lights) if known is None and self.given.primaries[j] is None]
        return self._with_designed(found, self.lights, own)

    def _with_designed(self, found: Array, values: tuple[Array | None, ...], which: list[int]) -> Array:
        """The matrices of spectra on the grid, all at once, written into ``found``."""
        designed = [each for each in (values[k] for k in which) if each is not None]
        if designed:
            found[:, which] = self.kernel.matrices(np.stack(designed))
        return found

    @cached_property
    def reflectance_matrices(self) -> Array:
        """(O, R, 3, n): color of a light on the grid on each reflectance."""
        found = np.empty((len(self.kernel.observers), len(self.reflectances), 3, self.kernel.grid.size))
        for i, values in enumerate(self.reflectances):
            if values is None:
                found[:, i] = self.given.reflectances[i]
        own = [i for i, values in enumerate(self.reflectances) if values is not None]
        return self._with_designed(found, self.reflectances, own)

    def primary_matrix(self, i: int, j: int) -> Array:
        """(O, 3, p): color of reflectance i under unit amounts of the primaries of light j."""
        values, primaries = self.reflectances[i], self.given.primaries[j]
        assert primaries is not None
        shown = self.given.both[i, j] if values is None else primaries @ values
        return np.moveaxis(shown, 0, 2)

    def colors(self, condition: Condition = FIRST, matrices: Array | None = None) -> Array:
        """Linear RGB (R, L, 3) of every cell; ``matrices``: those of the lights, if already computed."""
        by_light = (self.light_matrices(condition.variant) if matrices is None else matrices)[condition.observer]
        designed = [values for values in self.reflectances if values is not None]
        if len(designed) == len(self.reflectances):
            shown = np.array(designed) @ by_light.reshape(-1, by_light.shape[2]).T
            return np.asarray(shown.reshape(len(designed), *by_light.shape[:2]))
        found = np.empty((len(self.reflectances), *by_light.shape[:2]))
        for i, values in enumerate(self.reflectances):
            found[i] = by_light @ values if values is not None else self.given_colors(i, condition)
        return found

    def given_colors(self, i: int, condition: Condition = FIRST) -> Array:
        """(L, 3) of a measured reflectance."""
        found = np.empty((len(self.lights), 3))
        for j, values in enumerate(self.lights):
            both = self.given.both.get((i, j))
            if values is None:
                assert both is not None
                found[j] = self.light_scale * both[_choice(both, condition.variant), condition.observer]
            elif both is not None:
                found[j] = values @ both[:, condition.observer]
            else:
                known = self.given.reflectances[i]
                assert known is not None
                found[j] = known[condition.observer] @ values
        return found

    def amounts(self, j: int) -> Array | None:
        """Amounts of the primaries of a light as they are given, (p,); None without primaries."""
        units, values = self.given.units[j], self.lights[j]
        return None if units is None or values is None else values / units

    def light_limits(self, j: int, bounds: tuple[float, float]) -> tuple[Array, Array]:
        """Least and greatest values of a designed light, whose samples or amounts have ``bounds``."""
        units = self.given.units[j]
        size = np.ones(self.kernel.grid.size) if units is None else units
        return bounds[0] * size, bounds[1] * size

    def with_values(self, side: str, values: dict[int, Array]) -> PaletteState:
        """The state with some unknowns of a side replaced."""
        if side == "lights":
            return replace(self, lights=tuple(values.get(k, each) for k, each in enumerate(self.lights)))
        surfaces = tuple(values.get(k, each) for k, each in enumerate(self.reflectances))
        return PaletteState(self.kernel, self.given, self.lights, surfaces, self.light_scale, self.record)

    def brightened_to(self, light_scale: float) -> PaletteState:
        """The state with all lights ``light_scale`` times as bright as the given ones."""
        if light_scale == self.light_scale:
            return self
        factor = light_scale / self.light_scale
        lights = tuple(None if values is None else values * factor for values in self.lights)
        return replace(self, lights=lights, light_scale=light_scale)


def _choice(known: Array, variant: int | None) -> int:
    return 0 if variant is None or variant + 1 >= len(known) else variant + 1


def given_of(problem: PaletteProblem, kernel: ColorKernel) -> Given:
    """Color matrices of all given spectra of a problem."""

    def stacked(spectra: tuple[Illuminant, ...]) -> Array:
        return np.stack([kernel.matrix_of(each) for each in spectra])

    units = tuple(_units(light, kernel) for light in problem.lights)
    both = {}
    for i, item in enumerate(problem.reflectances):
        for j, (light, unit) in enumerate(zip(problem.lights, units, strict=True)):
            lamps = light.primaries if light.free else (light.spectrum, *light.variants)
            if item.spectrum is not None and lamps:
                shown = np.stack([kernel.color_of(lamp, item.spectrum) for lamp in lamps])
                both[i, j] = shown if unit is None else shown / unit[:, None, None]
    mixed = [(light.primaries, unit) for light, unit in zip(problem.lights, units, strict=True)]
    return Given(
        tuple(None if light.free else stacked((light.spectrum, *light.variants)) for light in problem.lights),
        tuple(None if unit is None else stacked(lamps) / unit[:, None, None, None] for lamps, unit in mixed),
        tuple(None if item.spectrum is None else kernel.matrix_of(item.spectrum) for item in problem.reflectances),
        both,
        tuple(
            None if unit is None else np.stack([kernel.color_of(each)[0] for each in lamps]) / unit[:, None]
            for lamps, unit in mixed
        ),
        units,
    )


def _units(light: PaletteLight, kernel: ColorKernel) -> Array | None:
    """Brightness of each primary, or its power if no eye sees it, as a power of two, which divides without rounding."""
    if not light.primaries:
        return None
    seen = np.array([np.abs(kernel.color_of(each)).max() for each in light.primaries])
    sizes = np.where(seen > 0, seen, [np.abs(each.values).max() for each in light.primaries])
    return np.asarray(2.0 ** np.round(np.log2(np.where(sizes > 0, sizes, 1.0))))


def initial_state(problem: PaletteProblem, warm: PaletteState | None = None) -> PaletteState:
    """Start spectra: designed lights as given, reflectances mid gray; values of ``warm`` if their shapes are equal."""
    kernel = color_kernel(problem.grid, problem.observers)
    middle = np.clip(0.5, *problem.reflectance_bounds)
    given = given_of(problem, kernel)
    pairs = zip(problem.lights, given.units, strict=True)
    lights = [_start_of(light, units) if light.free else None for light, units in pairs]
    reflectances = [np.full(problem.grid.size, middle) if item.free else None for item in problem.reflectances]
    state = PaletteState(kernel, given, tuple(lights), tuple(reflectances))
    if warm is None or not _same_shape(state, warm):
        return state
    if not problem.scale_lights:
        warm = warm.brightened_to(1.0)
    return replace(state, lights=warm.lights, reflectances=warm.reflectances, light_scale=warm.light_scale)


def _start_of(light: PaletteLight, units: Array | None) -> Array:
    """Start values of a designed light: its spectrum, or the amounts of primaries nearest to it."""
    if units is None:
        return np.array(light.spectrum.values)
    from scipy.optimize import nnls

    knots = np.unique(np.concatenate([each.grid.wavelengths_nm for each in (light.spectrum, *light.primaries)]))
    powers = np.stack([each.at(knots) for each in light.primaries], axis=1) / units
    amounts, _ = nnls(powers, light.spectrum.at(knots))
    # Every primary starts above 0: a reflectance designed under an unlit primary would not depend on it.
    return np.asarray(amounts + 0.01 * max(float(amounts.max(initial=0.0)), 1e-3))


def _same_shape(state: PaletteState, warm: PaletteState) -> bool:
    def shapes(values: tuple[Array | None, ...]) -> list[tuple[int, ...] | None]:
        return [None if each is None else each.shape for each in values]

    return shapes(state.lights) == shapes(warm.lights) and shapes(state.reflectances) == shapes(warm.reflectances)
