# SPDX-License-Identifier: GPL-3.0-or-later
"""Solved spectra of the palette, given to materials, lights and worlds of the scene."""

from bpy.types import ID, PropertyGroup

from spectral_core.errors import InvalidInputError
from spectral_core.spectra.observer import xyz_of

from ..spectra.stored import kind_of, spectrum_of, store_spectrum


def store_result(target: ID, entry: PropertyGroup) -> None:
    """Give ``target`` the solved spectrum of a row or column; a light also the brightness that the design gives it.

    Raises InvalidInputError where the palette is not solved.
    """
    spectrum = spectrum_of(entry, "result")
    if spectrum is None:
        raise InvalidInputError(f"{entry.name!r} has no designed spectrum yet; solve the palette first")
    luminous = kind_of(entry) == "illuminant"
    store_spectrum(target.spectral, spectrum, strength=float(xyz_of(spectrum)[1]) if luminous else 1.0)
