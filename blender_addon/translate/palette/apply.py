# SPDX-License-Identifier: GPL-3.0-or-later
"""Solved spectra of the palette, given to materials, lights and worlds of the scene."""

import math

from bpy.types import ID, PropertyGroup, Scene

from spectral_core.spectra.observer import xyz_of

from ..spectra.stored import carried_spectrum, kind_of, store_spectrum


def level_of(palette: PropertyGroup) -> float:
    """How many times brighter the palette's lights are than lights under which a perfect white is white."""
    return float(palette.brightness * palette.light_scale)


def store_result(target: ID, entry: PropertyGroup, *, level: float | None = None) -> None:
    """Give ``target`` the solved spectrum of a row or column; a light also its brightness beside the other lights.

    Parameters
    ----------
    target
        Material, light or world, or what carries a spectrum within one.
    entry
        Row or column of the palette.
    level
        Brightness that is left to the camera's exposure instead of the lights; by default the palette's light level.

    Raises
    ------
    InvalidInputError
        Where the palette is not solved, or ``target`` is linked from another file.
    """
    spectrum = carried_spectrum(entry, "result")
    strength = 1.0
    if kind_of(entry) == "illuminant":
        strength = float(xyz_of(spectrum)[1]) / (level_of(entry.id_data.spectral.palette) if level is None else level)
    store_spectrum(target.spectral, spectrum, strength=strength)
    target.spectral.dyes.clear()
    for designed in getattr(entry, "dyes", ()):
        carried = target.spectral.dyes.add()
        for name in ("excitation_nm", "emission_nm", "amount"):
            setattr(carried, name, getattr(designed, name))


def expose(scene: Scene, level: float) -> None:
    """Let the exposure of the view show the palette's colors; what an earlier call has added is taken back first."""
    palette, stops = scene.spectral.palette, math.log2(level)
    scene.view_settings.exposure += stops - palette.applied_exposure
    palette.applied_exposure = stops
