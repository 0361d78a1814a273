# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the whole table, by their declaration ``PALETTE_FIELDS``, for the core and back."""

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from spectral_core.errors import InvalidInputError
from spectral_core.palette import PaletteProblem
from spectral_core.spectra.observer import STANDARD, xyz_of
from spectral_core.spectra.spectrum import SpectralGrid

from ...properties.palette.table import PALETTE_FIELDS, SpectralPalette
from ..context import finite

PHYSICAL = {"reflectance_bounds": (0.0, 1.0), "light_bounds": (0.0, np.inf)}
UNBOUNDED = (-np.inf, np.inf)
Values = dict[str, Any]


def settings_of(palette: bpy.types.PropertyGroup) -> dict[str, Any]:
    """Keyword arguments of PaletteProblem. Raises InvalidInputError for wavelengths in descending order, and NaN."""
    values = {name: getattr(palette, name) for name in PALETTE_FIELDS}
    for name in [name for name, value in values.items() if isinstance(value, float)]:
        finite(palette, name, "of the table")
    named = {core: name for name, field in PALETTE_FIELDS.items() for core in field.core}
    return {core: _READ[core](values) if core in _READ else values[name] for core, name in named.items()}


def store_settings(palette: bpy.types.PropertyGroup, problem: PaletteProblem) -> list[str]:
    """Store the settings of a problem; returns a text on each number that the table limits.

    ``require_storable`` checks beforehand that the table can represent everything else.
    """
    notes = []
    for name, field in PALETTE_FIELDS.items():
        stated = _stored(name, problem)
        setattr(palette, name, stated)
        kept = getattr(palette, name)
        if isinstance(kept, (int, float)) and not np.isclose(kept, float(stated), rtol=1e-5, atol=1e-9):
            notes.append(f"{field.core[0]} {stated:g} became {kept:g}, which is the limit of the table")
    return notes


def _stored(name: str, problem: PaletteProblem) -> Any:
    stated = getattr(problem, PALETTE_FIELDS[name].core[0])
    return _STORED[name](stated) if name in _STORED else stated


def require_storable(problem: PaletteProblem) -> None:
    """Raise InvalidInputError for a setting or a light that the table cannot represent."""
    grid = problem.grid
    steps = np.diff(grid.wavelengths_nm)
    if grid.interpolation != "linear" or np.ptp(steps) > 1e-6 * steps[0]:
        raise InvalidInputError(
            f"this palette is on {grid} ({grid.interpolation}); the table designs on equal steps, linear between "
            "them. Give the file a [grid] of start_nm, stop_nm and step_nm, or solve it with spectral-scene design"
        )
    for name in ("grid_start", "grid_stop", "grid_samples"):
        own, stated = SpectralPalette.bl_rna.properties[name], _stored(name, problem)
        if not own.hard_min <= stated <= own.hard_max:
            raise InvalidInputError(
                f"this palette has {own.name} {stated:g}; the table supports {own.hard_min:g} to {own.hard_max:g}. "
                "Give the file another [grid], or solve it with spectral-scene design"
            )
    for light in problem.lights:
        for lamp in (light.spectrum, *light.primaries, *light.variants):
            if not xyz_of(lamp)[1] > 0:
                raise InvalidInputError(
                    f"the light {lamp.name!r} shows nothing to the eye, and the table states lights by their "
                    "brightness; give it power between 380 and 780 nm, or solve the file with spectral-scene design"
                )
    bounds = {name: getattr(problem, name) for name in PHYSICAL}
    if bounds != PHYSICAL and any(ends != UNBOUNDED for ends in bounds.values()):
        raise InvalidInputError(
            f"this palette bounds reflectances by {problem.reflectance_bounds} and lights by {problem.light_bounds}; "
            "the table supports physical spectra, or no bounds at all"
        )
    if problem.observers[0] != STANDARD:
        raise InvalidInputError(
            f"this palette states its colors for the observer {problem.observers[0]!r}; the table states them for "
            f"{STANDARD!r}. Put that one first and adapt the colors, or solve the file with spectral-scene design"
        )
    if problem.subspace is not None:
        raise InvalidInputError(
            "this palette has a subspace criterion, which the table does not support; use the library"
        )


def _grid(values: Values) -> SpectralGrid:
    """The wavelengths of designed spectra."""
    first, last = values["grid_start"], values["grid_stop"]
    if last <= first:
        raise InvalidInputError(f"the wavelengths are from {first:g} to {last:g} nm; the second must be larger")
    return SpectralGrid(np.linspace(first, last, values["grid_samples"]))


def _observers(values: Values) -> tuple[str, ...]:
    """The standard observer always first: its colors are the targets."""
    return (STANDARD, *sorted(values["observers"] - {STANDARD}))


def _bounds(core: str) -> Callable[[Values], tuple[float, float]]:
    return lambda values: UNBOUNDED if values["allow_negative"] else PHYSICAL[core]


_READ: dict[str, Callable[[Values], Any]] = {
    "grid": _grid,
    "observers": _observers,
    **{core: _bounds(core) for core in PHYSICAL},
}
"""Functions that read a core attribute from a property of another type."""
_STORED: dict[str, Callable[[Any], Any]] = {
    "grid_start": lambda grid: grid.wavelengths_nm[0],
    "grid_stop": lambda grid: grid.wavelengths_nm[-1],
    "grid_samples": lambda grid: grid.size,
    "observers": set,
    "allow_negative": lambda bounds: bounds[0] < 0,
}
"""Functions that store a core attribute in a property of another type."""
