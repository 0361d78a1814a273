# SPDX-License-Identifier: GPL-3.0-or-later
"""A volume shader as data: its coefficients as programs, and the media that they make in a region of space."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Color, MediumGrid, ScatteringMedium, gray
from spectral_core.scene.shading.program import Program

from .phases import Lobes

Rgb = NDArray[np.float64]
Coefficients = tuple[Rgb, Rgb, Rgb]
"""Scattering, absorption and emission per unit of length, linear RGB: (3,), or (..., 3) at points."""

ALIKE = 1e-5
"""Largest difference, relative to the largest coefficient, of two colors that count as one."""


@dataclass(frozen=True, eq=False)
class Filling:
    """A volume shader. ``programs``: of scattering, absorption and emission; ``lobes``: its phase functions.

    ``spectral``: in place of the programs a medium of density 1 with a spectrum as its color, and ``density``: its
    density. ``is_cubic``: grids are interpolated by cubic B-splines, not linearly.
    """

    programs: tuple[Program, Program, Program] | None = None
    lobes: Lobes = ()
    spectral: ScatteringMedium | None = None
    density: Program | None = None
    is_cubic: bool = False

    @property
    def programs_of(self) -> tuple[Program, ...]:
        """Each program that a medium needs."""
        return tuple(p for p in (*(self.programs or ()), self.density) if p is not None)

    @property
    def inputs(self) -> frozenset[str]:
        """Names of the quantities of the point that it reads."""
        return frozenset().union(*(program.inputs for program in self.programs_of))

    def alike(self, evaluate: Callable[[Program], NDArray[Any]]) -> ScatteringMedium | None:
        """The homogeneous medium of the means over points; None for empty space. ``evaluate``: as in ``inside``."""
        if self.spectral is not None:
            assert self.density is not None
            density = float(np.maximum(_finite(evaluate(self.density), 1), 0.0).mean())
            return replace(self.spectral, density=density) if density > 0 else None
        assert self.programs is not None
        found = [np.maximum(_finite(evaluate(program), 3), 0.0).mean(axis=0) for program in self.programs]
        return _medium((found[0], found[1], found[2]), self.lobes, None)

    def inside(
        self, evaluate: Callable[[Program], NDArray[Any]], shape: tuple[int, int, int], world_from_index: Rgb
    ) -> ScatteringMedium | None:
        """The medium in a region; None for empty space.

        ``evaluate``: values of a program at the region's voxels, (n,) or (n, 3).
        """
        if self.spectral is not None:
            assert self.density is not None
            values = np.maximum(_finite(evaluate(self.density), 1)[:, 0], 0.0)
            most = float(values.max())
            if most <= 0:
                return None
            factor = _grid(values / most, shape)
            grid = MediumGrid(world_from_index, scattering=factor, absorption=factor)
            return replace(self.spectral, density=most, grid=grid)
        assert self.programs is not None
        found = [np.maximum(_finite(evaluate(program), 3), 0.0) for program in self.programs]
        return _medium((found[0], found[1], found[2]), self.lobes, (shape, world_from_index))


def _finite(values: NDArray[Any], width: int) -> Rgb:
    flat = np.asarray(values, dtype=np.float64)
    flat = flat[:, None] if flat.ndim == 1 else flat
    return np.nan_to_num(np.broadcast_to(flat, (len(flat), width)), nan=0.0, posinf=0.0, neginf=0.0)


def _grid(values: Rgb, shape: tuple[int, int, int]) -> NDArray[np.float32]:
    # rounded down: the largest factor is 1
    wide = np.minimum(values, 1.0).astype(np.float32)
    return wide.reshape(*shape, *wide.shape[1:])


def _medium(
    found: Coefficients, lobes: Lobes, region: tuple[tuple[int, int, int], Rgb] | None
) -> ScatteringMedium | None:
    """A medium of coefficients: (3,), or (n, 3) at the voxels of a region."""
    scatters, absorbs, emissions = (np.atleast_2d(values) for values in found)
    extinction = scatters + absorbs
    density, strength = float(extinction.max()), float(emissions.max())
    if not (density > 0 or strength > 0):
        return None
    at = int(extinction.max(axis=1).argmax())
    made = ScatteringMedium(
        density=1.0,
        color=Color(_share(scatters[at], extinction[at])),
        extinction=Color(extinction[at]),
        emission_color=Color(emissions[int(emissions.max(axis=1).argmax())] / strength) if strength > 0 else gray(1.0),
        emission_strength=strength,
        lobes=lobes,
    )
    if region is None:
        return made
    shape, world_from_index = region
    emitted = _amount(emissions, strength)
    emission = None if emitted is None else _grid(emitted, shape)
    factor = _factor(scatters, absorbs, at)
    if factor is not None:
        dust = _grid(factor, shape)
        return replace(made, grid=MediumGrid(world_from_index, dust, dust, emission))
    most = scatters.max(axis=0), extinction.max(axis=0)
    bounds = Color(np.minimum(most[1] / density, 1.0))
    grid = MediumGrid(world_from_index, _grid(scatters / density, shape), _grid(absorbs / density, shape), emission)
    return replace(made, density=density, extinction=bounds, color=Color(np.minimum(_share(*most), 1.0)), grid=grid)


def _share(part: Rgb, whole: Rgb) -> Rgb:
    return np.asarray(np.divide(part, whole, out=np.zeros(3), where=whole > 0))


def _factor(scatters: Rgb, absorbs: Rgb, at: int) -> Rgb | None:
    """One factor (n,) for scattering and absorption, if their colors are everywhere those of voxel ``at``."""
    density = float((scatters[at] + absorbs[at]).max())
    if density <= 0:
        return np.zeros(len(scatters))
    factor = np.asarray((scatters + absorbs).max(axis=1) / density)
    for values in (scatters, absorbs):
        if np.abs(values - factor[:, None] * values[at]).max() > ALIKE * density:
            return None
    return factor


def _amount(emissions: Rgb, strength: float) -> Rgb | None:
    """Emission as a factor, or as a color where its color varies; None if it does not vary."""
    if strength <= 0:
        return None
    factor = np.asarray(emissions.max(axis=1) / strength)
    color = emissions[int(factor.argmax())] / strength
    if np.abs(emissions / strength - factor[:, None] * color).max() <= ALIKE:
        return None if np.ptp(factor) <= ALIKE else factor
    return np.asarray(emissions / strength)
